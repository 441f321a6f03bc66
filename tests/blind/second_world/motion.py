"""What a person does: courses of the joints, of the feet and of the weight they carry."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tests.blind.second_world.body import SIDES, Body
from tests.blind.second_world.smooth import slow_course, step

_ROOT = ("ahead", "left", "up", "pelvis_yaw", "pelvis_pitch", "pelvis_roll")
_TRUNK = ("trunk_pitch", "trunk_roll", "trunk_yaw", "neck_pitch", "neck_roll", "neck_yaw")
_ARM = ("flexion", "abduction", "rotation", "elbow", "pronation", "wrist", "wrist_side")
COORDINATES = (*_ROOT, *_TRUNK, *(f"{name}_{side}" for side in SIDES for name in _ARM))
_SWAY = {"ahead": 0.0018, "left": 0.0018, "up": 0.0009}  # [m]; others [rad]:
_SWAY_TRUNK, _SWAY_NECK, _SWAY_ARM, _SWAY_PELVIS = 0.014, 0.02, 0.025, 0.008
_CLEAR_S = 0.12  # a foot carries nothing so long before it leaves the ground and after its return
_QUIET = 0.35

FootPath = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]]


@dataclass
class Foot:
    """Course of one foot; all (N,), place_m (N, 2).

    heel_rad : of the turn about its ball; may_carry : 0 while it is in the air, else 1.
    """

    place_m: np.ndarray
    lifted_m: np.ndarray
    pitch_rad: np.ndarray
    yaw_rad: np.ndarray
    heel_rad: np.ndarray
    may_carry: np.ndarray


class Motion:
    """Courses that a movement is put together from, at rate_hz.

    q : (N,) per name of COORDINATES [m, rad], about standing upright. weight_right : share of the
    weight that the right foot is to carry. ahead_m : of the centre of pressure before the feet's
    middle. bounce_m : of the pelvis, on top of what the legs allow. at_spine : part of the trunk's
    turn that happens above the waist.
    """

    def __init__(
        self,
        body: Body,
        length_s: float,
        rate_hz: float,
        rng: np.random.Generator,
        wide: bool,
        quiet: bool = False,
    ) -> None:
        self.body, self.rate_hz, self.rng = body, rate_hz, rng
        self.t = np.arange(round(length_s * rate_hz)) / rate_hz
        still = _QUIET if quiet else 1.0
        self.q = {name: still * self._sway(name) for name in COORDINATES}
        self._stand()
        self.feet = {side: self._planted(sign, wide) for side, sign in SIDES.items()}
        self.weight_right = 0.5 + 0.02 * still * self._slow(0.3)
        self.ahead_m = 0.008 * still * self._slow(0.4)
        self.bounce_m = np.zeros(len(self.t))
        self.at_spine = 0.0

    def add(self, name: str, course: np.ndarray) -> None:
        """To a coordinate."""
        self.q[name] = self.q[name] + course

    def add_both(self, name: str, course: np.ndarray) -> None:
        """To a coordinate of either arm."""
        for side in SIDES:
            self.add(f"{name}_{side}", course)

    def lift(
        self, side: str, start_s: float, length_s: float, path: FootPath, shift_s: float = 1.0
    ) -> None:
        """A foot leaves the ground; the weight goes to the other before.

        path : from (N,) progress 0 to 1, how far ahead, left and up [m] and the pitch [rad].
        """
        foot, t, end_s = self.feet[side], self.t, start_s + length_s
        ahead, left, up, pitch = path(np.clip((t - start_s) / length_s, 0.0, 1.0))
        foot.place_m = foot.place_m + np.column_stack([ahead, left])
        foot.lifted_m = foot.lifted_m + up
        foot.pitch_rad = foot.pitch_rad + pitch
        off = step((t - start_s) / _CLEAR_S + 1.0) * step((end_s - t) / _CLEAR_S + 1.0)
        foot.may_carry = np.minimum(foot.may_carry, 1.0 - off)
        ramp = shift_s - 0.08
        shifted = step((t - start_s + shift_s) / ramp) * step((end_s + shift_s - t) / ramp)
        other = 1.0 if side == "l" else 0.0
        self.weight_right = self.weight_right * (1.0 - shifted) + other * shifted

    def raise_heels(
        self, start_s: float, up_s: float, hold_s: float, drop_s: float, angle_rad: float
    ) -> None:
        """Onto the balls of both feet, and back down."""
        t, fall_s = self.t, start_s + up_s + hold_s
        fallen = np.clip((t - fall_s) / drop_s, 0.0, 1.0)
        angle = angle_rad * step((t - start_s) / up_s) * (1.0 - fallen**2 * (3.0 - 2.0 * fallen))
        for foot in self.feet.values():
            foot.heel_rad = foot.heel_rad + angle
        back = (fall_s + drop_s + 0.45 - t) / (0.45 + drop_s)
        shifted = step((t - start_s + 0.55) / 0.55) * step(back)
        self.ahead_m = self.ahead_m + 0.068 * self.body.scale * shifted

    def _slow(self, cutoff_hz: float) -> np.ndarray:
        return slow_course(self.rng, self.t.shape, self.rate_hz, cutoff_hz)

    def _sway(self, name: str) -> np.ndarray:
        if name.startswith("pelvis"):
            return _SWAY_PELVIS * self._slow(0.5)
        if name in _SWAY:
            return _SWAY[name] * self._slow(0.6)
        part = {"trunk": _SWAY_TRUNK, "neck": _SWAY_NECK}.get(name.split("_")[0], _SWAY_ARM)
        return part * self._slow(0.6)

    def _stand(self) -> None:
        """A relaxed pose: arms a little off the body, elbows bent."""
        self.add("pelvis_pitch", 0.02)
        self.add("trunk_pitch", 0.03)
        for name, angle in {"flexion": 0.05, "abduction": 0.22, "elbow": 0.22}.items():
            self.add_both(name, angle)
        self.add_both("pronation", 1.2)

    def _planted(self, sign: float, wide: bool) -> Foot:
        ahead = self.rng.normal(0.0, 0.008)
        left = sign * (0.16 if wide else 0.125) + self.rng.normal(0.0, 0.006)
        yaw = sign * (0.11 + self.rng.normal(0.0, 0.03))
        n = len(self.t)
        zero = np.zeros(n)
        place = np.tile([ahead, left], (n, 1))
        return Foot(place, zero, zero, np.full(n, yaw), zero, np.ones(n))
