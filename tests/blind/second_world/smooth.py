"""Rotations, smooth windows and slow random courses."""

from __future__ import annotations

from functools import partial

import numpy as np
from scipy.ndimage import gaussian_filter1d

_BEFORE_S = 2.0  # drawn before and after a course, so that its ends are like its middle


def _about(axis: int, angles_rad: np.ndarray) -> np.ndarray:
    """Rotation matrices (N, 3, 3) about an axis."""
    angles = np.atleast_1d(angles_rad)
    first, second = (axis + 1) % 3, (axis + 2) % 3
    R = np.zeros((len(angles), 3, 3))
    R[:, axis, axis] = 1.0
    R[:, first, first] = R[:, second, second] = np.cos(angles)
    R[:, second, first] = np.sin(angles)
    R[:, first, second] = -np.sin(angles)
    return R


about_x, about_y, about_z = (partial(_about, axis) for axis in range(3))


def turned(R: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Vectors (3,) or (N, 3) turned by each of R (N, 3, 3)."""
    return (R @ np.asarray(vectors, float)[..., None])[..., 0]


def step(x: np.ndarray) -> np.ndarray:
    """From 0 at x = 0 to 1 at x = 1, twice continuously differentiable."""
    x = np.clip(x, 0.0, 1.0)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x * x)


def window(times_s: np.ndarray, start_s: float, length_s: float, ramp_s: float = 0.6) -> np.ndarray:
    """1 within the stretch, 0 outside, with ramps inside of it."""
    end_s = start_s + length_s
    return step((times_s - start_s) / ramp_s) * step((end_s - times_s) / ramp_s)


def slow_course(
    rng: np.random.Generator, shape: tuple[int, ...], rate_hz: float, cutoff_hz: float
) -> np.ndarray:
    """Random course over the first axis without parts much above a frequency; SD of 1."""
    before = int(_BEFORE_S * rate_hz)
    drawn = rng.normal(size=(shape[0] + int(2 * _BEFORE_S * rate_hz), *shape[1:]))
    sigma = rate_hz / (2.0 * np.pi * cutoff_hz)
    course = gaussian_filter1d(drawn, sigma, axis=0)[before : before + shape[0]]
    return course / (course.std() + 1e-12)
