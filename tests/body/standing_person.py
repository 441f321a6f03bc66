"""A person who stands in markers of known places, and smooth motions whose derivatives are known.

Shared by the tests of body, motion, dynamics and identification. Nothing here comes from the
simulator: the person is calibrated from the marker positions below, the motions from Pinocchio.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pinocchio as pin

from bsip_cli.body.inertia import Inertia
from bsip_cli.body.markersets import load_marker_set
from bsip_cli.body.person import Person
from bsip_cli.body.skeleton import load_skeleton
from bsip_cli.dynamics.ground_wrench import pinocchio_model
from bsip_cli.motion.calibration import Calibration, calibrate

HEIGHT_M = 1.77
# Right side and middle, world [m]: X anterior, Y left, Z up.
_RIGHT = {
    "RTEM": (0.05, -0.075, 1.66),
    "RAC": (-0.02, -0.19, 1.46),
    "RASIS": (0.08, -0.12, 0.98),
    "RPSIS": (-0.09, -0.045, 1.02),
    "RUA": (0.02, -0.25, 1.28),
    "RELB": (-0.02, -0.27, 1.14),
    "RFA": (0.04, -0.29, 1.02),
    "RWRR": (0.10, -0.28, 0.93),
    "RWRU": (0.06, -0.31, 0.91),
    "RHAND": (0.13, -0.30, 0.85),
    "RKNEL": (0.00, -0.15, 0.52),
    "RKNEM": (0.01, -0.05, 0.52),
    "RMALL": (-0.03, -0.13, 0.09),
    "RMALM": (-0.02, -0.06, 0.10),
    "RCAL": (-0.09, -0.095, 0.03),
    "RMT2": (0.10, -0.12, 0.06),
}
_MIDDLE = {
    "FHEAD": (0.10, 0.0, 1.68),
    "C7": (-0.07, 0.0, 1.50),
    "T10": (-0.10, 0.0, 1.25),
    "XIPH": (0.10, 0.0, 1.28),
    "IJ": (0.055, 0.0, 1.43),
    "RSCAP": (-0.13, -0.10, 1.38),
}


def standing_markers() -> dict[str, np.ndarray]:
    """Label to position [m] for the marker set hansen2017; not quite symmetric, as people are."""
    places = {label: np.array(place) for label, place in (_RIGHT | _MIDDLE).items()}
    uneven = np.random.default_rng(1)
    for label, place in _RIGHT.items():
        mirrored = np.array(place) * [1.0, -1.0, 1.0]
        places[f"L{label[1:]}"] = mirrored + uneven.normal(0, 0.003, 3)
    return places


@cache
def standing(sex: str = "M") -> Calibration:
    """The person calibrated from those markers."""
    return calibrate(
        load_skeleton("hansen2017"),
        load_marker_set("hansen2017"),
        standing_markers(),
        sex,
        HEIGHT_M,
    )


@cache
def with_girdle() -> Calibration:
    """The same with clavicles, which more markers show."""
    places = standing_markers()
    for side, out in (("R", -1.0), ("L", 1.0)):
        places[f"{side}CLA"] = np.array([0.06, 0.10 * out, 1.47])
        places[f"{side}AA"] = np.array([-0.06, 0.18 * out, 1.44])
    skeleton, marker_set = load_skeleton("robert17"), load_marker_set("robert17")
    return calibrate(skeleton, marker_set, places, "M", HEIGHT_M)


@cache
def tilted_person(girdle: bool = False) -> Person:
    """The person with hinges that lean, and joints off the planes of symmetry."""
    person = (with_girdle() if girdle else standing()).person
    rng = np.random.default_rng(2)
    hinges = np.array([kind == "revolute" for kind in person.skeleton.joint_types])
    return replace(
        person,
        parent_tilt_rad=np.where(hinges, rng.normal(0, 0.2, len(hinges)), 0.0),
        child_tilt_rad=np.where(hinges, rng.normal(0, 0.2, len(hinges)), 0.0),
    )


def random_poses(person: Person, count: int, spread_rad: float, seed: int) -> np.ndarray:
    """(count, nq) poses about the standing one, base moved by about a metre."""
    model, rng = pinocchio_model(person), np.random.default_rng(seed)
    first = standing().q if len(person.skeleton.segments) == 15 else with_girdle().q
    spread = np.repeat([0.7, spread_rad], [3, model.nv - 3])
    steps = rng.normal(0, spread, (count, model.nv))
    return np.stack([pin.integrate(model, first, step) for step in steps])


def random_states(model: pin.Model, count: int, seed: int) -> tuple[np.ndarray, ...]:
    """q (count, nq) about the neutral pose, and v and a (count, nv)."""
    rng = np.random.default_rng(seed)
    steps = rng.normal(0, 1, (count, model.nv))
    q = np.stack([pin.integrate(model, pin.neutral(model), step) for step in steps])
    return q, rng.normal(0, 2, steps.shape), rng.normal(0, 10, steps.shape)


def joint_frames(person: Person, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Orientation (N, n, 3, 3) and joint centre (N, n, 3) [m] of every segment, by Pinocchio."""
    model = pinocchio_model(person)
    data = model.createData()
    R, p = [], []
    for one in q:
        pin.forwardKinematics(model, data, one)
        placements = [data.oMi[i + 1] for i in range(model.njoints - 1)]
        R.append([placement.rotation.copy() for placement in placements])
        p.append([placement.translation.copy() for placement in placements])
    return np.array(R), np.array(p)


