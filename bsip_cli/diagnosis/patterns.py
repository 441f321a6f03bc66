"""Regularities of no known cause: if one of them explains more than the catalogue does, then
something is wrong that has no name here.

Each is an effect like any other, so that they compete; what they go along with is said.
"""

from __future__ import annotations

from abc import abstractmethod

import numpy as np
from scipy.ndimage import median_filter
from scipy.signal import find_peaks

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.dynamics.ground_wrench import move_moments
from bsip_cli.effects.effect import Effect, Parameter, Reported
from bsip_cli.effects.plates import CHANNELS, OF_THE_LAB, Delay, unit_of
from bsip_cli.effects.scene import Scene, place_of_stance_m
from bsip_cli.segments import in_words

UNEXPLAINED = "unexplained"
# Sizes by the component's unit.
_LARGE, _SMALL = {"N": 40.0, "N m": 20.0}, {"N": 10.0, "N m": 5.0}


class Nameless(Effect):
    """An error of unknown cause."""

    name = UNEXPLAINED
    is_of_laboratory = True
    remedy = "look at plates, cables and everything that touches the person, and record again"


class Pattern(Nameless):
    """A signal that the residual may follow, linear in its size."""

    @abstractmethod
    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        """With what, and how large it is, for a sentence."""

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        return f"of unknown cause: {self.goes_along_with(target, values)}"


# --- one of the six components --------------------------------------------------------------------


def in_channel(scene: Scene, channel: str, signal: np.ndarray) -> np.ndarray:
    """(N, 6) a signal (N,) in one component of the whole wrench, about where the person stands."""
    wrench = np.zeros((len(signal), 6))
    wrench[:, CHANNELS.index(channel)] = signal
    return move_moments(wrench, -place_of_stance_m(scene))


def signal_of(scene: Scene, wrench: np.ndarray, channel: str) -> np.ndarray:
    """(N,) one component of a world wrench (N, 6) about the origin, moments about where the person
    stands."""
    return move_moments(wrench, place_of_stance_m(scene))[:, CHANNELS.index(channel)]


