"""Positions where no marker on the body can be: gaps that a program filled with zeros and then
low-pass filtered, points of something else.

Skin shifts a marker on its bone by up to 40 mm (Leardini et al. 2005, Gait & Posture 21:212), so
that two markers of one bone come at most twice that nearer or further. Nothing is found in the
public recordings of `benchmarks.every_recording`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bsip_cli.recordings.analog import runs
from bsip_cli.recordings.model import Finding

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


def without_foreign_places(positions_m: np.ndarray) -> list[Finding]:
    """Turn positions (n_frames, n_markers, 3) that are not on the body into missing ones (in
    place), and say so."""
    off, furthest_m = off_the_body(positions_m)
    if not off.any():
        return []
    positions_m[off] = np.nan
    found = f"{off.sum()} positions of {off.any(axis=0).sum()} markers have other distances from "
    found += f"the markers around than the body lets them have, by up to {furthest_m:.2f} m"
    expected = f"changes by {1e3 * _PAIR_M:.0f} mm at most, as of skin on bones"
    action = "took them for gaps; gaps that are filled with zeros and filtered look so: export the "
    action += "trial with its gaps"
    return [Finding("points", "", found, expected, action, "corrected")]


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
