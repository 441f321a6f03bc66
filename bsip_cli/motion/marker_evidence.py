"""Markers that jump, slip, exchange labels or sit wrong, as the residuals of one trial show them.

Every limit is a multiple of one of three scales: what a marker is trusted to in the inverse
kinematics, skin motion included (``marker_sd_m`` over the root of its weight); the noise of the
recording; and the spread of the marker's own residual in its segment. What is found:

swap (marker_exchange.py)
    Both markers lie at least twice as near to the other's place in the model as to their own, or
    the line between them reverses from one frame to the next; or both arms
    (legs) fit twice as well exchanged; or the markers of a segment lie on their places in another
    order. Where all markers involved then lie nearer to the model,
    the labels are corrected and the poses fitted again before the rest is judged; else they stay
    as recorded.
jump
    The residual leaves its running median for less than a quarter second and comes back.
slip
    The mean residual goes to another level and stays there, the joint angles do not explain it, and
    the distances to the segment's other markers show it.
offset
    The median residual of the whole trial is far beyond the spread, how far the marker strays in
    other trials, and that of the others.

A marker that slips or sits wrong drags the pose, and its neighbours' residuals with it. The
linear response of the fit shows which marker explains the residuals of all; only that one is
reported, with the distance it moved by on its segment and not the smaller residual it leaves.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.ndimage import median_filter

from bsip_cli.motion.marker_events import (
    LevelChange,
    MarkerEvent,
    event,
    find_level_change,
    offsets,
    pieces,
    two_levels,
)
from bsip_cli.motion.marker_exchange import Labelling, Refit, exchanged, relabelled
from bsip_cli.motion.marker_fit import BEYOND, MEDIAN_LENGTH, MarkerFit

# --- markers that leave their place for a moment: ghosts, flickers, badly filled gaps -------------


_WINDOW_S = 0.5  # of the running median: a jump lasts at most half of it
_JUMP = 8.0  # spreads
_LEAST_FRAMES = 5
_SAME = 0.7  # a jump that another one explains to 30 % is the pose's


_Jump = tuple[int, slice]  # marker and frames


def jumps(
    fit: MarkerFit, residual: np.ndarray, filled: np.ndarray
) -> tuple[list[MarkerEvent], np.ndarray]:
    """Events, and (N, m) frames in which a marker is astray.

    A jump exceeds ``_JUMP`` spreads of the marker about its running median, of all markers in the
    same frame (at an impact all shake), and of the noise; half of it comes or goes within two
    frames, and the measured path shows it.
    """
    longest, away = round(0.5 * _WINDOW_S / fit.step_s()), np.full(residual.shape, np.nan)
    width = 2 * max(2, longest) + 1  # of the running median over the visible frames
    for m in range(residual.shape[1]):
        seen = np.flatnonzero(np.isfinite(residual[:, m, 0]))
        if len(seen) >= _LEAST_FRAMES:
            window = min(width, len(seen) | 1)
            for axis in range(residual.shape[2]):  # one-dimensional, it costs a tenth
                own = residual[seen, m, axis]
                away[seen, m, axis] = own - median_filter(own, size=window, mode="nearest")
    distance = np.linalg.norm(away, axis=2)
    astray = np.zeros(distance.shape, dtype=bool)
    if not np.isfinite(distance).any():
        return [], astray
    own = _median(distance, 0) / MEDIAN_LENGTH
    frame = _median(distance, 1) / MEDIAN_LENGTH
    spread = np.maximum(np.maximum(own, frame), fit.noise_m())
    with np.errstate(invalid="ignore"):
        beyond = distance > np.maximum(_JUMP * spread, BEYOND * fit.trusted_m)
    found = []
    for m in range(len(fit.labels)):
        for piece in pieces(beyond[:, m], ~np.isfinite(distance[:, m]), 2):
            if piece.stop - piece.start <= longest and _is_own(fit, m, piece, distance[:, m]):
                found.append((m, piece))
                astray[piece, m] = True
    events = []
    for (m, piece), size in _own(fit, away, spread, found):
        note = ", where a gap was filled" if filled[piece, m].mean() > 0.5 else ""
        statistic = float(np.nanmax(distance[piece, m]) / spread[piece, m].max())
        events.append(event(fit, "jump", m, piece, size, statistic, note=note))
    return events, astray


def _own(
    fit: MarkerFit, away: np.ndarray, spread: np.ndarray, found: list[_Jump]
) -> list[tuple[_Jump, float]]:
    """The jumps without those that another one at the same time drags along, and their sizes."""
    distance = np.linalg.norm(away, axis=2)
    left = sorted(found, key=lambda one: -float(np.nanmax(distance[one[1], one[0]])))
    own: list[tuple[_Jump, float]] = []
    while left:
        first, frames = left[0]
        begin, end = frames.start - 1, frames.stop + 1
        together = [x for x in left if x is left[0] or (x[1].start < end and begin < x[1].stop)]
        peak = frames.start + int(np.nanargmax(distance[frames, first]))
        sd = np.hypot(spread[peak], 0.1 * distance[peak, first])
        candidates = [m for m, _ in together if np.isfinite(distance[peak, m])]
        m, vector, made = fit.source_of(away[peak], sd, candidates)
        missed = np.linalg.norm(away[peak] - made, axis=1)
        source = next(one for one in together if one[0] == m)
        size = max(float(np.linalg.norm(vector)), float(np.nanmax(distance[source[1], m])))
        own.append((source, size))
        dragged = [x for x in together if not missed[x[0]] > _SAME * distance[peak, x[0]]]
        left = [one for one in left if one is not source and one not in dragged]
    return own


def _median(distance: np.ndarray, axis: int) -> np.ndarray:
    """Along an axis, which stays; 0 where nothing is known."""
    seen = np.isfinite(distance).any(axis=axis, keepdims=True)
    return np.nanmedian(np.where(seen, distance, 0.0), axis=axis, keepdims=True)


def _is_own(fit: MarkerFit, m: int, piece: slice, distance: np.ndarray) -> bool:
    """Half of the jump comes or goes within two frames, and the measured path shows it.

    The path is compared with the straight line through the two frames before: a pose that another
    marker bends leaves it smooth.
    """
    seen = np.flatnonzero(np.isfinite(fit.measured_m[:, m, 0]))
    path, model = fit.measured_m[seen, m], fit.model_m[seen, m]
    first, last = np.searchsorted(seen, [piece.start, piece.stop - 1])
    half = 0.5 * float(np.nanmax(distance[piece]))
    for edge, back in ((first, -1), (last, 1)):
        before, earlier = edge + back, edge + 2 * back
        if min(before, earlier) < 0 or max(before, earlier) >= len(seen):
            continue
        for k in {edge, min(max(edge - back, first), last)}:
            step = (path[k] - model[k]) - (path[before] - model[before])
            length = float(np.linalg.norm(step))
            straight = path[before] + (path[before] - path[earlier]) * abs(k - before)
            if length > half and (path[k] - straight) @ step > 0.5 * length**2:
                return True
    return False


# --- markers that change their place on the segment and stay there --------------------------------


_BLOCK_S = 0.1  # residuals are averaged over blocks
_MOST_BLOCKS = 600  # longer ones in longer trials
_STAYS_S = 0.5  # on each side of a slip
_SLIP = 3.0  # spreads of what pose and step leave unexplained
# A normal vector of three directions is this long once in 3e7 draws: 40 markers at 600 places give
# one false positive in a thousand trials, were the errors as the model says.
_CHANCE = 6.0
# Skin travels over the bone by some 15 mm in half a radian; a slip moves the pose too, by far less
# for its size, and may not hide behind that.
_SKIN_M_PER_RAD = 0.03
_SAME_SHARE = 0.7  # a change that is explained to 30 % by a slip at the same time is no second one
_LEAST_RESPONSE = 0.003  # what follows a slip by less says nothing of it
_MOST = 12


class _Slip(NamedTuple):
    m: int
    frame: int
    vector: np.ndarray
    z: float


class _Search:
    """The residuals that are left, in blocks, and the best change of level of each marker."""

    def __init__(self, fit: MarkerFit, residual: np.ndarray) -> None:
        self.fit, self.left = fit, residual.copy()
        frames, most = round(_BLOCK_S / fit.step_s()), len(residual) // _MOST_BLOCKS
        self.frames = max(1, frames, most)
        self.least = max(3, round(_STAYS_S / (self.frames * fit.step_s())))
        self.columns = {}  # by segment
        for k in np.unique(fit.person.marker_segments).tolist():
            x = fit.angles_about(k)
            both = np.concatenate([x, (x - np.mean(x, axis=0)) ** 2], axis=1)
            self.columns[k] = block_means(both, self.frames)
        self.means = block_means(self.left, self.frames)
        self.best: dict[int, LevelChange | None] = {}

    def changes(self) -> dict[int, LevelChange]:
        """The changes that are slips, by marker, each at its block."""
        for m in range(len(self.fit.labels)):
            if m not in self.best:
                self.best[m] = self._change(m, self.least)
        return {
            m: one
            for m, one in self.best.items()
            if one and one.z > _CHANCE
            # the pose takes its part
            if np.linalg.norm(one.step) > 0.5 * BEYOND * self.fit.trusted_m[m]
            if np.linalg.norm(one.step) > _SLIP * one.spread
        }

    def _change(self, m: int, least: int, block: int | None = None) -> LevelChange | None:
        seen = np.flatnonzero(np.isfinite(self.means[:, m, 0]))
        at = None if block is None else int(np.searchsorted(seen, block))
        if len(seen) < 2 * least:
            return None
        columns = self.columns[self.fit.person.marker_segments[m]][seen]
        found = find_level_change(self.means[seen, m], columns, _SKIN_M_PER_RAD, least, at)
        return replace(found, at=int(seen[found.at])) if found else None

    def source(self, first: int, changes: dict[int, LevelChange]) -> tuple[_Slip, np.ndarray]:
        """Whose slip makes the strongest change, and the change it makes of all (m, 3)."""
        fit, strongest = self.fit, changes[first]
        field, sd = np.full((len(fit.labels), 3), np.nan), np.full(len(fit.labels), np.nan)
        near = {m: f for m, f in changes.items() if abs(f.at - strongest.at) <= self.least}
        reach = np.abs(fit.response[:, :, list(near)]).max(axis=(1, 2, 3))
        for k in np.flatnonzero(reach > _LEAST_RESPONSE):
            found = self._change(int(k), 1, strongest.at)
            if found:
                field[k], sd[k] = found.step, found.step_sd
        near = {m: f for m, f in near.items() if np.isfinite(sd[m])} or {first: strongest}
        field[first], sd[first] = strongest.step, strongest.step_sd
        sd = np.hypot(sd, 0.1 * np.linalg.norm(strongest.step))
        m, vector, made = fit.source_of(field, sd, list(near))
        frame = self._frame(m, near[m])
        left = np.linalg.norm(field - made, axis=1)
        same = left < _SAME_SHARE * np.linalg.norm(field, axis=1)
        same[m] = True
        return _Slip(m, frame, vector, near[m].z), np.where(same[:, None], field, made)

    def take(self, slip: _Slip, made: np.ndarray) -> None:
        """Take a slip out of the residuals."""
        self.left[slip.frame :] -= made
        self.means = block_means(self.left, self.frames)
        moved = np.linalg.norm(made, axis=1) > 0.1 * self.fit.trusted_m
        self.best = {k: f for k, f in self.best.items() if not moved[k]}

    def is_shown_by_distances(self, slip: _Slip) -> bool:
        """Whether the distances to the segment's other markers change as the slip says."""
        columns, longer = self.columns[self.fit.person.marker_segments[slip.m]], {}
        for other in self.fit.neighbours(slip.m):
            apart = block_means(self.fit.apart_m(slip.m, other)[:, None], self.frames)
            seen = np.isfinite(apart[:, 0])
            at = int(seen[: slip.frame // self.frames].sum())
            found = find_level_change(apart[seen], columns[seen], _SKIN_M_PER_RAD, 1, at)
            if found:
                longer[other] = float(found.step[0]), found.step_sd
        return self.fit.is_shown(slip.m, slip.vector, longer)

    def _frame(self, m: int, found: LevelChange) -> int:
        """First frame at the new level: the split near the block with the least squares."""
        step, middle = found.step, found.at * self.frames
        along = self.left[:, m] @ step / (step @ step)
        near = np.arange(middle - 2 * self.frames, middle + 2 * self.frames + 1)
        near = near[(near > 0) & (near < len(along))]
        near = near[np.isfinite(along[near])]
        if len(near) < 3:
            return middle
        return int(near[two_levels(along[near][:, None], 1, 1)])


def slips(fit: MarkerFit, residual: np.ndarray) -> tuple[list[MarkerEvent], np.ndarray]:
    """Events, and the residual as it would be without the slips: at the level of the start.

    A change of level is searched for in what the joint angles about the segment (and their
    squares) do not explain, since skin follows them; the strongest is traced to the marker that
    explains the changes of all, and taken out; and so on.
    """
    search, found, others = _Search(fit, residual), list[_Slip](), list[_Slip]()
    for _ in range(_MOST):
        changes = search.changes()
        if not changes:
            break
        slip, made = search.source(max(changes, key=lambda m: changes[m].z), changes)
        search.take(slip, made)
        if np.linalg.norm(slip.vector) > BEYOND * fit.trusted_m[slip.m]:
            (found if search.is_shown_by_distances(slip) else others).append(slip)
    # what moves where something else changes at that time is skin, not a tape that gives way
    near = _STAYS_S / fit.step_s()
    found = [one for one in found if all(abs(one.frame - x.frame) > near for x in others)]
    return _events(fit, found, search.frames), search.left


def _events(fit: MarkerFit, found: list[_Slip], least: int) -> list[MarkerEvent]:
    """Slips; one that a later one undoes is a long jump, and what is left of a marker within fewer
    than ``least`` frames is one slip, found in parts."""
    events, slips, waiting = [], list[_Slip](), sorted(found, key=lambda one: one.frame)
    while waiting:
        slip = waiting.pop(0)
        size = float(np.linalg.norm(slip.vector))
        sums = ((k, one.m, slip.vector + one.vector) for k, one in enumerate(waiting))
        if back := [k for k, m, sum_ in sums if m == slip.m and np.linalg.norm(sum_) < 0.5 * size]:
            frames = slice(slip.frame, waiting.pop(back[0]).frame)
            if frames.start < frames.stop:  # else nothing has happened
                events.append(event(fit, "jump", slip.m, frames, size, slip.z))
            continue
        for k, one in enumerate(slips):
            if one.m == slip.m and slip.frame - one.frame < least:
                surest = max(slips.pop(k), slip, key=lambda x: x.z)
                slip = surest._replace(vector=one.vector + slip.vector)
                break
        slips.append(slip)
    for slip in slips:
        frames, size = slice(slip.frame, len(fit.times_s)), float(np.linalg.norm(slip.vector))
        events.append(event(fit, "slip", slip.m, frames, size, slip.z))
    return events


def block_means(x: np.ndarray, frames: int) -> np.ndarray:
    """Means of (N, ...) over blocks of frames, NaN where half of a block is missing."""
    count = len(x) // frames
    cut = x[: count * frames].reshape(count, frames, *x.shape[1:])
    seen = np.isfinite(cut)
    number = seen.sum(axis=1)
    total = np.where(seen, cut, 0.0).sum(axis=1)
    return np.where(2 * number >= frames, total / np.maximum(number, 1), np.nan)


@dataclass(frozen=True, eq=False)
class Evidence:
    """What is wrong with the markers of one trial.

    events : in the order of time.
    markers_m : (N, m, 3) the markers with exchanged labels corrected.
    """

    events: tuple[MarkerEvent, ...]
    markers_m: np.ndarray

    def any_corrected(self) -> bool:
        """Some labels were exchanged back."""
        return any(one.put_right for one in self.events)


def marker_evidence(fit: MarkerFit, refit: Refit, filled: np.ndarray) -> Evidence:
    """All events of one trial, and the markers without its swaps.

    refit : poses fitted to other markers (n, m, 3) at times (n,); called only where labels may be
        exchanged.
    filled : (N, m) positions that were estimated over a gap: they may jump, but are no evidence
        of slips and offsets.
    """
    labelling = relabelled(Labelling(fit, refit))
    fit = labelling.fit
    guessed = exchanged(filled, labelling.order)
    jumped, astray = jumps(fit, fit.residual_m, guessed)
    residual = np.where((astray | guessed)[..., None], np.nan, fit.residual_m)
    slipped, level = slips(fit, residual)
    events = [*labelling.events, *jumped, *slipped, *offsets(fit, level)]
    events.sort(key=lambda one: (one.start_s, one.kind, -one.size_m))
    return Evidence(tuple(events), fit.measured_m)
