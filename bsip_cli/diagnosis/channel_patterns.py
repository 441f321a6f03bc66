"""Regularities of one component of the measured wrench."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import median_filter
from scipy.signal import find_peaks

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.diagnosis.pattern import UNEXPLAINED, Pattern, course_of, in_channel
from bsip_cli.effects.effect import Parameter
from bsip_cli.effects.plates import CHANNELS, OF_THE_LAB, unit_of
from bsip_cli.effects.scene import Scene

# By the component's unit.
_SIZE = {"N": 40.0, "N m": 20.0}
_SMALL = {"N": 10.0, "N m": 5.0}
_PLAYS = {"N": (4.0, 8.0, 16.0), "N m": (2.0, 4.0, 8.0)}
_HARDLY_EVER = 99.0  # percent of the frames lie below
_MUCH = 1.2  # times the body weight: in squats
_FASTEST_HZ = 8.0  # beyond it the low-pass leaves nothing but its own edge
_LINE, _AROUND_HZ, _MOST_LINES = 30.0, 0.75, 3  # of noise one in 10^9 frequencies is as high


class ChannelPattern(Pattern):
    """In one of the six components."""

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return CHANNELS


class Tone(ChannelPattern):
    """One component that swings at one frequency."""

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        unit = unit_of(target)
        duration = max(float(np.ptp(scene.times_s)), 2.0)
        slowest, fastest = 2.0 / duration, min(_FASTEST_HZ, 0.16 * scene.rate_hz)
        count = min(60, int((fastest - slowest) * duration))
        regular = np.linspace(slowest, fastest, count)
        paces = tuple(float(f) for f in (*regular, *_lines_hz(scene, target, slowest, fastest)))
        return (
            Parameter("cosine", unit, -1e3, 1e3, _SIZE[unit]),
            Parameter("sine", unit, -1e3, 1e3, _SIZE[unit]),
            Parameter("frequency", "Hz", 0.5 * slowest, fastest, 0.3 / duration, paces),
        )

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        phase = 2 * np.pi * values[2] * (scene.times_s - scene.times_s[0])
        wave = values[0] * np.cos(phase) + values[1] * np.sin(phase)
        return in_channel(scene, target, wave)

    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        size = f"{np.hypot(values[0], values[1]):.1f} {unit_of(target)}"
        return f"a swing of {OF_THE_LAB[target]} by {size}, {values[2]:.2f} times per second"

    def reported(
        self, scene: Scene, target: str, values: np.ndarray
    ) -> tuple[tuple[str, str, float], ...]:
        amplitude = float(np.hypot(values[0], values[1]))
        return ("amplitude", unit_of(target), amplitude), ("frequency", "Hz", float(values[2]))


def _lines_hz(scene: Scene, channel: str, slowest: float, fastest: float) -> np.ndarray:
    """(k,) frequencies at which a channel's residual stands far out of its spectrum.

    In a long trial a swing at one frequency would fall between the regular ones.
    """
    key = (UNEXPLAINED, channel)
    return scene.once(key, lambda: _computed_lines_hz(scene, channel, slowest, fastest))


def _computed_lines_hz(scene: Scene, channel: str, slowest: float, fastest: float) -> np.ndarray:
    residual = course_of(scene, scene.measured - scene.predicted, channel)
    course = np.where(scene.valid, np.nan_to_num(residual), 0.0)
    course = np.where(scene.valid, course - course[scene.valid].mean(), 0.0)
    count = 2 * len(course)
    power = np.abs(np.fft.rfft(course * np.hanning(len(course)), count)) ** 2
    hertz = np.fft.rfftfreq(count, 1 / scene.rate_hz)
    around = 2 * round(_AROUND_HZ * count / scene.rate_hz) + 1
    height = power / np.maximum(median_filter(power, around, mode="nearest"), 1e-12)
    peaks, found = find_peaks(height, height=_LINE)
    peaks = peaks[np.argsort(-found["peak_heights"])][:_MOST_LINES]
    inside = (hertz[peaks] > slowest) & (hertz[peaks] < fastest)
    return hertz[peaks][inside]


class Curve(ChannelPattern):
    """Forces that are not in proportion: a part that grows with the square of the vertical one."""

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        unit = unit_of(target)
        return (Parameter("curvature", unit, -1e3, 1e3, _SIZE[unit]),)

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        return in_channel(scene, target, values[0] * _load(scene) ** 2)

    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        return (
            f"a part of {OF_THE_LAB[target]} that grows with the square of the load "
            f"({values[0]:+.1f} {unit_of(target)} at body weight)"
        )


class Bend(Curve):
    """The same of a component that is right in standing: plates are checked with people on them."""

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        load = _load(scene)
        return in_channel(scene, target, values[0] * load * (load - 1))

    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        return (
            f"an error of {OF_THE_LAB[target]} that is not in proportion to the load "
            f"({self._error(values):+.1f} {unit_of(target)} at {_MUCH:g} times the body weight, "
            "none in standing)"
        )

    def reported(
        self, scene: Scene, target: str, values: np.ndarray
    ) -> tuple[tuple[str, str, float], ...]:
        return (("nonlinearity", unit_of(target), self._error(values)),)

    def _error(self, values: np.ndarray) -> float:
        return float(values[0] * _MUCH * (_MUCH - 1))


def _load(scene: Scene) -> np.ndarray:
    """(N,) vertical force over body weight."""
    return scene.predicted[:, 2] / (scene.mass_kg * GRAVITY_M_S2)


class Ceiling(Pattern):
    """A vertical force that is never shown above what it reaches in the trial: a channel at its
    limit. At 1 all of what the motion needs beyond is lost."""

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return ("fz",) if _beyond(scene).any() else ()

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        return (Parameter("lost", "1", 0.0, 3.0, 1.0),)

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        return in_channel(scene, target, -values[0] * _beyond(scene))

    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        return f"what the motion needs beyond the largest {OF_THE_LAB[target]} that is shown"

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        ((_, unit, lacking),) = self.reported(scene, target, values)
        return (
            f"something without a name keeps {OF_THE_LAB[target]} below {_ceiling(scene):.0f} N "
            f"where the motion needs up to {lacking:.0f} {unit} more, as of a channel at its limit"
        )

    def reported(
        self, scene: Scene, target: str, values: np.ndarray
    ) -> tuple[tuple[str, str, float], ...]:
        return (("lacking", "N", float(values[0] * _beyond(scene).max())),)


def _ceiling(scene: Scene) -> float:
    """Vertical force that is hardly ever exceeded [N]."""
    return float(np.percentile(scene.measured[scene.valid, 2], _HARDLY_EVER))


def _beyond(scene: Scene) -> np.ndarray:
    """(N,) what the motion needs above it [N]."""
    return np.where(scene.valid, np.maximum(scene.predicted[:, 2] - _ceiling(scene), 0.0), 0.0)


class Play(ChannelPattern):
    """A component that follows with play: it sticks until the true one has moved on by so much."""

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        unit = unit_of(target)
        widths = _PLAYS[unit]
        return (
            Parameter("error", unit, -1e3, 1e3, _SMALL[unit]),
            Parameter("play", unit, 0.1 * widths[0], 3 * widths[-1], 0.5 * widths[0], widths),
        )

    def spacing(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        return values[1:] / 2

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        course = course_of(scene, scene.predicted, target)
        behind = with_play(course, float(values[1])) - course
        return in_channel(scene, target, values[0] * behind / (0.5 * values[1]))

    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        order = "against" if values[0] > 0 else "with"
        return (
            f"an error of {OF_THE_LAB[target]} by up to {abs(values[0]):.1f} {unit_of(target)} "
            f"{order} the direction in which it is changing, as of play or friction"
        )

    def reported(
        self, scene: Scene, target: str, values: np.ndarray
    ) -> tuple[tuple[str, str, float], ...]:
        return (("error", unit_of(target), float(abs(values[0]))),)


def with_play(course: np.ndarray, width: float) -> np.ndarray:
    """(N,) what shows a course (N,) through a play of this full width, from its middle."""
    shown, at = np.empty_like(course), course[0]
    for k, value in enumerate(course):
        at = min(max(at, value - 0.5 * width), value + 0.5 * width)
        shown[k] = at
    return shown


class Lag(ChannelPattern):
    """A component that comes late by itself: its filter is slower than the others'."""

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        return (Parameter("delay", "s", -0.5, 0.5, 0.02),)

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        course = course_of(scene, scene.predicted, target)
        return in_channel(scene, target, -values[0] * np.gradient(course) * scene.rate_hz)

    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        order = "late" if values[0] > 0 else "early"
        return f"{OF_THE_LAB[target]}, which alone comes {1000 * abs(values[0]):.1f} ms too {order}"


class Warming(ChannelPattern):
    """A component whose gain changes through the trial."""

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        return (Parameter("change_of_gain", "1", -1.0, 1.0, 0.04),)

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        course = course_of(scene, scene.predicted, target)
        return in_channel(scene, target, values[0] * (_through(scene) - 0.5) * course)

    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        size = 100 * values[0]
        return f"a gain of {OF_THE_LAB[target]} that changes by {size:+.1f} % through the trial"


class Bow(ChannelPattern):
    """A component whose zero goes away and comes back in the course of the trial."""

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        unit = unit_of(target)
        return (Parameter("bow", unit, -1e3, 1e3, _SMALL[unit]),)

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        through = _through(scene)
        return in_channel(scene, target, values[0] * 4 * through * (1 - through))

    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        size = f"{values[0]:+.1f} {unit_of(target)}"
        return f"a zero of {OF_THE_LAB[target]} that goes to {size} by the middle and comes back"


def _through(scene: Scene) -> np.ndarray:
    """(N,) part of the trial that is over."""
    return (scene.times_s - scene.times_s[0]) / max(float(np.ptp(scene.times_s)), 1e-9)
