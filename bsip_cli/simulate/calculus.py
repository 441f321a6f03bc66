"""Numerical derivative and integral over time, and polynomials that bridge gaps."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.signal import cont2discrete, lfilter

CENTRAL_8 = np.array([4 / 5, -1 / 5, 4 / 105, -1 / 280])  # weights of +1..+4 samples
HALF_WIDTH = 4


def derivative(values: np.ndarray, step_s: float) -> np.ndarray:
    """First derivative along axis 0: eighth-order central differences.

    The four samples at either end use second-order differences; callers simulate a margin.
    """
    values = np.asarray(values, dtype=float)
    slope = np.gradient(values, step_s, axis=0)
    n = len(values)
    if n <= 2 * HALF_WIDTH:
        return slope
    inner = np.zeros_like(values[HALF_WIDTH : n - HALF_WIDTH])
    for k, weight in enumerate(CENTRAL_8, start=1):
        ahead = values[HALF_WIDTH + k : n - HALF_WIDTH + k]
        behind = values[HALF_WIDTH - k : n - HALF_WIDTH - k]
        inner += weight * (ahead - behind)
    slope[HALF_WIDTH : n - HALF_WIDTH] = inner / step_s
    return slope


def integral(values: np.ndarray, step_s: float) -> np.ndarray:
    """Integral along axis 0 from the first sample (quintic spline)."""
    t = np.arange(len(values)) * step_s
    return make_interp_spline(t, values, k=5).antiderivative()(t)


def response(
    numerator: list[float], denominator: list[float], values: np.ndarray, step_s: float
) -> np.ndarray:
    """(T, 3) response of a linear system at rest to values that are linear between samples."""
    b, a, _ = cont2discrete((numerator, denominator), step_s, method="foh")
    return lfilter(np.ravel(b), a, values, axis=0)


def bridge(start: np.ndarray, end: np.ndarray, duration_s: float, t_s: np.ndarray) -> np.ndarray:
    """Septic polynomial through two states.

    Parameters
    ----------
    start, end : (4, D): value, first, second and third derivative.
    duration_s : time from start to end.
    t_s : (T,) times since the start.

    Returns
    -------
    (T, D) values.
    """
    scale = duration_s ** np.arange(4)[:, None]
    a, b = start * scale, end * scale
    low = a / np.array([1.0, 1.0, 2.0, 6.0])[:, None]
    powers = np.arange(4, 8)
    at_one = np.stack([np.ones(4), powers, powers * (powers - 1), _third(powers)])
    of_low = np.array([[1, 1, 1, 1], [0, 1, 2, 3], [0, 0, 2, 6], [0, 0, 0, 6]], dtype=float)
    high = np.linalg.solve(at_one, b - of_low @ low)
    s = np.asarray(t_s)[:, None] / duration_s
    coefficients = np.vstack([low, high])
    return np.polynomial.polynomial.polyval(s[:, 0], coefficients).T


def _third(powers: np.ndarray) -> np.ndarray:
    return powers * (powers - 1) * (powers - 2)
