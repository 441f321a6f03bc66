"""Markers that are hidden for a while, and how an export writes what is missing."""

from __future__ import annotations

import numpy as np

from tests.circumstances.export import SIZES, Export


def hidden(shape: tuple[int, int], share: float, seed: int) -> np.ndarray:
    """(frames, markers) True where a marker is hidden: one stretch in every third marker."""
    frames, markers = shape
    rng = np.random.default_rng([seed, 77])
    lost = np.zeros(shape, bool)
    length = int(share * frames)
    for marker in range(0, markers if length else 0, 3):
        start = rng.integers(5, max(frames - length - 5, 6))
        lost[start : start + length, marker] = True
    return lost


def stored_points(points_m: np.ndarray, export: Export, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, k, 3) [export's unit] as stored, and residuals (n, k); NaN: a written gap."""
    points = points_m @ export.marker_axes.T / SIZES[export.point_unit]
    lost = hidden(points.shape[:2], export.hidden_share, seed)
    if export.missing == "held":
        points = _held(points, lost)
    elif export.missing == "zero":
        points[lost] = 0.0
    elif export.missing == "nan":
        points[lost] = np.nan
    else:
        points[lost] = float(export.missing)
    normal = np.where(lost & (export.missing == "nan"), -1.0, 0.0)
    return points, normal


def _held(points: np.ndarray, lost: np.ndarray) -> np.ndarray:
    """The last seen value stays."""
    points = points.copy()
    for frame in range(1, len(points)):
        points[frame, lost[frame]] = points[frame - 1, lost[frame]]
    return points
