"""Gaps in marker trajectories: from the rigid segment, short ones else by a spline."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from bsip_cli.body.person import rigid_motion
from bsip_cli.recordings.analog import runs

_LEAST_OTHERS = 3
_THIN_M = 0.005  # a cluster narrower than this across its long axis has no orientation
_LOOSE_M = 0.01  # a cluster that changes shape by more is not rigid
_ROUNDING_S = 1e-9
_SUPPORT = 8  # frames used on each side by the spline


@dataclass(frozen=True, eq=False)
class FilledMarkers:
    markers_m: np.ndarray  # (n_frames, n_markers, 3), what stays missing is NaN
    filled: np.ndarray  # (n_frames, n_markers) bool, True = not measured
    rigid: np.ndarray  # (n_frames, n_markers) bool, the part filled from the segment


def fill_gaps(
    markers_m: np.ndarray,
    rate_hz: float,
    segments: Sequence[Sequence[int]],
    max_gap_s: float,
    max_rigid_gap_s: float,
) -> FilledMarkers:
    """Fill short gaps that have measured frames on both sides, and mark what was filled.

    By the other markers of the segment, where three of them are seen throughout a gap of at most
    ``max_rigid_gap_s``; else by a spline, up to ``max_gap_s``. ``segments`` lists the columns of
    markers that move as one rigid body. Only measured positions are used to fill; longer gaps and
    the ends stay NaN.
    """
    measured = np.isfinite(markers_m).all(axis=-1)
    result = np.where(measured[..., None], markers_m, np.nan)
    rigid = np.zeros_like(measured)
    for marker in range(markers_m.shape[1]):
        mates = _mates(marker, segments)
        for start, stop in _inner_gaps(measured[:, marker]):
            patch, length_s = None, (stop - start) / rate_hz - _ROUNDING_S
            if length_s <= max_rigid_gap_s:
                patch = _from_segment(markers_m, measured, marker, mates, start, stop)
                rigid[start:stop, marker] = patch is not None
            if patch is None and length_s <= max_gap_s:
                patch = _by_spline(markers_m[:, marker], measured[:, marker], start, stop)
            if patch is not None:
                result[start:stop, marker] = patch
    filled = ~measured & np.isfinite(result).all(axis=-1)
    return FilledMarkers(result, filled, rigid)


def _mates(marker: int, segments: Sequence[Sequence[int]]) -> list[int]:
    """The other markers on the same segment (the first that has enough of them)."""
    own = [[m for m in segment if m != marker] for segment in segments if marker in segment]
    return max(own, key=len, default=[])


def _inner_gaps(measured: np.ndarray) -> list[tuple[int, int]]:
    """Start and stop (exclusive) of the gaps with measured frames on both sides."""
    n = len(measured)
    return [(int(start), int(stop)) for start, stop in runs(~measured) if start > 0 and stop < n]


def _from_segment(
    markers_m: np.ndarray,
    measured: np.ndarray,
    marker: int,
    mates: Sequence[int],
    start: int,
    stop: int,
) -> np.ndarray | None:
    """Positions (n_gap, 3) carried by the mates from both rims of the gap, cross-faded."""
    frames = slice(start - 1, stop + 1)
    seen = [m for m in mates if measured[frames, m].all()]
    if len(seen) < _LEAST_OTHERS:
        return None
    cluster = markers_m[frames][:, seen]
    if not _is_rigid(cluster):
        return None
    before = _carried(cluster, 0, markers_m[start - 1, marker])
    after = _carried(cluster, -1, markers_m[stop, marker])
    share = np.linspace(0, 1, len(cluster))[:, None]
    return ((1 - share) * before + share * after)[1:-1]


def _is_rigid(cluster: np.ndarray) -> bool:
    """Not nearly on a line, and of constant shape; cluster (n, k, 3)."""
    first = cluster[0] - cluster[0].mean(axis=0)
    spread = np.linalg.svd(first, compute_uv=False) / np.sqrt(len(first))
    sizes = np.linalg.norm(cluster[:, :, None] - cluster[:, None], axis=-1)
    return bool(spread[1] > _THIN_M and np.ptp(sizes, axis=0).max() < _LOOSE_M)


def _carried(cluster: np.ndarray, anchor: int, position: np.ndarray) -> np.ndarray:
    """(n, 3) the position at the anchor frame moved along with the cluster (n, k, 3)."""
    turn, shift = rigid_motion(cluster[anchor], cluster)
    return turn @ position + shift


def _by_spline(track: np.ndarray, measured: np.ndarray, start: int, stop: int) -> np.ndarray:
    """Cubic spline through the nearest measured frames on both sides, (n_gap, 3)."""
    before = np.flatnonzero(measured[:start])[-_SUPPORT:]
    after = stop + np.flatnonzero(measured[stop:])[:_SUPPORT]
    known = np.concatenate([before[before >= start - 2 * _SUPPORT], after])
    known = known[known < stop + 2 * _SUPPORT]
    return CubicSpline(known, track[known])(np.arange(start, stop))
