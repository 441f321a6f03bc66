"""Errors of no known cause: if one of them explains more than the catalogue does, then something is
wrong that has no name here.

Nothing is assumed of the cause: a component of the wrench may err by any smooth function of what
goes on (the time, the load and its moment, how the component changes, where the pelvis is and how
fast it moves), or swing at one frequency. Both are effects like any other, so that they compete
with named ones; what an error goes along with is said.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.polynomial.legendre import legvander
from scipy.ndimage import median_filter

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.dynamics.ground_wrench import move_moments
from bsip_cli.effects.effect import Effect, Parameter, Reported
from bsip_cli.effects.plates import CHANNELS, OF_THE_LAB, unit_of
from bsip_cli.effects.scene import Scene, place_of_stance_m

UNEXPLAINED = "unexplained"
_LARGE = {"N": 40.0, "N m": 20.0}  # sizes by the component's unit: about those of `Yardsticks`


class Nameless(Effect):
    """An error of unknown cause."""

    name = UNEXPLAINED
    scope = "laboratory"
    remedy = "look at plates, cables and everything that touches the person, and record again"


# --- one of the six components --------------------------------------------------------------------


def in_channel(scene: Scene, channel: str, signal: np.ndarray) -> np.ndarray:
    """(N, 6) a signal (N,) in one component of the whole wrench, about where the person stands."""
    of_one = np.eye(6)[[CHANNELS.index(channel)]]
    return signal[:, None] * move_moments(of_one, -place_of_stance_m(scene))


def signal_of(scene: Scene, wrench: np.ndarray, channel: str) -> np.ndarray:
    """(N,) one component of a world wrench (N, 6) about the origin, moments about where the person
    stands."""
    return move_moments(wrench, place_of_stance_m(scene))[:, CHANNELS.index(channel)]


class Tone(Nameless):
    """One component that swings at one frequency."""

    says = (
        "of unknown cause: a swing of {channel} by {amplitude:.1f} {unit}, {frequency:.2f} times "
        "per second"
    )
    FASTEST_HZ = 8.0  # beyond it the low-pass leaves nothing but its own edge
    LINE, AROUND_HZ, MOST_LINES = 30.0, 0.75, 3  # of noise one in 10^9 frequencies is as high

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return CHANNELS

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        unit = unit_of(target)
        duration = max(float(np.ptp(scene.times_s)), 2.0)
        slowest, fastest = 2.0 / duration, min(self.FASTEST_HZ, 0.16 * scene.rate_hz)
        regular = np.linspace(slowest, fastest, min(60, int((fastest - slowest) * duration)))
        key = (UNEXPLAINED, target)
        lines = scene.once(
            key, lambda: self._lines_hz(scene, target, slowest, fastest), of_readings=True
        )
        paces = tuple(float(f) for f in (*regular, *lines))
        return (
            Parameter("cosine", unit, -1e3, 1e3, _LARGE[unit]),
            Parameter("sine", unit, -1e3, 1e3, _LARGE[unit]),
            Parameter("frequency", "Hz", 0.5 * slowest, fastest, 0.3 / duration, paces),
        )

    def _lines_hz(self, scene: Scene, channel: str, slowest: float, fastest: float) -> np.ndarray:
        """(k,) frequencies at which a channel's residual stands far out of its spectrum.

        In a long trial a swing at one frequency would fall between the regular ones.
        """
        from scipy.signal import find_peaks  # heavy: reports never need it

        residual = signal_of(scene, scene.measured - scene.predicted, channel)
        signal = np.where(scene.valid, np.nan_to_num(residual), 0.0)
        signal = np.where(scene.valid, signal - signal[scene.valid].mean(), 0.0)
        count = 2 * len(signal)
        power = np.abs(np.fft.rfft(signal * np.hanning(len(signal)), count)) ** 2
        hertz = np.fft.rfftfreq(count, 1 / scene.rate_hz)
        around = 2 * round(self.AROUND_HZ * count / scene.rate_hz) + 1
        height = power / np.maximum(median_filter(power, around, mode="nearest"), 1e-12)
        peaks, found = find_peaks(height, height=self.LINE)
        lines = hertz[peaks[np.argsort(-found["peak_heights"])][: self.MOST_LINES]]
        return lines[(lines > slowest) & (lines < fastest)]

    def tangent(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        phase = 2 * np.pi * values[2] * (scene.times_s - scene.times_s[0])
        waves = np.cos(phase), np.sin(phase)
        return np.stack([in_channel(scene, target, wave) for wave in waves], axis=-1)

    def reported(self, scene: Scene, target: str, values: np.ndarray) -> Reported:
        amplitude = float(np.hypot(values[0], values[1]))
        return ("amplitude", unit_of(target), amplitude), ("frequency", "Hz", float(values[2]))

    def spoken(self, scene: Scene, target: str, values: np.ndarray) -> dict[str, Any]:
        channel = {"channel": OF_THE_LAB[target], "unit": unit_of(target)}
        return super().spoken(scene, target, values) | channel


# What is large of each quantity: from there on its smooth function hardly changes any more.
_LOAD, _ARM_M, _AWAY_M, _FAST_M_S, _AT_ONCE_S = 0.5, 0.1, 0.2, 0.5, 0.1

_ALL = "all"  # components
ALONG = {
    "time": "the time in the trial",
    "load": "the load",
    "rate": "how fast it changes",
    "bend": "how suddenly it changes",
    "moment_x": "the moment about the lab's X axis",
    "moment_y": "the moment about the lab's Y axis",
    "pelvis_x": "where the pelvis is along the lab's X axis",
    "pelvis_y": "where the pelvis is along the lab's Y axis",
    "pelvis_z": "how high the pelvis is",
    "speed_x": "how fast the pelvis moves along the lab's X axis",
    "speed_y": "how fast the pelvis moves along the lab's Y axis",
    "speed_z": "how fast the pelvis rises or falls",
}


class OfComponents(Nameless):
    """Errors of one component, which are said as they are, or of all, as a force and a moment."""

    @abstractmethod
    def sizes(self, scene: Scene, target: str, values: np.ndarray) -> dict[str, float]:
        """Of each of its components [N, N m]."""

    def reported(self, scene: Scene, target: str, values: np.ndarray) -> Reported:
        sizes = self.sizes(scene, target, values)
        if len(sizes) == 1:
            return tuple(("error", unit_of(x), size) for x, size in sizes.items())
        both = np.linalg.norm(np.reshape(list(sizes.values()), (2, 3)), axis=1).tolist()
        return ("force", "N", both[0]), ("moment", "N m", both[1])

    def spoken(self, scene: Scene, target: str, values: np.ndarray) -> dict[str, Any]:
        which, quantity = target.split(" by ")
        what = ("the force", "the moment") if which == _ALL else (OF_THE_LAB[which],)
        numbers = zip(what, self.reported(scene, target, values), strict=True)
        errors = (f"{x} by {size:.1f} {unit}" for x, (_, unit, size) in numbers)
        return {"errors": " and ".join(errors), "along": ALONG.get(quantity, "")}


class Course(OfComponents):
    """One component, or all, that errs by a smooth function of one quantity."""

    says = "of unknown cause: an error of {errors} (RMS) that goes along with {along}"
    DEGREE = 4  # of its Legendre polynomials

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return tuple(f"{which} by {what}" for which in (_ALL, *CHANNELS) for what in ALONG)

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        return tuple(
            Parameter(f"{channel}_{degree}", unit_of(channel), -1e3, 1e3, _LARGE[unit_of(channel)])
            for channel in self.channels(target)
            for degree in range(1, self.DEGREE + 1)
        )

    @staticmethod
    def channels(target: str) -> tuple[str, ...]:
        """The components that a target is about."""
        which, _ = target.split(" by ")
        return CHANNELS if which == _ALL else (which,)

    def functions(self, scene: Scene, target: str, channel: str) -> np.ndarray:
        """(N, DEGREE) polynomials of a target's quantity, which lies between -1 and 1; what is
        constant in them is a zero, which has a name."""
        _, quantity = target.split(" by ")
        around = scene.once((UNEXPLAINED, "quantities"), lambda: _quantities(scene))
        if quantity in around:
            value = around[quantity]
        else:
            scale = _LARGE[unit_of(channel)] / _AT_ONCE_S
            value = np.gradient(signal_of(scene, scene.predicted, channel)) * scene.rate_hz / scale
            if quantity == "bend":
                value = np.gradient(value) * scene.rate_hz * _AT_ONCE_S
        bounded = value if quantity == "time" else value / (1 + np.abs(value))
        functions = np.asarray(legvander(bounded, self.DEGREE))[:, 1:]
        return functions - functions[scene.valid].mean(axis=0)

    def tangent(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        columns = [
            in_channel(scene, channel, function)
            for channel in self.channels(target)
            for function in self.functions(scene, target, channel).T
        ]
        return np.stack(columns, axis=-1)

    def sizes(self, scene: Scene, target: str, values: np.ndarray) -> dict[str, float]:
        """Of each of its components, RMS."""
        change = move_moments(self.change(scene, target, values), place_of_stance_m(scene))
        each = np.sqrt((change[scene.valid] ** 2).mean(axis=0)).tolist()
        return {x: each[CHANNELS.index(x)] for x in self.channels(target)}


class Mean(OfComponents):
    """The constant of a `Course`, which nobody would take for a fault of its own: it has no name
    either. of : sizes by which the components vary, each about as large as its mean may be."""

    says = "of unknown cause: a constant error of {errors}"

    def __init__(self, of: Mapping[str, float]) -> None:
        self.of = of

    @staticmethod
    def target_of(course: str) -> str:
        """Of the constant of a `Course` with this target."""
        return f"{course.split(' by ')[0]} by mean"

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        return tuple(Parameter(x, unit_of(x), -1e3, 1e3, size) for x, size in self.of.items())

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        constant = np.zeros((len(scene.times_s), 6))
        constant[:, [CHANNELS.index(x) for x in self.of]] = values
        return move_moments(constant, -place_of_stance_m(scene))

    def sizes(self, scene: Scene, target: str, values: np.ndarray) -> dict[str, float]:
        return dict(zip(self.of, values.tolist(), strict=True))


def _quantities(scene: Scene) -> Mapping[str, np.ndarray]:
    """What components may go along with, (N,) each, over what is large of it."""
    weight = scene.mass_kg * GRAVITY_M_S2
    wrench = move_moments(scene.predicted, place_of_stance_m(scene))
    pelvis = scene.q[:, :3] - scene.q[scene.valid, :3].mean(axis=0)
    speed = np.gradient(pelvis, axis=0) * scene.rate_hz / _FAST_M_S
    through = (scene.times_s - scene.times_s[0]) / max(float(np.ptp(scene.times_s)), 1e-9)
    return {
        "time": 2 * through - 1,
        "load": (wrench[:, 2] / weight - 1) / _LOAD,
        **{f"moment_{axis}": wrench[:, 3 + k] / weight / _ARM_M for k, axis in enumerate("xy")},
        **{f"pelvis_{axis}": pelvis[:, k] / _AWAY_M for k, axis in enumerate("xyz")},
        **{f"speed_{axis}": speed[:, k] for k, axis in enumerate("xyz")},
    }


NAMELESS: tuple[Nameless, ...] = (Tone(), Course())
