"""What every test asks of its samples first: finite values, and values that vary."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

ROUNDING = 1e-12
"""Differences below this part of the largest value are rounding, not variation."""


def finite_values(x: ArrayLike) -> NDArray[np.float64]:
    """The finite values of a one-dimensional sample."""
    values = np.asarray(x, dtype=float)
    if values.ndim != 1:
        raise ValueError(f"a sample must be one-dimensional, not of shape {values.shape}")
    return values[np.isfinite(values)]


def finite_pairs(x: ArrayLike, y: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The rows in which both samples, of one shape (n,), are finite."""
    first, second = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    if first.ndim != 1 or first.shape != second.shape:
        raise ValueError(f"paired samples of shapes {first.shape} and {second.shape}")
    both = np.isfinite(first) & np.isfinite(second)
    return first[both], second[both]


def is_constant(values: NDArray[np.float64], *, beside: float = 0.0) -> bool:
    """Whether the values vary by no more than rounding.

    Parameters
    ----------
    values : shape (n,), n > 0.
    beside : largest magnitude of what the values were computed from, in their unit; the
        difference of two large numbers carries their rounding.
    """
    scale = max(float(np.max(np.abs(values))), beside)
    return float(np.ptp(values)) <= ROUNDING * scale


def standard_deviation(values: NDArray[np.float64]) -> float:
    """Sample standard deviation (n - 1): nan below two values, 0 if they differ by rounding."""
    if len(values) < 2:
        return float("nan")
    return 0.0 if is_constant(values) else float(np.std(values, ddof=1))


def mean_of(values: NDArray[np.float64]) -> float:
    """Mean, nan for no values."""
    return float(np.mean(values)) if len(values) else float("nan")