class Component(Pattern):
    """In one component; by default of one number, in its unit."""

    number = ""
    usual = _LARGE

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return CHANNELS

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        unit = unit_of(target)
        return self.numbers or (Parameter(self.number, unit, -1e3, 1e3, self.usual[unit]),)

    @abstractmethod
    def signal(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """(N,) what the component gains."""

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        return in_channel(scene, target, self.signal(scene, target, values))


class Tone(Component):
    """One component that swings at one frequency."""

    FASTEST_HZ = 8.0  # beyond it the low-pass leaves nothing but its own edge
    LINE, AROUND_HZ, MOST_LINES = 30.0, 0.75, 3  # of noise one in 10^9 frequencies is as high

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        unit = unit_of(target)
        duration = max(float(np.ptp(scene.times_s)), 2.0)
        slowest, fastest = 2.0 / duration, min(self.FASTEST_HZ, 0.16 * scene.rate_hz)
        regular = np.linspace(slowest, fastest, min(60, int((fastest - slowest) * duration)))
        key = (UNEXPLAINED, target)
        lines = scene.once(key, lambda: self._lines_hz(scene, target, slowest, fastest))
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

    def signal(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        phase = 2 * np.pi * values[2] * (scene.times_s - scene.times_s[0])
        return values[0] * np.cos(phase) + values[1] * np.sin(phase)

    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        size = f"{np.hypot(values[0], values[1]):.1f} {unit_of(target)}"
        return f"a swing of {OF_THE_LAB[target]} by {size}, {values[2]:.2f} times per second"

    def reported(self, scene: Scene, target: str, values: np.ndarray) -> Reported:
        amplitude = float(np.hypot(values[0], values[1]))
        return ("amplitude", unit_of(target), amplitude), ("frequency", "Hz", float(values[2]))


def _load(scene: Scene) -> np.ndarray:
    """(N,) vertical force over body weight."""
    return scene.predicted[:, 2] / (scene.mass_kg * GRAVITY_M_S2)


class Curve(Component):
    """Forces that are not in proportion: a part that grows with the square of the vertical one."""

    number = "curvature"

    def signal(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        return values[0] * _load(scene) ** 2

    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        return (
            f"a part of {OF_THE_LAB[target]} that grows with the square of the load "
            f"({values[0]:+.1f} {unit_of(target)} at body weight)"
        )


class Bend(Curve):
    """The same of a component that is right in quiet stance, where plates are checked."""

    MUCH = 1.2  # times the body weight: in squats

    def signal(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        load = _load(scene)
        return values[0] * load * (load - 1)

    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        return (
            f"an error of {OF_THE_LAB[target]} that is not in proportion to the load "
            f"({self._error(values):+.1f} {unit_of(target)} at {self.MUCH:g} times body weight, "
            f"0 {unit_of(target)} at body weight)"
        )

    def reported(self, scene: Scene, target: str, values: np.ndarray) -> Reported:
        return (("nonlinearity", unit_of(target), self._error(values)),)

    def _error(self, values: np.ndarray) -> float:
        return float(values[0] * self.MUCH * (self.MUCH - 1))


class Ceiling(Component):
    """A vertical force that is never shown above what it reaches in the trial: a channel at its
    limit. At 1 all of what the motion needs beyond is lost."""

    numbers = (Parameter("lost", "1", 0.0, 3.0, 1.0),)
    HARDLY_EVER = 99.0  # percent of the frames lie below

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return ("fz",) if self._beyond(scene).any() else ()

    def signal(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        return -values[0] * self._beyond(scene)

    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        return f"what the motion needs beyond the largest {OF_THE_LAB[target]} that is shown"

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        ((_, unit, lacking),) = self.reported(scene, target, values)
        ceiling = self._ceiling(scene)
        return (
            f"of unknown cause: {OF_THE_LAB[target]} stays below "
            f"{ceiling:.0f} N where the motion needs up to {lacking:.0f} {unit} more, as of a "
            "channel at its limit"
        )

    def reported(self, scene: Scene, target: str, values: np.ndarray) -> Reported:
        return (("lacking", "N", float(values[0] * self._beyond(scene).max())),)

    def _ceiling(self, scene: Scene) -> float:
        """Vertical force that is hardly ever exceeded [N]."""
        return float(np.percentile(scene.measured[scene.valid, 2], self.HARDLY_EVER))

    def _beyond(self, scene: Scene) -> np.ndarray:
        """(N,) what the motion needs above it [N]."""
        above = np.maximum(scene.predicted[:, 2] - self._ceiling(scene), 0.0)
        return np.where(scene.valid, above, 0.0)


class Play(Component):
    """A component that follows with play: it sticks until the true one has moved on by so much."""

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        unit = unit_of(target)
        widths = (4.0, 8.0, 16.0) if unit == "N" else (2.0, 4.0, 8.0)
        least, most = 0.1 * widths[0], 3 * widths[-1]
        return (
            Parameter("error", unit, -1e3, 1e3, _SMALL[unit]),
            Parameter("play", unit, least, most, 0.5 * widths[0], widths),
        )

    def spacing(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        return values[1:] / 2

    def signal(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        signal = signal_of(scene, scene.predicted, target)
        behind = with_play(signal, float(values[1])) - signal
        return values[0] * behind / (0.5 * values[1])

    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        order = "against" if values[0] > 0 else "with"
        return (
            f"an error of {OF_THE_LAB[target]} by up to {abs(values[0]):.1f} {unit_of(target)} "
            f"{order} the direction in which it is changing, as of play or friction"
        )

    def reported(self, scene: Scene, target: str, values: np.ndarray) -> Reported:
        return (("error", unit_of(target), float(abs(values[0]))),)


def with_play(signal: np.ndarray, width: float) -> np.ndarray:
    """(N,) what shows a signal (N,) through a play of this full width, from its middle."""
    shown, at = np.empty_like(signal), signal[0]
    for k, value in enumerate(signal):
        at = min(max(at, value - 0.5 * width), value + 0.5 * width)
        shown[k] = at
    return shown


class Lag(Component):
    """A component that comes late by itself: its filter is slower than the others'."""

    numbers = (Parameter("delay", "s", -0.5, 0.5, 0.02),)

    def signal(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        signal = signal_of(scene, scene.predicted, target)
        return -values[0] * np.gradient(signal) * scene.rate_hz

    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        order = "late" if values[0] > 0 else "early"
        return f"{OF_THE_LAB[target]}, which alone comes {1000 * abs(values[0]):.1f} ms too {order}"


def _through(scene: Scene) -> np.ndarray:
    """(N,) part of the trial that is over."""
    return (scene.times_s - scene.times_s[0]) / max(float(np.ptp(scene.times_s)), 1e-9)


class Warming(Component):
    """A component whose gain changes through the trial."""

    numbers = (Parameter("change_of_gain", "1", -1.0, 1.0, 0.04),)

    def signal(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        return values[0] * (_through(scene) - 0.5) * signal_of(scene, scene.predicted, target)

    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        size = 100 * values[0]
        return f"a gain of {OF_THE_LAB[target]} that changes by {size:+.1f} % through the trial"


class Bow(Component):
    """A component whose zero goes away and comes back during the trial."""

    number, usual = "bow", _SMALL

    def signal(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        through = _through(scene)
        return values[0] * 4 * through * (1 - through)

    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        size = f"{values[0]:+.1f} {unit_of(target)}"
        return f"a zero of {OF_THE_LAB[target]} that goes to {size} by the middle and comes back"


# --- a force on the body --------------------------------------------------------------------------

_ALONG = {"x": "along the lab's X axis", "y": "along the lab's Y axis", "z": "up and down"}


def _pushed(place_m: np.ndarray, push_N: np.ndarray) -> np.ndarray:
    """(N, 6) wrench about the world's origin of a force (N, 3) at a place (N, 3)."""
    return np.hstack([push_N, np.cross(place_m, push_N)])


class Spring(Pattern):
    """A force on the pelvis that depends on where the pelvis is: a rope, a rail, an elastic."""

    numbers = (Parameter("stiffness", "N/m", -1e4, 1e4, 50.0),)

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return tuple(f"{force} by {place}" for force in "xyz" for place in "xyz")

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        force, place = ("xyz".index(letter) for letter in target.split(" by "))
        pelvis = scene.q[:, :3]
        push = np.zeros_like(pelvis)
        push[:, force] = values[0] * (pelvis[:, place] - pelvis[:, place].mean())
        return _pushed(pelvis, push)

    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        force, place = target.split(" by ")
        size = f"{abs(values[0]):.0f} N per metre that the pelvis moves {_ALONG[place]}"
        if force == place:
            order = "back to its mean place" if values[0] > 0 else "away from its mean place"
            return f"a pull on the pelvis {order}, as of an elastic or a rope: {size}"
        return f"a force on the pelvis {_ALONG[force]}: {size}"


class Tether(Pattern):
    """A rope or an elastic from a fixed place far off to the pelvis, never slack.

    The force has one direction, and grows with the pelvis' way along it.
    """

    APART = np.pi / 6
    BEARINGS = tuple(float(angle) for angle in np.arange(0.0, np.pi, APART))
    numbers = (
        Parameter("pull_at_origin", "N", -1e5, 1e5, 20.0),
        Parameter("stiffness", "N/m", 0.0, 1e4, 50.0),
        Parameter("bearing", "rad", -np.pi, 2.0 * np.pi, APART, BEARINGS),
        Parameter("rise", "rad", -1.2, 1.2, 0.3, (0.0,)),
    )

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        pull, stiffness, bearing, rise = values
        flat = np.cos(rise)
        away = np.array([flat * np.cos(bearing), flat * np.sin(bearing), np.sin(rise)])
        pelvis = scene.q[:, :3]
        return _pushed(pelvis, np.outer(pull + stiffness * (pelvis @ away), away))

    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        _, stiffness, bearing, rise = values
        return (
            f"a pull on the pelvis, as of an elastic or a rope, {np.degrees(bearing):.0f} degrees "
            f"from the lab's X axis and {np.degrees(rise):.0f} degrees from level: "
            f"{stiffness:.0f} N more per metre"
        )


class Drag(Pattern):
    """A force on the pelvis against its velocity."""

    numbers = (Parameter("damping", "N s/m", -1e4, 1e4, 30.0),)

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return ("x", "y", "z")

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        axis, pelvis = "xyz".index(target), scene.q[:, :3]
        push = np.zeros_like(pelvis)
        push[:, axis] = values[0] * np.gradient(pelvis[:, axis]) * scene.rate_hz
        return _pushed(pelvis, push)

    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        order = "against" if values[0] > 0 else "with"
        size = f"{abs(values[0]):.0f} N per m/s"
        return f"a force on the pelvis {order} its velocity {_ALONG[target]}: {size}"


class Band(Pattern):
    """A pull on a hand back to its mean place."""

    numbers = (Parameter("stiffness", "N/m", -1e4, 1e4, 20.0),)

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return tuple(s for s in scene.person.skeleton.segments if s in ("hand_l", "hand_r"))

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        place = scene.point(target, scene.centre_of(target)).position_m
        return _pushed(place, values[0] * (place - place.mean(axis=0)))

    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        order = "back to" if values[0] > 0 else "away from"
        size = f"{abs(values[0]):.0f} N per metre"
        return f"a pull on the {in_words(target)} {order} its mean place, as of an elastic: {size}"


# --- a clock --------------------------------------------------------------------------------------


class ClockJump(Delay, Pattern):
    """From a moment on the forces come later than before: frames or samples were lost."""

    is_of_laboratory = False  # the moment is another one in every trial
    LEAST_S = 1.0
    UNSEEN_S = 0.1  # as good as nothing
    APART_S, MOST = 0.5, 40

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        first, last = float(scene.times_s[0]), float(scene.times_s[-1])
        apart = max(self.APART_S, (last - first) / self.MOST)
        regular = np.arange(first + self.APART_S, last - self.APART_S, apart)
        moments = tuple(float(t) for t in regular) or (0.5 * (first + last),)
        return (
            Parameter("jump", "s", -0.5, 0.5, 0.01),
            Parameter("from_time", "s", first, last, apart, moments),
        )

    def late_s(self, scene: Scene, values: np.ndarray) -> np.ndarray:
        return values[0] * (scene.times_s >= values[1])

    def possible(self, scene: Scene, target: str, values: np.ndarray) -> bool:
        """Before and after it is seen what the forces are late by, else it is a delay; or nothing
        of the time before is seen, since the person was not yet on a plate."""
        later = scene.times_s >= values[1]
        least = self.LEAST_S * scene.rate_hz
        before, after = ((scene.valid & side).sum() for side in (~later, later))
        unseen = before <= self.UNSEEN_S * scene.rate_hz and (~later).sum() >= least
        seen = min(before, after) >= least or (unseen and after >= least)
        return super().possible(scene, target, values) and bool(seen)

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        return f"of unknown cause: {self.goes_along_with(target, values)}"

    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        order = "later" if values[0] > 0 else "earlier"
        size = f"{1000 * abs(values[0]):.0f} ms {order}"
        return f"from {values[1]:.2f} s on the forces come {size}, as if frames were lost"


PATTERNS: tuple[Pattern, ...] = (
    *(Tone(), Curve(), Bend(), Ceiling(), Play(), Lag(), Warming(), Bow()),
    *(Spring(), Tether(), Drag(), Band(), ClockJump()),
)
