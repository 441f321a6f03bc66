"""A person's skeleton as a Pinocchio model, its ground wrench and the centre of pressure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.body.person import Person


def pinocchio_model(person: Person) -> pin.Model:
    """Tree of the person, in the skeleton's order (joint i + 1 is segment i).

    Joint frames sit in the joint centres with the segment's axes; gravity points along -Z. Segments
    with mass carry 1 kg, which says that there is one: inertial parameters come as ``phi``.
    """
    model = pin.Model()
    model.gravity.linear = np.array([0.0, 0.0, -GRAVITY_M_S2])
    skeleton = person.skeleton
    positions, rotations = person.joint_positions_m(), person.joint_rotations()
    axes = person.hinge_axes()
    for i, kind in enumerate(skeleton.joint_types):
        joint = {
            "free": pin.JointModelFreeFlyer,
            "spherical": pin.JointModelSpherical,
        }.get(kind, lambda axis=axes[i]: pin.JointModelRevoluteUnaligned(axis))()
        placement = pin.SE3(rotations[i], positions[i])
        index = model.addJoint(skeleton.parents[i] + 1, joint, placement, skeleton.joints[i])
        assert index == i + 1
        if i in skeleton.bodies:
            model.inertias[index] = pin.Inertia.FromSphere(1.0, 0.1)
    return model


def bodies_of(model: pin.Model) -> list[int]:
    """Joints whose segment has mass: ``phi`` is ten parameters for each of them, in this order."""
    return [j for j in range(1, model.njoints) if model.inertias[j].mass > 0]


# --- the ground wrench as a linear function of the inertial parameters (Hansen 2017, equation 7)


def wrench_regressor(
    model: pin.Model, q: np.ndarray, v: np.ndarray, a: np.ndarray, reference_m: np.ndarray
) -> np.ndarray:
    """(N, 6, 10 n) regressor of the ground wrench of n segments with mass, in world axes about a
    reference point.

    The six rows of the floating base, which no joint torque enters, turned from the base's frame
    into the world's and moved from the base's origin to ``reference_m`` (3,). Forces [N] come
    first, then moments [N m]; q (N, nq), v and a (N, nv) as Pinocchio has them.
    """
    columns = (10 * (np.array(bodies_of(model)) - 1)[:, None] + np.arange(10)).ravel()
    rows, data = np.empty((len(q), 6, len(columns))), model.createData()
    for k in range(len(q)):
        of_all = pin.computeJointTorqueRegressor(model, data, q[k], v[k], a[k])
        rows[k] = of_all[:6, columns]
    turn = rotations_of(q[:, 3:7])
    rows[:, :3] = turn @ rows[:, :3]
    rows[:, 3:] = turn @ rows[:, 3:] + skew(q[:, :3] - reference_m) @ rows[:, :3]
    return rows


def predicted_wrench(
    model: pin.Model,
    q: np.ndarray,
    v: np.ndarray,
    a: np.ndarray,
    phi: np.ndarray,
    reference_m: np.ndarray,
    block: int = 500,
) -> np.ndarray:
    """(N, 6, k) wrench of k parameter vectors phi (10 n, k); memory grows with ``block`` only."""
    wrench = np.empty((len(q), 6, phi.shape[1]))
    for start in range(0, len(q), block):
        part = slice(start, start + block)
        wrench[part] = wrench_regressor(model, q[part], v[part], a[part], reference_m) @ phi
    return wrench


def move_moments(wrench: np.ndarray, reference_m: np.ndarray) -> np.ndarray:
    """(N, 6) wrench about the world's origin, seen about ``reference_m``."""
    moved = wrench.copy()
    moved[:, 3:] -= np.cross(reference_m, wrench[:, :3])
    return moved


