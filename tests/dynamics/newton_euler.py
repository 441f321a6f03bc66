"""Newton's and Euler's laws for one body from where it is over time; nothing of the product."""

from __future__ import annotations

import numpy as np


def rate(x: np.ndarray, step_s: float) -> np.ndarray:
    """Fourth-order central differences; the two samples at either end are wrong."""
    d = np.gradient(x, step_s, axis=0)
    d[2:-2] = (8 * (x[3:-1] - x[1:-3]) - (x[4:] - x[:-4])) / (12 * step_s)
    return d


def driving_wrench(
    R: np.ndarray,
    com_m: np.ndarray,
    mass_kg: float,
    tensor_kgm2: np.ndarray,
    gravity_m_s2: np.ndarray,
    step_s: float,
) -> np.ndarray:
    """(N, 6) force and moment about the origin that carry and move a body with axes R (N, 3, 3),
    centre of mass (N, 3) and tensor (3, 3) about it in its axes."""
    spin = rate(R, step_s) @ R.swapaxes(1, 2)
    w = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
    turned = R @ tensor_kgm2 @ R.swapaxes(1, 2)
    linear = mass_kg * rate(com_m, step_s)
    angular = np.cross(com_m, linear) + (turned @ w[..., None])[..., 0]
    weight = mass_kg * gravity_m_s2
    force = rate(linear, step_s) - weight
    return np.hstack([force, rate(angular, step_s) - np.cross(com_m, weight)])


def joint_axes(R_parent: np.ndarray, R_child: np.ndarray, side: float = 1.0) -> np.ndarray:
    """(N, 3, 3) rows: the axes of a joint coordinate system in the world (Grood and Suntay);
    ``side`` -1 for left joints."""
    first, third = R_parent @ [0, 0, 1], side * (R_child @ [0, 1, 0])
    second = np.cross(third, first)
    second /= np.linalg.norm(second, axis=1, keepdims=True)
    return np.stack([first, second, third], axis=1)
