"""Trials that share a table of forces, whole or cut: one recording under two names, or another
trial's forces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from scipy.signal import correlate, find_peaks

from bsip_cli.recordings.body_motion import USUAL, GateLimits
from bsip_cli.recordings.plate_reading import Opened, lift_N

_BLOCK_S = 0.02  # over which a total is averaged: filters leave it as it is
_FEWEST = 40  # blocks: parts of 30 of other trials are alike by 0.9993 at some shift
_SAME = 0.998  # of the variance; parts of 40 of 54 other public trials are by 0.9975 at any shift
_TAPS = np.arange(-2, 3)  # blocks from which another export's may be made up: cut within a block
_SIZE = 0.01  # by which those may sum to another size: cuts of public trials by 0.003
_SHIFTS = 5  # likeliest ones that are looked at: strides are alike
ALIKE_M = 0.01  # centres of pressure, and paths of the body, that differ by less are one


@dataclass(frozen=True, eq=False)
class Course:
    """``total_N`` (n,) : the plates' vertical force in each block, as the file says, from the first
    to the last that is usable. ``path_m``
    (n, 3) : of the centre of mass there, NaN where not known. ``goes`` : how well both go together,
    logarithm."""

    total_N: np.ndarray = field(default_factory=lambda: np.zeros(0))
    path_m: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    goes: float = 0.0

    @classmethod
    def of(
        cls,
        opened: Opened,
        seconds: np.ndarray | None = None,
        path_m: np.ndarray | None = None,
        goes: float = 0.0,
    ) -> Course:
        """Of a trial and the ``path_m`` (m, 3) of its centre of mass at ``seconds`` (m,)."""
        lifts = [np.where(s.usable, lift_N(s), np.nan) for s in opened.sources]
        step = max(1, round(_BLOCK_S * opened.recording.analog_rate_hz))
        total = np.sum(lifts, axis=0) if lifts else np.zeros(0)
        total = total[: len(total) // step * step].reshape(-1, step).mean(axis=1)
        known = np.flatnonzero(np.isfinite(total))
        if not len(known):
            return cls()
        blocks = np.arange(known[0], known[-1] + 1)
        total = np.interp(blocks, known, total[known])
        if seconds is None or path_m is None:
            return cls(total)
        times = _BLOCK_S * (0.5 + blocks)
        path = [np.interp(times, seconds, one, right=np.nan) for one in path_m.T]
        return cls(total, np.column_stack(path), goes)


def same_movements(courses: Sequence[tuple[str, Course]]) -> list[tuple[str, str]]:
    """Names of pairs that are one recording, exported twice: filtered, renamed, in two formats, or
    a part of it."""
    return [(one, other) for one, other, alike in _sharing(courses) if alike]


def of_twins(courses: Sequence[tuple[str, Course]], limits: GateLimits = USUAL) -> dict[str, str]:
    """Trials, by name, that have the forces of another one, which moves otherwise. They are of that
    with which they surely go better; where that is not sure, of neither."""
    surely, of = -float(np.log(1 - limits.corrected_percent / 100)), dict(courses)
    pairs = [(one, other) for one, other, alike in _sharing(courses) if not alike]
    return {
        own: twin
        for pair in pairs
        for own, twin in (pair, pair[::-1])
        if of[own].goes < of[twin].goes + surely
    }


def _sharing(courses: Sequence[tuple[str, Course]]) -> list[tuple[str, str, bool]]:
    """Pairs with the same forces, and whether they move alike."""
    found = []
    for (name, one), (other_name, other) in combinations(courses, 2):
        if (shared := _shared(one.total_N, other.total_N)) is not None:
            alike = _alike(one.path_m[shared[0]], other.path_m[shared[1]])
            found.append((name, other_name, alike))
    return found


def _shared(one: np.ndarray, other: np.ndarray) -> tuple[slice, slice] | None:
    """The blocks of each with the same forces, at least half of the shorter; None if there are not.

    One is then the other's neighbouring blocks, weighted by five numbers of sum 1, and a constant.
    It must change in more blocks than these numbers could fit.
    """
    if len(one) < len(other):
        swapped = _shared(other, one)
        return None if swapped is None else swapped[::-1]
    n, m = len(one), len(other)
    if m < _FEWEST:
        return None
    shifts = np.arange(1 - m, n)
    first, last = np.maximum(shifts, 0), np.minimum(shifts + m, n)
    number = last - first
    a, b = one - one.mean(), other - other.mean()
    sums = [np.concatenate([[0.0], np.cumsum(x)]) for x in (a, b, a**2, b**2)]
    of_a, of_b, of_aa, of_bb = (
        x[last - by] - x[first - by] for x, by in zip(sums, (0, shifts, 0, shifts), strict=True)
    )
    spread = np.maximum(of_aa - of_a**2 / number, 0) * np.maximum(of_bb - of_b**2 / number, 0)
    enough = (number >= max(_FEWEST, m / 2)) & (spread > 1e-12 * spread.max())
    with np.errstate(divide="ignore", invalid="ignore"):
        likeness = (correlate(a, b) - of_a * of_b / number) / np.sqrt(spread)
    likeness = np.where(enough, likeness, -1.0)
    peaks = find_peaks(np.pad(likeness, 1, constant_values=-1.0))[0] - 1
    for k in sorted(peaks, key=lambda k: -likeness[k])[:_SHIFTS]:
        rows = np.arange(first[k], last[k]) - shifts[k]
        rows = rows[(rows + _TAPS[0] >= 0) & (rows + _TAPS[-1] < m)]
        ours = one[rows + shifts[k]]
        theirs = np.column_stack([other[rows[:, None] + _TAPS], np.ones(len(rows))])
        weights = np.linalg.lstsq(theirs, ours, rcond=None)[0]
        left, changes = ours - theirs @ weights, np.diff(ours) ** 2
        if (
            left.var() < (1 - _SAME) * ours.var()
            and abs(weights[:-1].sum() - 1) < _SIZE
            and changes.sum() ** 2 > theirs.shape[1] * (changes**2).sum()
        ):
            return slice(first[k], last[k]), slice(first[k] - shifts[k], last[k] - shifts[k])
    return None


def _alike(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether paths of the centre of mass (n, 3) are one, in axes that may be turned about the
    vertical; or nothing shows that they are not."""
    n = min(len(one), len(other))
    paths = np.array([one[:n], other[:n]])
    paths = paths[:, np.isfinite(paths).all(axis=(0, 2))]
    if not paths.size:
        return True
    paths -= paths.mean(axis=1, keepdims=True)
    across = paths[..., :2] @ [1.0, 1j]
    turned = 2 * abs((across[0].conj() * across[1]).mean())
    level = (np.abs(across) ** 2).mean(axis=1).sum() - turned
    return bool(level + ((paths[0] - paths[1])[:, 2] ** 2).mean() < ALIKE_M**2)
