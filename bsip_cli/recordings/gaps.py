"""Gaps in marker trajectories: found where a position only repeats the last one, and filled from
the rigid segment, short ones else by a spline."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from bsip_cli.body.person import rigid_motion
from bsip_cli.recordings.analog import runs
from bsip_cli.recordings.model import Finding, Recording

_LEAST_OTHERS = 3
_THIN_M = 0.005  # a cluster narrower than this across its long axis has no orientation
_LOOSE_M = 0.01  # a cluster that changes shape by more is not rigid
_ROUNDING_S = 1e-9
_SUPPORT = 8  # frames used on each side by the spline

_SPANS_SHOWN = 5
# Of frames that repeat the one before:
_NEARLY_ALL = 0.9  # of the markers seen in both frames
_LEAST_MARKERS = 4
_MOVED_M = 1e-4  # median step of the markers beside the repeats: still ones may be quantised
# Of single markers that are held:
_LEAST_FRAMES = 3  # two alike are no sign
_NEIGHBOURS = 3
_CLEARLY_M = 5e-3  # the neighbours' way during a hold: more than soft tissue of a still limb
_DIGITS = 5.0  # as many sizes of the last digit: a marker that is still moves within one
_ITS_SHARE = 0.3  # of the neighbours' way: what it has to make up afterwards
_FINE_M = 1e-5  # no camera's noise is smaller: a marker at rest does not repeat itself
_RARELY = 0.01  # of a marker's steps are none, outside the hold


# --- filled ---------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class FilledMarkers:
    """Positions with short gaps filled, and which of them are not measured."""

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
    markers that move as one rigid body; of several that have a marker the largest counts. Only
    measured positions are used to fill; longer gaps and the ends stay NaN.
    """
    measured = np.isfinite(markers_m).all(axis=-1)
    result = np.where(measured[..., None], markers_m, np.nan)
    rigid = np.zeros_like(measured)
    for marker in range(markers_m.shape[1]):
        own = [[m for m in segment if m != marker] for segment in segments if marker in segment]
        mates = max(own, key=len, default=[])
        for start, stop in runs(~measured[:, marker]).tolist():
            if start == 0 or stop == len(measured):
                continue
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


def _from_segment(
    markers_m: np.ndarray,
    measured: np.ndarray,
    marker: int,
    mates: Sequence[int],
    start: int,
    stop: int,
) -> np.ndarray | None:
    """Positions (n_gap, 3) carried by the mates from both rims of the gap, cross-faded; None where
    they are few, nearly on a line, or change their shape."""
    frames = slice(start - 1, stop + 1)
    seen = [m for m in mates if measured[frames, m].all()]
    if len(seen) < _LEAST_OTHERS:
        return None
    cluster = markers_m[frames][:, seen]  # (n, k, 3)
    first = cluster[0] - cluster[0].mean(axis=0)
    spread = np.linalg.svd(first, compute_uv=False) / np.sqrt(len(first))
    sizes = np.linalg.norm(cluster[:, :, None] - cluster[:, None], axis=-1)
    if spread[1] <= _THIN_M or np.ptp(sizes, axis=0).max() >= _LOOSE_M:
        return None
    carried = []
    for anchor, rim in ((0, start - 1), (-1, stop)):
        turn, shift = rigid_motion(cluster[anchor], cluster)
        carried.append(turn @ markers_m[rim, marker] + shift)
    share = np.linspace(0, 1, len(cluster))[:, None]
    return ((1 - share) * carried[0] + share * carried[1])[1:-1]


def _by_spline(track: np.ndarray, measured: np.ndarray, start: int, stop: int) -> np.ndarray:
    """Cubic spline through the nearest measured frames on both sides, (n_gap, 3)."""
    before = np.flatnonzero(measured[:start])[-_SUPPORT:]
    after = stop + np.flatnonzero(measured[stop:])[:_SUPPORT]
    known = np.concatenate([before[before >= start - 2 * _SUPPORT], after])
    known = known[known < stop + 2 * _SUPPORT]
    return CubicSpline(known, track[known])(np.arange(start, stop))


# --- lost, and filled with what was before --------------------------------------------------------


def without_repeats(recording: Recording) -> tuple[Recording, list[Finding]]:
    """The recording with repeated positions as gaps, and lines that say how many and when.

    Of all markers at once, and of single ones that are held while others move.
    """
    markers, findings = recording.markers_m, []
    repeated, action = repeated_frames(markers), "took them for gaps"
    if repeated.any():
        frames = np.any(repeated, axis=1)
        spans = _spans(recording, frames)
        found = f"{frames.sum()} of {len(frames)} frames repeat the one before to the last digit"
        expected = "a new picture in every frame of a person who moves"
        words = (f"{found}, at {spans}", expected, action)
        findings.append(Finding("repeated_frames", "", *words, "corrected"))
        markers = np.where(repeated[..., None], np.nan, markers)
    held = held_markers(markers)
    if held.any():
        own = np.flatnonzero(held.any(axis=0))
        names = [recording.labels[k] for k in own]
        told = [f"{recording.labels[k]} at {_spans(recording, held[:, k])}" for k in own]
        more = f" and {len(own) - _SPANS_SHOWN} more markers" if len(own) > _SPANS_SHOWN else ""
        found = (
            f"{held.sum()} positions repeat the last one to the last digit while the markers "
            f"around move: {'; '.join(told[:_SPANS_SHOWN])}{more}"
        )
        expected = "gaps where a marker was not seen"
        words = (found, expected, action)
        findings.append(Finding("held_markers", ", ".join(names), *words, "corrected"))
        markers = np.where(held[..., None], np.nan, markers)
    return (replace(recording, markers_m=markers) if findings else recording), findings


