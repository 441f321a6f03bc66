"""How the ground wrench answers to small errors of the motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from bsip_cli.body.person import Person
from bsip_cli.dynamics.pinocchio_model import bodies_of, pinocchio_model
from bsip_cli.dynamics.regressor import rotations_of, skew


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
            speed[:, turning] += _cross(self.v[:, turning], errors[:, turning])
        linear, turning = slice(0, 3), slice(3, 6)
        speed[:, linear] += _cross(self.v[:, turning], errors[:, linear])
        speed[:, linear] += _cross(self.v[:, linear], errors[:, turning])
        return speed


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """(N, 3) x (N, 3, k)."""
    return skew(a) @ b


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
