"""How a rigid body has moved between points that are known before and after."""

from __future__ import annotations

import numpy as np


def rigid_motion(reference: np.ndarray, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotations (N, 3, 3) and shifts (N, 3) that bring reference (k, 3) onto frames (N, k, 3).

    Least squares (Kabsch 1976, A solution for the best rotation to relate two sets of vectors).
    """
    a, b = reference.mean(axis=0), frames.mean(axis=1)
    covariance = np.einsum("ki,nkj->nij", reference - a, frames - b[:, None])
    u, _, vt = np.linalg.svd(covariance)
    vt[:, 2] *= np.linalg.det(u @ vt)[:, None]
    turn = np.einsum("nji,nkj->nik", vt, u)
    return turn, b - turn @ a