def _spans(recording: Recording, frames: np.ndarray) -> str:
    """When the frames are, in seconds."""
    spans, times = runs(frames), recording.time_s()
    ends = [(times[start], times[stop - 1]) for start, stop in spans[:_SPANS_SHOWN]]
    told = [f"{a:.2f}" if a == b else f"{a:.2f} to {b:.2f}" for a, b in ends]
    more = f" and {len(spans) - _SPANS_SHOWN} more times" if len(spans) > _SPANS_SHOWN else ""
    return f"{', '.join(told)} s{more}"


def repeated_frames(markers_m: np.ndarray) -> np.ndarray:
    """Which markers (n_frames, n_markers, 3) repeat their last position to the bit, bool.

    Only in frames in which nearly all do so at once, and only where nearly all moved clearly from
    the frame before the repeats and into the one after: quantised markers of a person who stands
    still repeat themselves too. At the ends of a trial one side is enough.
    """
    same = np.zeros(markers_m.shape[:2], bool)
    if len(markers_m) < 3:
        return same
    seen = np.isfinite(markers_m).all(axis=-1)
    both = seen[1:] & seen[:-1]
    same[1:] = (markers_m[1:] == markers_m[:-1]).all(axis=-1) & both
    nearly_all = _NEARLY_ALL * both.sum(axis=1)
    enough = both.sum(axis=1) >= _LEAST_MARKERS
    step = np.where(both, np.linalg.norm(np.diff(markers_m, axis=0), axis=-1), np.nan)
    moving, frozen = np.zeros((2, len(markers_m)), bool)
    frozen[1:] = enough & (same[1:].sum(axis=1) >= nearly_all)
    moving[1:] = enough & ((step > 0).sum(axis=1) >= nearly_all)
    moving[1:][enough] &= np.nanmedian(step[enough], axis=1) > _MOVED_M
    lost = np.zeros(len(markers_m), bool)
    for start, stop in runs(frozen):
        beside = [moving[frame] for frame in (start - 1, stop) if 0 < frame < len(moving)]
        lost[start:stop] = bool(beside) and all(beside)
    return same & lost[:, None]


def held_markers(markers_m: np.ndarray) -> np.ndarray:
    """Which positions (n_frames, n_markers, 3) only repeat a marker's last one, bool.

    A run of equal positions is a hold if the nearest other markers move on meanwhile, by clearly
    more than the last digit, and the marker then jumps after them. At the end of a trial there is
    no jump: there it counts where numbers are fine and the marker never repeats itself elsewhere.
    A foot on the ground in coarse numbers leaves its place by one digit, and is no hold.
    """
    held, same = np.zeros((2, *markers_m.shape[:2]), bool)
    if len(markers_m) <= _LEAST_FRAMES or markers_m.shape[1] <= _NEIGHBOURS:
        return held
    same[1:] = (markers_m[1:] == markers_m[:-1]).all(axis=-1)
    if not same.any():
        return held
    steps = np.abs(np.diff(markers_m[:2000], axis=0))
    digit_m = float(np.min(steps[steps > 0], initial=np.inf))  # the smallest step of a coordinate
    for marker in map(int, np.flatnonzero(same.any(axis=0))):
        still = runs(same[:, marker])
        neighbours = markers_m[:, _nearest(markers_m, marker)]
        for start, stop in still[np.diff(still, axis=1)[:, 0] >= _LEAST_FRAMES - 1]:
            last = min(stop, len(same) - 1)
            ways = np.linalg.norm(neighbours[last] - neighbours[start - 1], axis=-1)
            ways = ways[np.isfinite(ways)]
            way = float(np.median(ways)) if len(ways) > 1 else float("nan")
            if not way > max(_CLEARLY_M, _DIGITS * digit_m):
                continue
            if stop < len(same) and np.isfinite(markers_m[stop, marker]).all():
                is_hold = _jumps(markers_m[:, marker], stop, way)
            else:
                others = same[:, marker].sum() - (stop - start)
                is_hold = digit_m < _FINE_M and others < _RARELY * len(same)
            held[start:stop, marker] = is_hold
    return held


def _nearest(markers_m: np.ndarray, marker: int) -> np.ndarray:
    """The markers that are nearest throughout."""
    some = markers_m[:: max(1, len(markers_m) // 200)]
    distance = np.linalg.norm(some - some[:, marker, None], axis=-1)
    known = np.isfinite(distance)
    usual = np.where(known.any(axis=0), np.median(np.where(known, distance, 1e9), axis=0), 1e9)
    usual[marker] = np.inf
    return np.argsort(usual)[:_NEIGHBOURS]


def _jumps(marker_m: np.ndarray, stop: int, way_m: float) -> bool:
    """Whether the marker (n_frames, 3) leaves its place at once, not as it goes on."""
    jump = np.linalg.norm(marker_m[stop] - marker_m[stop - 1])
    after = np.linalg.norm(np.diff(marker_m[stop : stop + 4], axis=0), axis=-1)
    after = after[np.isfinite(after)]
    usual = np.median(after) if len(after) else 0.0
    return bool(jump > _ITS_SHARE * way_m and jump > 2 * usual)
