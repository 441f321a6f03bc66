"""Skin between bone and marker: it follows the joints beside it, the breath and, if told, jolts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

from tests.blind.second_world.balance import rate_of
from tests.blind.second_world.body import LIMBS, SEGMENTS, SIDES, kind_of, rows_of
from tests.blind.second_world.kinematics import Poses
from tests.blind.second_world.landmarks import Landmark
from tests.blind.second_world.smooth import slow_course

# Shift of all markers of a segment per turn of a joint beside it [m/rad].
_PER_RAD = {row["kind"]: float(row["skin_m_per_rad"]) for row in rows_of("people.csv")}
_TURN_PER_RAD = np.radians(1.2)  # of all markers of a segment together, as far as its joints turn
_TURNS = np.array([[0.6], [0.6], [1.4]])  # about x, y and most about the long axis
_OWN = 0.45  # of a single marker, over the shift of all
_OWN_SHOULDER = 2.2  # times as much there
_MOST_RAD = 1.2  # skin is stretched by a joint's turn no further
_JOLT_HZ, _JOLT_DAMPING = 9.0, 0.22
_SOFT = ("thigh", "torso", "pelvis")

Offset = Callable[[np.ndarray], np.ndarray]


def _neighbours() -> dict[str, tuple[str, ...]]:
    found = {
        "pelvis": ("torso", "thigh_r", "thigh_l"),
        "torso": ("pelvis", "upper_arm_r", "upper_arm_l"),
        "head": ("torso",),
    }
    for side in SIDES:
        for chain in (("torso", *LIMBS[:3]), ("pelvis", *LIMBS[3:])):
            names = [chain[0], *(f"{limb}_{side}" for limb in chain[1:])]
            for k in range(1, len(names)):
                found[names[k]] = tuple(names[k - 1 : k + 2 : 2])
    return found


NEIGHBOURS = _neighbours()


@dataclass(frozen=True)
class Breath:
    """depth_m : of the front of the chest; its back moves less."""

    rate_hz: float
    phase_rad: float
    depth_m: float

    @classmethod
    def drawn(cls, rng: np.random.Generator) -> Breath:
        return cls(rng.uniform(0.2, 0.3), rng.uniform(0.0, 2.0 * np.pi), rng.uniform(5e-4, 1.5e-3))

    def offset_m(self, times_s: np.ndarray, in_front: bool) -> np.ndarray:
        """(N, 3) in the torso's frame."""
        ahead = self.depth_m * (1.0 if in_front else 0.3)
        course = np.sin(2.0 * np.pi * self.rate_hz * times_s + self.phase_rad)
        return np.outer(course, [ahead, 0.0, 0.5 * self.depth_m])


