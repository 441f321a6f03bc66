"""Centre of pressure from a wrench."""

from __future__ import annotations

import numpy as np


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
