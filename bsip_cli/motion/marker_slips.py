"""Markers that change their place on the segment and stay there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bsip_cli.motion.level_change import LevelChange, find_level_change, two_levels
from bsip_cli.motion.marker_events import BEYOND, MarkerEvent, event
from bsip_cli.motion.marker_fit import MarkerFit, best_source

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
_SAME = 0.7  # a change that is explained to 30 % by a slip at the same time is no second one
_LEAST_RESPONSE = 0.003  # what follows a slip by less says nothing of it
_MOST = 12


@dataclass(frozen=True)
class _Found:
    """A change of level of marker ``m`` at a block."""

    m: int
    change: LevelChange
    block: int


@dataclass(frozen=True, eq=False)
class _Slip:
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
        self.columns = {
            name: block_means(_with_squares(x), self.frames) for name, x in fit.pose.items()
        }
        self.means = block_means(self.left, self.frames)
        self.best: dict[int, _Found | None] = {}

    def changes(self) -> list[_Found]:
        """The changes that are slips, of all markers."""
        for m in range(len(self.fit.labels)):
            if m not in self.best:
                self.best[m] = self._change(m, self.least)
        return [f for f in self.best.values() if f and _is_slip(f.change, self.fit.trusted_m[f.m])]

    def _change(self, m: int, least: int, block: int | None = None) -> _Found | None:
        seen = np.flatnonzero(np.isfinite(self.means[:, m, 0]))
        at = None if block is None else int(np.searchsorted(seen, block))
        if len(seen) < 2 * least:
            return None
        columns = self.columns[self.fit.segments[m]][seen]
        found = find_level_change(self.means[seen, m], columns, _SKIN_M_PER_RAD, least, at)
        return _Found(m, found, int(seen[found.at])) if found else None

    def source(self, first: _Found, changes: list[_Found]) -> tuple[_Slip, np.ndarray]:
        """Whose slip makes the strongest change, and the change it makes of all (m, 3)."""
        fit = self.fit
        field, sd = np.full((len(fit.labels), 3), np.nan), np.full(len(fit.labels), np.nan)
        near = {f.m: f for f in changes if abs(f.block - first.block) <= self.least}
        reach = np.abs(fit.response[:, :, list(near)]).max(axis=(1, 2, 3))
        for k in np.flatnonzero(reach > _LEAST_RESPONSE):
            found = self._change(int(k), 1, first.block)
            if found:
                field[k], sd[k] = found.change.step, found.change.step_sd
        near = {m: f for m, f in near.items() if np.isfinite(sd[m])} or {first.m: first}
        field[first.m], sd[first.m] = first.change.step, first.change.step_sd
        sd = np.hypot(sd, 0.1 * np.linalg.norm(first.change.step))
        m, vector = best_source(fit.response, field, sd, list(near))
        frame = self._frame(near[m])
        made = np.einsum("jak,k->ja", fit.response[:, :, m], vector)
        left = np.linalg.norm(field - made, axis=1)
        same = left < _SAME * np.linalg.norm(field, axis=1)
        same[m] = True
        return _Slip(m, frame, vector, near[m].change.z), np.where(same[:, None], field, made)

    def take(self, slip: _Slip, made: np.ndarray) -> None:
        """Take a slip out of the residuals."""
        self.left[slip.frame :] -= made
        self.means = block_means(self.left, self.frames)
        moved = np.linalg.norm(made, axis=1) > 0.1 * self.fit.trusted_m
        self.best = {k: f for k, f in self.best.items() if not moved[k]}

    def _frame(self, found: _Found) -> int:
        """First frame at the new level: the split near the block with the least squares."""
        step, middle = found.change.step, found.block * self.frames
        along = self.left[:, found.m] @ step / (step @ step)
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
    search, found = _Search(fit, residual), []
    for _ in range(_MOST):
        changes = search.changes()
        if not changes:
            break
        slip, made = search.source(max(changes, key=lambda one: one.change.z), changes)
        search.take(slip, made)
        if np.linalg.norm(slip.vector) > BEYOND * fit.trusted_m[slip.m]:
            found.append(slip)
    return _events(fit, found), search.left


def _is_slip(change: LevelChange, trusted_m: float) -> bool:
    size = float(np.linalg.norm(change.step))
    return bool(
        change.z > _CHANCE
        and size > 0.5 * BEYOND * trusted_m  # the pose takes its part
        and size > _SLIP * change.spread
    )


def _events(fit: MarkerFit, found: list[_Slip]) -> list[MarkerEvent]:
    """Slips; one that a later one undoes is a long jump."""
    events, waiting = [], sorted(found, key=lambda one: one.frame)
    while waiting:
        slip = waiting.pop(0)
        size = float(np.linalg.norm(slip.vector))
        back = [
            other
            for other in waiting
            if other.m == slip.m and np.linalg.norm(slip.vector + other.vector) < 0.5 * size
        ]
        kind, stop = ("jump", back[0].frame) if back else ("slip", len(fit.times_s))
        if back:
            waiting.remove(back[0])
        frames = slice(slip.frame, stop)
        events.append(event(fit, kind, slip.m, frames, size, slip.z))  # type: ignore[arg-type]
    return events


def _with_squares(x: np.ndarray) -> np.ndarray:
    centred = x - np.mean(x, axis=0)
    return np.concatenate([x, centred**2], axis=1)


def block_means(x: np.ndarray, frames: int) -> np.ndarray:
    """Means of (N, ...) over blocks of frames, NaN where half of a block is missing."""
    count = len(x) // frames
    cut = x[: count * frames].reshape(count, frames, *x.shape[1:])
    seen = np.isfinite(cut)
    number = seen.sum(axis=1)
    total = np.where(seen, cut, 0.0).sum(axis=1)
    return np.where(2 * number >= frames, total / np.maximum(number, 1), np.nan)
