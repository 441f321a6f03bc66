"""What may be hidden in a trial: how it changes the clock, plates, markers or loads."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from scipy.signal import butter, lsim, lti, sosfilt

from tests.blind.second_world.balance import GRAVITY, Load, OnGround, rate_of
from tests.blind.second_world.body import SIDES
from tests.blind.second_world.motion import Motion
from tests.blind.second_world.smooth import window

HAND_M = (0.02, 0.0, -0.07)  # where a hand holds something, in its frame
WAIST_M = (-0.1, 0.0, 0.05)  # where a tether pulls, in the pelvis' frame
_WOBBLE_HZ, _WOBBLE_DAMPING = 4.0, 0.2
_CHANGES_AT = 0.45  # of a trial, where something happens within it
_CONTACT = (3.0, 5.5, 0.5)  # start, length and ramp [s] of a hand's touch
_STILL = (2.0, 7.5, 0.9)  # of the arm about it
_UP = (0.0, 0.0, 1.0)
FZ = 2  # column of a plate's wrench


class Signals(NamedTuple):
    """wrench (n, 6) in the plate's axes, whose z points down; times_s (n,); plate from 0; full_n :
    the load on the plate of somebody who stands still."""

    wrench: np.ndarray
    times_s: np.ndarray
    plate: int
    full_n: float


Channels = Callable[[Signals], np.ndarray]


@dataclass(frozen=True)
class Hidden:
    """What is hidden: size in SI units and degrees; task : in which trials, None for all."""

    effect: str
    size: Any
    target: Any = None
    task: str | None = None

    def is_in(self, task: str) -> bool:
        return self.task in (None, task)

    def in_words(self) -> str:
        target = f" at {self.target}" if self.target is not None else ""
        return f"{self.effect} {self.size}{target}, {self.task or 'all trials'}"


@dataclass(frozen=True)
class Changes:
    """delay_s : of the forces behind the markers, fast : part of a second that their clock gains in
    one. shift_m, yaw_rad : of where the file says the plates are. channels : on a plate's signals,
    one after the other. moved : offsets of labels. loads : on the ground.
    """

    delay_s: float = 0.0
    fast: float = 0.0
    shift_m: tuple[float, float] = (0.0, 0.0)
    yaw_rad: float = 0.0
    channels: tuple[Channels, ...] = ()
    moved: dict[str, Callable[[np.ndarray], np.ndarray]] = field(default_factory=dict)
    loads: tuple[Load, ...] = ()

    def with_others(self, more: Changes) -> Changes:
        """Both at once."""
        return Changes(
            self.delay_s + more.delay_s,
            self.fast + more.fast,
            (self.shift_m[0] + more.shift_m[0], self.shift_m[1] + more.shift_m[1]),
            self.yaw_rad + more.yaw_rad,
            self.channels + more.channels,
            self.moved | more.moved,
            self.loads + more.loads,
        )


# --- what the ground has to carry besides the body ------------------------------------------------


def mass(mass_kg: float, until_s: float = np.inf) -> OnGround:
    """A point mass that is carried, until a time if one is told."""
    return lambda times_s, velocity: (
        (rate_of(velocity, times_s) + GRAVITY) * (mass_kg * (times_s < until_s))[:, None]
    )


def touch(force_n: float) -> OnGround:
    """A hand leans on something that lifts it by force_n: the ground carries less."""
    return lambda times_s, velocity: np.outer(
        -force_n * window(times_s, *_CONTACT), [0.0, 0.0, 1.0]
    )


def tether(damping_ns_m: float) -> OnGround:
    """A damped rope, less so up and down; force per speed [N s/m]."""
    return lambda times_s, velocity: damping_ns_m * velocity * [1.0, 1.0, 0.3]


def wobble(mass_kg: float) -> OnGround:
    """A part of the body that swings up and down on it, by itself at 4 Hz and soon still again."""
    pace = 2.0 * np.pi * _WOBBLE_HZ
    swing = lti([-1.0, 0.0, 0.0], [1.0, 2.0 * _WOBBLE_DAMPING * pace, pace**2])

    def on_ground(times_s: np.ndarray, velocity: np.ndarray) -> np.ndarray:
        _, beyond, _ = lsim(swing, rate_of(velocity[:, 2], times_s), times_s)
        return np.outer(mass_kg * beyond, _UP)

    return on_ground


# --- what is hidden in a trial --------------------------------------------------------------------


def changes_of(hidden: Hidden, motion: Motion) -> Changes:
    """What a hidden effect changes in a trial; a touch and a bend change the motion itself."""
    if hidden.effect in _CHANNELS:
        return Changes(channels=(partial(_CHANNELS[hidden.effect], hidden),))
    return _OTHERS[hidden.effect](hidden, motion)


def _carried(segment: str, place_m: Sequence[float], on_ground: OnGround) -> Changes:
    return Changes(loads=(Load(segment, np.array(place_m), on_ground),))


def _slip(hidden: Hidden, motion: Motion) -> Changes:
    since_s = _middle_s(motion)
    return Changes(moved={hidden.target: lambda t: np.outer(t > since_s, hidden.size)})


def _touch(hidden: Hidden, motion: Motion) -> Changes:
    side, still = hidden.target[-1], window(motion.t, *_STILL)
    assert side in SIDES
    for name in ("flexion", "abduction", "rotation", "elbow", "pronation"):
        course = motion.q[f"{name}_{side}"]
        motion.q[f"{name}_{side}"] = course + 0.95 * still * (course[0] - course)
    motion.add(f"elbow_{side}", 0.9 * still)
    return _carried(hidden.target, HAND_M, touch(hidden.size))


def _bend(hidden: Hidden, motion: Motion) -> Changes:
    motion.at_spine = hidden.size
    return Changes()


def _middle_s(motion: Motion) -> float:
    return _CHANGES_AT * len(motion.t) / motion.rate_hz


# --- on a plate's channels ------------------------------------------------------------------------


def _gain(hidden: Hidden, seen: Signals) -> np.ndarray:
    """On the vertical force alone, of the target or of every plate."""
    mine = hidden.target in (None, seen.plate)
    return _with_column(seen, FZ, seen.wrench[:, FZ] * (1.0 + mine * hidden.size))


def _crosstalk(hidden: Hidden, seen: Signals) -> np.ndarray:
    """Of the vertical force, into the target's column."""
    column = seen.wrench[:, hidden.target] + hidden.size * seen.wrench[:, FZ]
    return _with_column(seen, hidden.target, column)


