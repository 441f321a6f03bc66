"""How every segment moves in the world, and what mass at a point of it would weigh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.body.inertia import SYMMETRIC

UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class Point:
    """position (N, 3) [m] and acceleration (N, 3) [m/s2] of a body-fixed point, world axes."""

    position_m: np.ndarray
    acceleration_m_s2: np.ndarray

    def carrying_wrench(self) -> np.ndarray:
        """(N, 6) ground wrench about the world's origin that 1 kg at the point asks for."""
        force = self.acceleration_m_s2 + GRAVITY_M_S2 * UP
        return np.hstack([force, np.cross(self.position_m, force)])


@dataclass(frozen=True, eq=False)
class SegmentMotion:
    """Of n segments in N frames, world axes: rotation (N, n, 3, 3) and position (N, n, 3) [m] of
    the joint centres, the centres' acceleration [m/s2], angular velocity [rad/s] and acceleration
    [rad/s2], each (N, n, 3)."""

    rotation: np.ndarray
    position_m: np.ndarray
    acceleration_m_s2: np.ndarray
    turning_rad_s: np.ndarray
    turning_acceleration_rad_s2: np.ndarray

    def point(self, segment: int, offset_m: np.ndarray) -> Point:
        """A point ``offset_m`` (3,) from the joint centre, segment axes."""
        arm = self.rotation[:, segment] @ offset_m
        turning = self.turning_rad_s[:, segment]
        acceleration = (
            self.acceleration_m_s2[:, segment]
            + np.cross(self.turning_acceleration_rad_s2[:, segment], arm)
            + np.cross(turning, np.cross(turning, arm))
        )
        return Point(self.position_m[:, segment] + arm, acceleration)

    def wrenches(self, segment: int) -> np.ndarray:
        """(N, 6, 10) ground wrench about the world's origin for each inertial parameter.

        Newton and Euler for a body about its joint centre; parameters as in ``body.inertia``.
        """
        R, w = self.rotation[:, segment], self.turning_rad_s[:, segment]
        dw = self.turning_acceleration_rad_s2[:, segment]
        fall = self.acceleration_m_s2[:, segment] + GRAVITY_M_S2 * UP
        force, moment = np.zeros((2, len(R), 3, 10))
        force[:, :, 0] = fall
        for k in range(3):
            arm = R[:, :, k]
            force[:, :, 1 + k] = np.cross(dw, arm) + np.cross(w, np.cross(w, arm))
            moment[:, :, 1 + k] = np.cross(arm, fall)
        for k, (i, j) in enumerate(SYMMETRIC):
            unit = np.zeros((3, 3))
            unit[i, j] = unit[j, i] = 1.0
            tensor = R @ unit @ R.swapaxes(1, 2)
            spin = (tensor @ w[..., None])[..., 0]
            moment[:, :, 4 + k] = (tensor @ dw[..., None])[..., 0] + np.cross(w, spin)
        moment += np.cross(self.position_m[:, segment, :, None], force, axis=1)
        return np.concatenate([force, moment], axis=1)


def segment_motion(model: pin.Model, q: np.ndarray, v: np.ndarray, a: np.ndarray) -> SegmentMotion:
    """Forward kinematics of q (N, nq), v and a (N, nv)."""
    data, n = model.createData(), model.njoints - 1
    rotation, position = np.empty((len(q), n, 3, 3)), np.empty((len(q), n, 3))
    velocity, spatial = np.empty((2, len(q), n, 6))  # in the axes of the segment
    for k in range(len(q)):
        pin.forwardKinematics(model, data, q[k], v[k], a[k])
        for i in range(n):
            place = data.oMi[i + 1]
            rotation[k, i], position[k, i] = place.rotation, place.translation
            velocity[k, i], spatial[k, i] = data.v[i + 1].vector, data.a[i + 1].vector
    turning = velocity[..., 3:]
    acceleration = spatial[..., :3] + np.cross(turning, velocity[..., :3])
    inside = np.stack([acceleration, turning, spatial[..., 3:]])
    return SegmentMotion(rotation, position, *np.einsum("fnij,vfnj->vfni", rotation, inside))
