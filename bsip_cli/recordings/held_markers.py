"""Markers that stand still to the last bit while those around them move on: lost, not seen."""

from __future__ import annotations

import numpy as np

from bsip_cli.recordings.analog import runs

_LEAST_FRAMES = 3  # two alike are no sign
_NEIGHBOURS = 3
_CLEARLY_M = 5e-3  # the neighbours' way during a hold: more than soft tissue of a still limb
_DIGITS = 5.0  # as many sizes of the last digit: a marker that is still moves within one
_ITS_SHARE = 0.3  # of the neighbours' way: what it has to make up afterwards
_FINE_M = 1e-5  # no camera's noise is smaller: a marker at rest does not repeat itself
_RARELY = 0.01  # of a marker's steps are none, outside the hold


def held_markers(markers_m: np.ndarray) -> np.ndarray:
    """Which positions (n_frames, n_markers, 3) only repeat a marker's last one, bool.

    A run of equal positions is a hold if the nearest other markers move on meanwhile, by clearly
    more than the last digit, and the marker then jumps after them. At the end of a trial there is
    no jump: there it counts where numbers are fine and the marker never repeats itself elsewhere.
    A foot on the ground in coarse numbers leaves its place by one digit, and is no hold.
    """
    held = np.zeros(markers_m.shape[:2], bool)
    if len(markers_m) <= _LEAST_FRAMES or markers_m.shape[1] <= _NEIGHBOURS:
        return held
    same = np.zeros(markers_m.shape[:2], bool)
    same[1:] = (markers_m[1:] == markers_m[:-1]).all(axis=-1)
    if not same.any():
        return held
    digit_m = _last_digit(markers_m)
    for marker in map(int, np.flatnonzero(same.any(axis=0))):
        still = runs(same[:, marker])
        neighbours = _nearest(markers_m, marker)
        for start, stop in still[np.diff(still, axis=1)[:, 0] >= _LEAST_FRAMES - 1]:
            way = _way(markers_m[:, neighbours], start - 1, min(stop, len(same) - 1))
            if not way > max(_CLEARLY_M, _DIGITS * digit_m):
                continue
            if stop < len(same) and np.isfinite(markers_m[stop, marker]).all():
                is_hold = _jumps(markers_m[:, marker], stop, way)
            else:
                others = same[:, marker].sum() - (stop - start)
                is_hold = digit_m < _FINE_M and others < _RARELY * len(same)
            held[start:stop, marker] = is_hold
    return held


def _last_digit(markers_m: np.ndarray) -> float:
    """The smallest step of any coordinate: the size of its last digit."""
    steps = np.abs(np.diff(markers_m[:2000], axis=0))
    return float(np.min(steps[steps > 0], initial=np.inf))


def _nearest(markers_m: np.ndarray, marker: int) -> np.ndarray:
    """The markers that are nearest throughout."""
    some = markers_m[:: max(1, len(markers_m) // 200)]
    distance = np.linalg.norm(some - some[:, marker, None], axis=-1)
    known = np.isfinite(distance)
    usual = np.where(known.any(axis=0), np.median(np.where(known, distance, 1e9), axis=0), 1e9)
    usual[marker] = np.inf
    return np.argsort(usual)[:_NEIGHBOURS]


def _way(neighbours_m: np.ndarray, first: int, last: int) -> float:
    """Median way of the neighbours (n_frames, k, 3) between two frames; NaN if unseen."""
    way = np.linalg.norm(neighbours_m[last] - neighbours_m[first], axis=-1)
    return float(np.median(way[np.isfinite(way)])) if np.isfinite(way).sum() > 1 else float("nan")


def _jumps(marker_m: np.ndarray, stop: int, way_m: float) -> bool:
    """Whether the marker (n_frames, 3) leaves its place at once, not as it goes on."""
    jump = np.linalg.norm(marker_m[stop] - marker_m[stop - 1])
    after = np.linalg.norm(np.diff(marker_m[stop : stop + 4], axis=0), axis=-1)
    after = after[np.isfinite(after)]
    usual = np.median(after) if len(after) else 0.0
    return bool(jump > _ITS_SHARE * way_m and jump > 2 * usual)