class Skin:
    """Of one person; scale : how far it moves, 1 as usual; jolting : gain of jolts, 0 for none."""

    def __init__(
        self,
        landmarks: Mapping[str, Landmark],
        labels: Mapping[str, str],
        rng: np.random.Generator,
        scale: float = 1.0,
        jolting: float = 0.0,
    ) -> None:
        self.landmarks, self.labels, self.jolting = landmarks, labels, jolting
        self._draw_segments(rng, scale)
        self._draw_markers(rng, scale)
        self._at_rest: dict[str, np.ndarray] = {}

    def _draw_segments(self, rng: np.random.Generator, scale: float) -> None:
        self.shift_m, self.turn, self.far_m = {}, {}, {}
        for segment in SEGMENTS:
            angles = 3 * len(NEIGHBOURS[segment])
            far = _PER_RAD[kind_of(segment)] * rng.uniform(0.6, 1.3) * scale
            self.far_m[segment] = far
            self.shift_m[segment] = far * rng.normal(0.0, 1.0, (3, angles)) / np.sqrt(angles)
            turn = _TURN_PER_RAD * scale * _TURNS * np.sqrt(3.0 / angles)
            self.turn[segment] = turn * rng.normal(0.0, 1.0, (3, angles))

    def _draw_markers(self, rng: np.random.Generator, scale: float) -> None:
        self.own_m, self.own_slow_m = {}, {}
        for label, name in self.labels.items():
            segment = self.landmarks[name].segment
            far, angles = self.far_m[segment], 3 * len(NEIGHBOURS[segment])
            more = _OWN_SHOULDER if name.startswith(("acromion", "scapula")) else 1.0
            drawn = rng.normal(0.0, 1.0, (3, angles)) / np.sqrt(angles)
            self.own_m[label] = _OWN * more * far * drawn
            slow = rng.uniform(0.0006, 0.0014) * scale
            self.own_slow_m[label] = slow * np.sqrt(far / 0.004)

    def rest(self, poses: Poses) -> None:
        """Skin is where it belongs in the mean of these poses."""
        self._at_rest = {segment: _angles(poses, segment).mean(axis=0) for segment in SEGMENTS}

    def markers_m(
        self,
        poses: Poses,
        times_s: np.ndarray,
        stride: int,
        rng: np.random.Generator,
        moved: Mapping[str, Offset],
    ) -> dict[str, np.ndarray]:
        """Course (n, 3) in the lab at every stride-th time, per label.

        moved : offsets (n, 3) over time in the frame of a label's segment [m].
        """
        breath, jolts = Breath.drawn(rng), self._jolts(poses, times_s)[::stride]
        few, times = _every(poses, stride), times_s[::stride]
        rate_hz = 1.0 / (times[1] - times[0])
        bent = {s: self._bent(few, s) for s in SEGMENTS}
        shape = (len(times), 3)
        together = {
            s: bent[s] @ self.shift_m[s].T
            + 0.22 * self.far_m[s] * slow_course(rng, shape, rate_hz, 0.25)
            for s in SEGMENTS
        }
        found = {}
        for label, name in self.labels.items():
            segment, place = self.landmarks[name].segment, self.landmarks[name].place_m
            lever = place * [1.0, 1.0, 0.15]  # along the segment, a turn leaves markers in place
            local = place + together[segment] + bent[segment] @ self.own_m[label].T
            local = local + np.cross(bent[segment] @ self.turn[segment].T, lever)
            local = local + self.own_slow_m[label] * slow_course(rng, shape, rate_hz, 0.3)
            if segment == "torso":
                local = local + breath.offset_m(times, place[0] > 0.0)
            if kind_of(segment) in _SOFT:
                local = local + np.outer(jolts, [0.3, 0.0, 1.0])
            if label in moved:
                local = local + moved[label](times)
            found[label] = few.points_m(segment, local)
        return found

    def _bent(self, poses: Poses, segment: str) -> np.ndarray:
        off = _angles(poses, segment) - self._at_rest[segment]
        return _MOST_RAD * np.tanh(off / _MOST_RAD)

    def _jolts(self, poses: Poses, times_s: np.ndarray) -> np.ndarray:
        """Soft tissue as a damped spring that the pelvis shakes (N,) [m]."""
        up = rate_of(rate_of(poses.origins_m["pelvis"][:, 2], times_s), times_s)
        dt, own = times_s[1] - times_s[0], 2.0 * np.pi * _JOLT_HZ
        damped = 2.0 * _JOLT_DAMPING * own * dt
        return self.jolting * lfilter(
            [dt**2], [1.0, damped - 2.0, 1.0 - damped + (own * dt) ** 2], -up
        )


def _angles(poses: Poses, segment: str) -> np.ndarray:
    """Rotation vectors (N, 3 k) [rad] of the k segments beside one, in its frame."""
    back = poses.rotations[segment].transpose(0, 2, 1)
    turns: Sequence[np.ndarray] = [back @ poses.rotations[n] for n in NEIGHBOURS[segment]]
    return np.concatenate([Rotation.from_matrix(R).as_rotvec() for R in turns], axis=1)


def _every(poses: Poses, stride: int) -> Poses:
    return Poses(
        {s: R[::stride] for s, R in poses.rotations.items()},
        {s: o[::stride] for s, o in poses.origins_m.items()},
    )
