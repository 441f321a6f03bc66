"""Gaps in marker trajectories: positions that stand for a missing point, that no marker on the body
can have, or that repeat the last one; filled from the rigid segment, else by a spline."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from bsip_cli.body.person import rigid_motion
from bsip_cli.recordings.analog import runs
from bsip_cli.recordings.model import Finding, Recording

LARGEST_LAB_M = 100.0


# --- -16512, 9999999, 0 0 0 and their like --------------------------------------------------------

_FEWEST_MARKERS = 4  # that make a volume
_FRAMES_LOOKED_AT = 500
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
    places, which, shared = _places(positions[far], markers)
    is_none = ((places == places[:, :1]).all(axis=1) | shared)[which]
    if not is_none.any():
        return []
    positions[frames[is_none], markers[is_none]] = np.nan
    counts = np.bincount(which[is_none], minlength=len(places))
    often = np.argsort(-counts, kind="stable")[:_TOLD]
    told = " and ".join(f"({', '.join(f'{x:.7g}' for x in places[k])})" for k in often if counts[k])
    more = ", and others" if (counts > 0).sum() > _TOLD else ""
    found = (
        f"{is_none.sum()} positions of {len(np.unique(markers[is_none]))} markers are "
        f"{told}{more}: no place, but the sign for a missing point"
    )
    return [Finding("points", "", found, "a gap", "took them for gaps", "corrected")]


def _outside(positions: np.ndarray) -> np.ndarray:
    """Positions (n_frames, n_markers) further from the box of the others than it is wide."""
    some = positions[:: max(1, len(positions) // _FRAMES_LOOKED_AT)]
    marker = np.broadcast_to(np.arange(some.shape[1]), some.shape[:2]).ravel()
    some = some.reshape(-1, 3)
    known = np.isfinite(some).all(axis=1) & (some != some[:, :1]).any(axis=1)
    some, marker = some[known], marker[known]
    _, which, shared = _places(some, marker)
    alone = ~shared[which]
    if len(np.unique(marker[alone])) < _FEWEST_MARKERS:
        return np.zeros(positions.shape[:2], bool)
    low, high = np.percentile(some[alone], [0.5, 99.5], axis=0)
    width = (high - low).max()
    with np.errstate(invalid="ignore"):
        return ((positions < low - width) | (positions > high + width)).any(axis=-1)


def _places(points: np.ndarray, marker: np.ndarray) -> tuple[np.ndarray, ...]:
    """Places (p, 3) among points (n, 3) of markers (n,), each point's, and whether several markers
    share each."""
    places, which = np.unique(points, axis=0, return_inverse=True)
    which = which.reshape(-1)
    owners = np.unique(np.column_stack([which, marker]), axis=0)[:, 0]
    return places, which, np.bincount(owners, minlength=len(places)) > 1


# --- where no marker on the body can be -----------------------------------------------------------

# Gaps that a program filled with zeros and then low-pass filtered, points of something else. Skin
# shifts a marker on its bone by up to 40 mm (Leardini et al. 2005, Gait & Posture 21:212), so that
# two markers of one bone come at most twice that nearer or further. Nothing is found in the public
# recordings of `benchmarks.every_recording`.
_SKIN_M = 0.04
_PAIR_M = 2 * _SKIN_M
_MATES = 8  # the nearest; of all others some are as far as usual by chance
_BY_CHANCE = 0.1  # of these: twice the shift of skin, of distances that spread over 0.8 m
_USUALLY = 0.2, 0.5, 0.8  # of the poses: who is off the body more often has no mates
_MOVES = 0.8  # of the markers move less than the one by which poses are chosen: two limbs may rest
_POSES, _FRAMES = 100, 1000
_AT_REST_M = 1e-6  # of a way, so that where nothing moves poses are even in time
_MOST_MARKERS = 400  # more are not a person's
_PLATEAU = 0.9  # of the furthest


def without_absurd(positions_m: np.ndarray) -> list[Finding]:
    """Turn positions (n_frames, n_markers, 3) beyond any laboratory, and those where no marker on
    the body can be, into missing ones (in place), and say so."""
    absurd = ((positions_m > LARGEST_LAB_M) | (positions_m < -LARGEST_LAB_M)).any(axis=-1)
    positions_m[absurd] = np.nan
    found = f"{int(absurd.sum())} positions more than {LARGEST_LAB_M:g} m away"
    expected, action = "markers in a laboratory", "took them as missing"
    about = Finding("points", "", found, expected, action, "warning")
    findings = [about] if absurd.any() else []
    off, furthest_m = off_the_body(positions_m)
    if off.any():
        positions_m[off] = np.nan
        found = (
            f"{off.sum()} positions of {off.any(axis=0).sum()} markers have other distances from "
        )
        found += f"the markers around than the body lets them have, by up to {furthest_m:.2f} m"
        expected = f"changes by {1e3 * _PAIR_M:.0f} mm at most, as of skin on bones"
        action = "took them for gaps; gaps that are filled with zeros and filtered look so: export "
        action += "the trial with its gaps"
        findings.append(Finding("points", "", found, expected, action, "corrected"))
    return findings


def off_the_body(positions_m: np.ndarray) -> tuple[np.ndarray, float]:
    """Which positions (n_frames, n_markers, 3) are not on the body that the others are on, bool,
    and by how much distances change there at most [m].

    A marker is off the body where its distances from all its mates have changed by more than skin
    makes of a pair, and some of these mates hold to each other; and around that, as long as most
    have changed by more than its own skin makes, and for as long as a filter rings, alike on either
    side: as it rises or falls, whichever is shorter.
    """
    off, furthest_m = np.zeros(positions_m.shape[:2], bool), 0.0
    if len(positions_m) < 3 or not 2 < positions_m.shape[1] <= _MOST_MARKERS:
        return off, furthest_m
    some = positions_m[_poses(positions_m)]
    body = [_Mates.of(some, k) for k in range(positions_m.shape[1])]
    surely, before = np.zeros_like(off), -1
    while (now := int(surely.sum())) > before:
        surely = np.stack([mates.are_left(positions_m, body, surely) for mates in body], axis=1)
        before = now
    surely &= ~_exchanged(surely, positions_m, body)
    for k in np.flatnonzero(surely.any(axis=0)).tolist():
        change = body[k].change_m(positions_m)[:, :_MATES]
        seen = np.isfinite(change)
        size = np.sort(np.where(seen, change, 0.0), axis=1)[:, change.shape[1] // 2]
        mostly = (change > _SKIN_M).sum(axis=1) > seen.sum(axis=1) / 2
        for start, stop in runs(surely[:, k] | mostly).tolist():
            if not surely[start:stop, k].any():
                continue
            plateau = np.flatnonzero(size[start:stop] >= _PLATEAU * size[start:stop].max())
            rings = min(plateau[0], stop - 1 - start - plateau[-1])
            off[max(0, start - rings) : stop + rings, k] = True
            furthest_m = max(furthest_m, float(size[start:stop].max()))
    return off & np.isfinite(positions_m).all(axis=-1), furthest_m


def _poses(positions_m: np.ndarray) -> np.ndarray:
    """Frames evenly along the way that markers go, not in time: a long quiet stance does not show
    what hangs together."""
    step = max(1, len(positions_m) // _FRAMES)
    ways = np.linalg.norm(np.diff(positions_m[::step], axis=0), axis=-1)
    way = np.sort(np.nan_to_num(ways), axis=1)[:, int(_MOVES * ways.shape[1])]
    gone = np.concatenate([[0.0], np.cumsum(way + _AT_REST_M)])
    return step * np.searchsorted(gone, np.linspace(0.0, gone[-1], _POSES))


@dataclass(frozen=True, eq=False)
class _Mates:
    """Columns (k,) of the markers whose distances from one stay what they are but for skin, the
    nearest first, and these distances (k,)."""

    marker: int
    columns: np.ndarray
    usual_m: np.ndarray

    @classmethod
    def of(cls, some_m: np.ndarray, marker: int) -> _Mates:
        ways = np.sort(np.linalg.norm(some_m - some_m[:, [marker]], axis=-1), axis=0)  # NaN last
        count = np.isfinite(ways).sum(axis=0)
        places = (np.minimum((share * count).astype(int), len(ways) - 1) for share in _USUALLY)
        low, usual, high = (np.take_along_axis(ways, at[None], axis=0)[0] for at in places)
        is_mate = (high - low < _SKIN_M) & (2 * count > len(ways))
        is_mate[marker] = False
        columns = np.flatnonzero(is_mate)
        columns = columns[np.argsort(usual[columns], kind="stable")]
        return cls(marker, columns, usual[columns])

    def change_m(self, positions_m: np.ndarray, of: int | None = None) -> np.ndarray:
        """How far the distances (n_frames, k) from the marker, or from another one in its place,
        are from the usual ones; NaN where one is not seen."""
        own = positions_m[:, [self.marker if of is None else of]]
        ways = np.linalg.norm(positions_m[:, self.columns] - own, axis=-1)
        return np.asarray(np.abs(ways - self.usual_m))

    def are_left(
        self, positions_m: np.ndarray, body: Sequence[_Mates], off: np.ndarray
    ) -> np.ndarray:
        """Whether the marker is none of theirs, (n_frames,) bool, but for mates that are ``off``
        (n_frames, n_markers) the body too."""
        first = replace(self, columns=self.columns[:_MATES], usual_m=self.usual_m[:_MATES])
        near = first.change_m(positions_m) <= _PAIR_M
        left = ~(near & ~off[:, first.columns]).any(axis=1)
        left &= np.isfinite(positions_m[:, self.marker]).all(axis=1)
        for n in np.flatnonzero(left).tolist():  # few, so that only there all mates are asked
            change = self.change_m(positions_m[[n]])[0]
            others = self.columns[change > _PAIR_M].tolist()
            hold = ((change <= _SKIN_M) & ~off[n, self.columns])[_MATES:]
            left[n] = hold.sum() <= _BY_CHANCE * len(hold) and len(others) > 1
            left[n] &= any(body[one].holds_to(others, positions_m[n]) for one in others)
        return left

    def holds_to(self, others: Sequence[int], places_m: np.ndarray) -> bool:
        """Whether it is as far as usual from one of them, in ``places_m`` (n_markers, 3)."""
        change = self.change_m(places_m[None])[0][np.isin(self.columns, others)]
        return bool((change <= _PAIR_M).any())


def _exchanged(off: np.ndarray, positions_m: np.ndarray, body: Sequence[_Mates]) -> np.ndarray:
    """Where a marker is at the place of another that is off its own or not seen: a label on the
    wrong marker, (n_frames, n_markers) bool."""
    found, empty = np.zeros_like(off), off | np.isnan(positions_m).any(axis=-1)
    for k in np.flatnonzero(off.any(axis=0)).tolist():
        frames = np.flatnonzero(off[:, k])
        for mates in body:
            fits = mates.change_m(positions_m[frames], of=k) <= _PAIR_M
            fits &= ~off[np.ix_(frames, mates.columns)]
            is_there = empty[frames, mates.marker] & (fits.sum(axis=1) > 1)
            found[frames, k] |= is_there & (mates.marker != k)
    return found


# --- lost, and filled with what was before --------------------------------------------------------

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
_MOSTLY = 0.5  # of the time
_RARELY = 0.01  # of a marker's steps are none, outside the hold


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

    A run of equal positions is a hold if the nearest other markers, or all where it lasts most of
    the trial, move on meanwhile, by clearly more than the last digit, and the marker then jumps
    after them. At the end of a trial there is no jump: there it counts where numbers are fine and
    the marker never repeats itself elsewhere. A foot on the ground in coarse numbers leaves its
    place by one digit, and is no hold.
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
        nearest = _nearest(markers_m, marker)
        for start, stop in still[np.diff(still, axis=1)[:, 0] >= _LEAST_FRAMES - 1]:
            # Who is held all through has no neighbours: the body moves away from it.
            is_long = stop - start > _MOSTLY * len(same)
            others = same.mean(axis=0) < _MOSTLY if is_long else nearest
            ways = _ways(markers_m[start - 1 : stop + 1, others])
            way = float(np.median(ways)) if len(ways) > 1 else float("nan")
            if not way > max(_CLEARLY_M, _DIGITS * digit_m):
                continue
            if stop < len(same) and np.isfinite(markers_m[stop, marker]).all():
                is_hold = _jumps(markers_m[:, marker], stop, way)
            else:
                rest = same[:, marker].sum() - (stop - start)
                is_hold = digit_m < _FINE_M and rest < _RARELY * len(same)
            held[start:stop, marker] = is_hold
    return held


def _ways(markers_m: np.ndarray) -> np.ndarray:
    """How far each marker (n_frames, k, 3) that is seen twice comes from where it is seen first to
    where it is seen last, (up to k,)."""
    seen = np.isfinite(markers_m).all(axis=-1)
    some = np.flatnonzero(seen.sum(axis=0) > 1)
    first, last = seen.argmax(axis=0), len(seen) - 1 - seen[::-1].argmax(axis=0)
    return np.linalg.norm(markers_m[last[some], some] - markers_m[first[some], some], axis=-1)


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


# --- filled ---------------------------------------------------------------------------------------

_LEAST_OTHERS = 3
_THIN_M = 0.005  # a cluster narrower than this across its long axis has no orientation
_LOOSE_M = 0.01  # a cluster that changes shape by more is not rigid
_ROUNDING_S = 1e-9
_SUPPORT = 8  # frames used on each side by the spline


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
