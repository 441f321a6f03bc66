"""The ground wrench as a linear function of the inertial parameters (Hansen 2017, equation 7)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pinocchio as pin

from bsip_cli.dynamics.pinocchio_model import bodies_of


def wrench_regressor(
    model: pin.Model,
    data: pin.Data,
    q: np.ndarray,
    v: np.ndarray,
    a: np.ndarray,
    reference_m: np.ndarray,
) -> np.ndarray:
    """(N, 6, 10 n) regressor of the ground wrench of n segments with mass, in world axes about a
    reference point.

    The six rows of the floating base, which no joint torque enters, turned from the base's frame
    into the world's and moved from the base's origin to ``reference_m`` (3,). Forces [N] come
    first, then moments [N m]; q (N, nq), v and a (N, nv) as Pinocchio has them.
    """
    columns = (10 * (np.array(bodies_of(model)) - 1)[:, None] + np.arange(10)).ravel()
    rows = np.empty((len(q), 6, len(columns)))
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
    for part, rows in regressor_blocks(model, q, v, a, reference_m, block):
        wrench[part] = rows @ phi
    return wrench


def regressor_blocks(
    model: pin.Model,
    q: np.ndarray,
    v: np.ndarray,
    a: np.ndarray,
    reference_m: np.ndarray,
    block: int,
) -> Iterator[tuple[slice, np.ndarray]]:
    """The regressor, ``block`` frames at a time."""
    data = model.createData()
    for start in range(0, len(q), block):
        part = slice(start, min(start + block, len(q)))
        yield part, wrench_regressor(model, data, q[part], v[part], a[part], reference_m)


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
    """(N, 3, 3) matrices of the cross product with (N, 3) vectors."""
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    return np.moveaxis(np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]), -1, 0)