def parameters_of(person: Person, inertias: Sequence[Inertia]) -> np.ndarray:
    """(10 n,) of the segments with mass, about the joint centres."""
    origins = person.origin_in_joint_m[list(person.skeleton.bodies)]
    moved = zip(inertias, origins, strict=True)
    return np.concatenate([inertia.moved(-origin).phi() for inertia, origin in moved])


def markers_of(person: Person, q: np.ndarray) -> np.ndarray:
    """(N, m, 3) world positions [m] of the markers, by Pinocchio."""
    R, p = joint_frames(person, q)
    at = person.marker_segments
    local = person.marker_positions_m + person.origin_in_joint_m[at]
    return p[:, at] + np.einsum("fmij,mj->fmi", R[:, at], local)


def away(person: Person, q: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(nv,) from one pose to the other; q and -q are the same orientation."""
    same = other.copy()
    starts = zip(person.skeleton.q_starts, person.skeleton.joint_types, strict=True)
    for start, kind in starts:
        if kind != "revolute":
            part = slice(start + 3, start + 7) if kind == "free" else slice(start, start + 4)
            same[part] *= np.sign(q[part] @ other[part])
    return pin.difference(pinocchio_model(person), q, same)


class Swing:
    """Motion q(t) = q0 + x(t) on the manifold, x a sum of sines: velocities are exact.

    ``amplitude`` of the angles [rad]; the base translates by a third of that [m].
    """

    def __init__(
        self,
        model: pin.Model,
        q0: np.ndarray,
        seed: int,
        amplitude: float = 0.4,
        frequencies_hz: tuple[float, ...] = (0.3, 0.7, 1.1),
    ) -> None:
        rng = np.random.default_rng(seed)
        self.model, self.q0 = model, q0
        self.omega = 2 * np.pi * np.array(frequencies_hz) * rng.uniform(0.8, 1.2, (model.nv, 1))
        self.phase = rng.uniform(0, 2 * np.pi, self.omega.shape)
        self.size = amplitude / len(frequencies_hz) * rng.uniform(0.5, 1.5, self.omega.shape)
        self.size[:3] /= 3

    def _x(self, t: float, order: int) -> np.ndarray:
        turned = np.sin(self.omega * t + self.phase + order * np.pi / 2)
        return (self.size * self.omega**order * turned).sum(axis=1)

    def q(self, t: float) -> np.ndarray:
        return pin.integrate(self.model, self.q0, self._x(t, 0))

    def v(self, t: float) -> np.ndarray:
        moved = pin.dIntegrate(self.model, self.q0, self._x(t, 0), pin.ArgumentPosition.ARG1)
        return moved @ self._x(t, 1)

    def a(self, t: float, h: float = 1e-3) -> np.ndarray:
        """Fourth-order difference of the exact velocity: right to about 1e-9."""
        near, far = self.v(t + h) - self.v(t - h), self.v(t + 2 * h) - self.v(t - 2 * h)
        return (8 * near - far) / (12 * h)

    def sampled(self, duration_s: float, rate_hz: float) -> tuple[np.ndarray, ...]:
        """Times (N,), q (N, nq), v and a (N, nv)."""
        times = np.arange(round(duration_s * rate_hz)) / rate_hz
        return (times, *(np.stack([f(t) for t in times]) for f in (self.q, self.v, self.a)))
