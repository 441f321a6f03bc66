"""Numbers that stand for a missing point: -16512, 9999999, 0 0 0 and their like."""

from __future__ import annotations

import numpy as np

from bsip_cli.recordings.model import Finding

_FRAMES_LOOKED_AT = 500
_FEWEST_MARKERS = 4  # that make a volume
_TOLD = 3


def without_sentinels(positions: np.ndarray) -> list[Finding]:
    """Turn positions that only say that a point is missing into NaN (in place), and say so.

    ``positions`` (n_frames, n_markers, 3) in any unit, NaN = missing. Such a position lies further
    outside the box of all others than that box is wide, and has three equal coordinates, or is to
    the bit that of another marker too: no two markers are at one place.
    """
    far = _outside(positions)
    frames, markers = np.nonzero(far)
    if not len(frames):
        return []
    places, which = np.unique(positions[far], axis=0, return_inverse=True)
    which = which.reshape(-1)
    alike = (places == places[:, :1]).all(axis=1)
    owners = np.unique(np.column_stack([which, markers]), axis=0)[:, 0]
    shared = np.bincount(owners, minlength=len(places)) > 1
    is_none = (alike | shared)[which]
    if not is_none.any():
        return []
    positions[frames[is_none], markers[is_none]] = np.nan
    counts = np.bincount(which[is_none], minlength=len(places))
    often = np.argsort(-counts, kind="stable")[:_TOLD]
    told = " and ".join(f"({', '.join(f'{x:.7g}' for x in places[k])})" for k in often if counts[k])
    more = ", and others" if (counts > 0).sum() > _TOLD else ""
    return [
        Finding(
            check="points",
            subject="",
            found=f"{is_none.sum()} positions of {len(np.unique(markers[is_none]))} markers are "
            f"{told}{more}: no place, but the sign for a missing point",
            expected="a gap",
            action="took them for gaps",
            level="corrected",
        )
    ]


def _outside(positions: np.ndarray) -> np.ndarray:
    """Positions (n_frames, n_markers) further from the box of the others than it is wide."""
    some = positions[:: max(1, len(positions) // _FRAMES_LOOKED_AT)]
    marker = np.broadcast_to(np.arange(some.shape[1]), some.shape[:2]).ravel()
    some = some.reshape(-1, 3)
    known = np.isfinite(some).all(axis=1) & (some != some[:, :1]).any(axis=1)
    some, marker = some[known], marker[known]
    _, which, counts = np.unique(some, axis=0, return_inverse=True, return_counts=True)
    which = which.reshape(-1)
    twice = np.flatnonzero(counts[which] > 1)
    pairs = np.unique(np.column_stack([which[twice], marker[twice]]), axis=0)[:, 0]
    shared = np.bincount(pairs, minlength=len(counts)) > 1
    seen = ~shared[which]
    some, n_seen = some[seen], len(np.unique(marker[seen]))
    if n_seen < _FEWEST_MARKERS:
        return np.zeros(positions.shape[:2], bool)
    low, high = np.percentile(some, [0.5, 99.5], axis=0)
    width = (high - low).max()
    with np.errstate(invalid="ignore"):
        return ((positions < low - width) | (positions > high + width)).any(axis=-1)