def rotations_of(quaternions: np.ndarray) -> np.ndarray:
    """(N, 3, 3) rotations of unit quaternions x, y, z, w."""
    x, y, z, w = quaternions.T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def skew(vectors: np.ndarray) -> np.ndarray:
    """(..., 3, 3) matrices of the cross product with (..., 3) vectors."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    zero = np.zeros_like(x)
    return np.moveaxis(np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]), (0, 1), (-2, -1))


# --- how the ground wrench answers to small errors of the motion ----------------------------------


@dataclass(frozen=True, eq=False)
class WrenchResponse:
    """Linear response of the world wrench about the origin to errors d of the motion.

    to_position, to_velocity, to_acceleration : (N, 6, nv) for errors of q (in the tangent space,
    body axes), v and a, the latter two as Pinocchio has them. v : (N, nv); spherical, free : the
    first index of the three angular velocities of each joint that turns freely, and the base's.
    """

    to_position: np.ndarray
    to_velocity: np.ndarray
    to_acceleration: np.ndarray
    v: np.ndarray
    spherical: tuple[int, ...]
    rate_hz: float

    def of(self, errors: np.ndarray) -> np.ndarray:
        """(N, 6, k) change of the wrench for signals of pose errors (N, nv, k)."""
        speed = self._rate_of(errors)
        acceleration = np.gradient(speed, 1 / self.rate_hz, axis=0)
        return (
            self.to_position @ errors
            + self.to_velocity @ speed
            + self.to_acceleration @ acceleration
        )

    def parts(self, errors: np.ndarray) -> np.ndarray:
        """(3, N, 6, k) what s, s' and s'' add to the wrench, for pose errors s(t) d(t).

        ``errors`` (N, nv, k) are d; so one signal serves every s.
        """
        speed = self._rate_of(errors)
        both = np.gradient(errors, 1 / self.rate_hz, axis=0) + speed
        with_rate = self.to_velocity @ errors + self.to_acceleration @ both
        return np.stack([self.of(errors), with_rate, self.to_acceleration @ errors])

    def _rate_of(self, errors: np.ndarray) -> np.ndarray:
        """Error of v for a signal of pose errors: d' + v x d where axes turn with the body."""
        speed = np.gradient(errors, 1 / self.rate_hz, axis=0)
        for at in self.spherical:
            turning = slice(at, at + 3)
            speed[:, turning] += skew(self.v[:, turning]) @ errors[:, turning]
        linear, turning = slice(0, 3), slice(3, 6)
        speed[:, linear] += skew(self.v[:, turning]) @ errors[:, linear]
        speed[:, linear] += skew(self.v[:, linear]) @ errors[:, turning]
        return speed


def wrench_response(
    person: Person, phi: np.ndarray, q: np.ndarray, v: np.ndarray, a: np.ndarray, rate_hz: float
) -> WrenchResponse:
    """Derivatives of the inverse dynamics of parameters phi (10 n,) along a motion."""
    model = pinocchio_model(person)
    for joint, parameters in zip(bodies_of(model), phi.reshape(-1, 10), strict=True):
        model.inertias[joint] = pin.Inertia.FromDynamicParameters(parameters)
    data, nv = model.createData(), model.nv
    base, parts = np.empty((len(q), 6)), np.empty((3, len(q), 6, nv))
    for k in range(len(q)):
        by_q, by_v, by_a = pin.computeRNEADerivatives(model, data, q[k], v[k], a[k])
        base[k], parts[0, k], parts[1, k], parts[2, k] = data.tau[:6], by_q[:6], by_v[:6], by_a[:6]
    # The base's own axes turn and shift with its error.
    parts[0, :, :3, 3:6] -= skew(base[:, :3])
    parts[0, :, 3:, 3:6] -= skew(base[:, 3:])
    turn = rotations_of(q[:, 3:7])
    parts = np.concatenate([turn @ parts[:, :, :3], turn @ parts[:, :, 3:]], axis=2)
    parts[:, :, 3:] += skew(q[:, :3]) @ parts[:, :, :3]
    force = (turn @ base[:, :3, None])[..., 0]
    parts[0, :, 3:, :3] -= skew(force) @ turn
    types = person.skeleton.joint_types
    starts = person.skeleton.v_starts
    free = tuple(s for s, kind in zip(starts, types, strict=True) if kind == "spherical")
    by_q, by_v, by_a = parts
    return WrenchResponse(by_q, by_v, by_a, v, (3, *free), rate_hz)


# --- centre of pressure from a wrench -------------------------------------------------------------


def centre_of_pressure(
    wrench: np.ndarray, surface_height_m: float, min_force_N: float
) -> np.ndarray:
    """(N, 2) world x and y [m] where the ground force meets the surface.

    From M = r x F + (0, 0, T) about the world's origin with r on the surface: x = (z Fx - My) / Fz
    and y = (z Fy + Mx) / Fz (Hansen 2017, equations 8 and 9, whose left sides are exchanged in
    print). NaN while the vertical force is below ``min_force_N``.
    """
    fx, fy, fz, mx, my, _ = wrench.T
    loaded = np.where(fz > min_force_N, fz, np.nan)
    z = surface_height_m
    return np.stack([(z * fx - my) / loaded, (z * fy + mx) / loaded], axis=1)


def anterior_and_right(points: np.ndarray, anterior: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """World x, y (N, 2) as coordinates along the person's anterior direction and to the right."""
    right = np.array([anterior[1], -anterior[0]])
    return points @ anterior, points @ right