def _drift(hidden: Hidden, seen: Signals) -> np.ndarray:
    """Of the first plate's vertical force, over the trial [N]."""
    grown = hidden.size * seen.times_s / seen.times_s[-1] if seen.plate == 0 else 0.0
    return _with_column(seen, FZ, seen.wrench[:, FZ] - grown)


def _lowpass(hidden: Hidden, seen: Signals) -> np.ndarray:
    """Butterworth of second order, forward only, on every channel [Hz]."""
    rate_hz = 1.0 / (seen.times_s[1] - seen.times_s[0])
    sections = butter(2, hidden.size, fs=rate_hz, output="sos")
    return sosfilt(sections, seen.wrench - seen.wrench[0], axis=0) + seen.wrench[0]


def _nonlinear(hidden: Hidden, seen: Signals) -> np.ndarray:
    """A gain of the vertical force that grows with it, 1 at rest."""
    gain = 1.0 + hidden.size * (-seen.wrench[:, FZ] / seen.full_n - 1.0)
    return _with_column(seen, FZ, seen.wrench[:, FZ] * gain)


def _clipped(hidden: Hidden, seen: Signals) -> np.ndarray:
    """The vertical force ends at so many times its value at rest."""
    return _with_column(seen, FZ, np.maximum(seen.wrench[:, FZ], -hidden.size * seen.full_n))


def _with_column(seen: Signals, column: int, course: np.ndarray) -> np.ndarray:
    changed = seen.wrench.copy()
    changed[:, column] = course
    return changed


_CHANNELS: dict[str, Callable[..., np.ndarray]] = {
    "gain": _gain,
    "crosstalk": _crosstalk,
    "drift": _drift,
    "lowpass": _lowpass,
    "nonlinear": _nonlinear,
    "clipped": _clipped,
}
_OTHERS: dict[str, Callable[[Hidden, Motion], Changes]] = {
    "delay": lambda hidden, motion: Changes(delay_s=hidden.size),
    "clock": lambda hidden, motion: Changes(fast=1e-6 * hidden.size),
    "shift": lambda hidden, motion: Changes(shift_m=hidden.size),
    "yaw": lambda hidden, motion: Changes(yaw_rad=np.radians(hidden.size)),
    "marker": lambda hidden, motion: Changes(
        moved={hidden.target: lambda t: np.tile(hidden.size, (len(t), 1))}
    ),
    "slip": _slip,
    "worn": lambda hidden, motion: _carried(*hidden.target, mass(hidden.size)),
    "dropped": lambda hidden, motion: _carried(
        hidden.target, HAND_M, mass(hidden.size, _middle_s(motion))
    ),
    "touch": _touch,
    "wobble": lambda hidden, motion: _carried(hidden.target, (0.0, 0.0, 0.0), wobble(hidden.size)),
    "bend": _bend,
    "tether": lambda hidden, motion: _carried("pelvis", WAIST_M, tether(hidden.size)),
}
