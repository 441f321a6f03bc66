"""One trial as the effects see it: motion, parameters, plates, and the wrench they predict."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin

from bsip_cli.body.person import Person
from bsip_cli.dynamics.pinocchio_model import pinocchio_model
from bsip_cli.dynamics.regressor import predicted_wrench
from bsip_cli.dynamics.segment_motion import Point, SegmentMotion, segment_motion
from bsip_cli.dynamics.wrench_response import WrenchResponse, wrench_response


@dataclass(frozen=True)
class Plate:
    """name, corners (4, 3) [m] in the world, measured wrench (N, 6) about the world's origin."""

    name: str
    corners_m: np.ndarray
    wrench: np.ndarray

    def centre_m(self) -> np.ndarray:
        return self.corners_m.mean(axis=0)

    def axes(self) -> np.ndarray:
        """(3, 3) rows: along the first edge, along the plate across it, and its normal upwards."""
        first = self.corners_m[1] - self.corners_m[0]
        first = first / np.linalg.norm(first)
        normal = np.cross(first, self.corners_m[2] - self.corners_m[1])
        normal *= np.sign(normal[2]) / np.linalg.norm(normal)
        return np.stack([first, np.cross(normal, first), normal])


@dataclass(frozen=True)
class Scene:
    """Motion q (N, nq), v and a (N, nv) at times (N,) [s], parameters phi (10 n,) about the joint
    centres, the plates, and which frames are valid (N,)."""

    times_s: np.ndarray
    person: Person
    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    phi: np.ndarray
    plates: tuple[Plate, ...]
    valid: np.ndarray

    @property
    def rate_hz(self) -> float:
        return 1.0 / float(np.median(np.diff(self.times_s)))

    @property
    def mass_kg(self) -> float:
        return float(self.phi[::10].sum())

    @cached_property
    def model(self) -> pin.Model:
        return pinocchio_model(self.person)

    @cached_property
    def predicted(self) -> np.ndarray:
        """(N, 6) simulated wrench about the world's origin [N, N m]."""
        return self.wrench_of(self.phi)

    def wrench_of(self, phi: np.ndarray) -> np.ndarray:
        """(N, 6) wrench of other parameters and the same motion."""
        return predicted_wrench(
            self.model, self.q, self.v, self.a, phi[:, None], np.zeros(3)
        )[..., 0]

    @cached_property
    def motion(self) -> SegmentMotion:
        """Of every segment's joint centre."""
        return segment_motion(self.model, self.q, self.v, self.a)

    @cached_property
    def response(self) -> WrenchResponse:
        """To small errors of the motion."""
        return wrench_response(self.person, self.phi, self.q, self.v, self.a, self.rate_hz)

    @cached_property
    def centre_of_mass_m(self) -> np.ndarray:
        """(N, 3) of the whole body, world."""
        R, p = self.motion.rotation, self.motion.position_m
        masses, moments = self.phi[::10], self.phi.reshape(-1, 10)[:, 1:4]
        total = np.einsum("i,fix->fx", masses, p) + np.einsum("fixy,iy->fx", R, moments)
        return total / masses.sum()

    def point(self, segment: str, offset_m: np.ndarray) -> Point:
        """A point fixed in a segment, ``offset_m`` (3,) from the segment's origin."""
        i = self.person.skeleton.index(segment)
        return self.motion.point(i, self.person.origin_in_joint_m[i] + offset_m)

    def centre_of(self, segment: str) -> np.ndarray:
        """(3,) centre of mass of a segment from its origin [m]."""
        i = self.person.skeleton.index(segment)
        mass, *moment = self.phi[10 * i : 10 * i + 4]
        return np.array(moment) / mass - self.person.origin_in_joint_m[i]
