"""Units of length against the size of a person, and positions that no laboratory holds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bsip_cli.recordings.model import Finding
from bsip_cli.recordings.person_size import PEOPLE_M, by_segment, height_m
from bsip_cli.recordings.units import length_in_m, length_name

_PERSON_M = (0.25, 8.0)  # the markers' extent in one frame: a limb to two people
_ANYTHING_M = (0.02, 30.0)  # a clearly stated unit is doubted only beyond this
_FEWEST_MARKERS = 4
_LARGEST_LAB_M = 100.0
_FASTEST_M_S = 15.0  # half of the markers, half of the time: a sprinter's
_SMOOTH = 0.2  # of the markers' distance from their middle: their second difference
_USUAL_M = 1.6
_INCH_M = 0.0254
_GUESSED_M = (1e-3, 1.0, 1e-2)  # mm, m, cm: what a file may be in that does not say it


def settle_unit(
    positions: np.ndarray, labels: Sequence[str], stated: str, name: str
) -> tuple[float, list[Finding]]:
    """Size of the unit in metres, and a finding where the file's statement cannot be taken.

    ``positions`` (n_frames, n_markers, 3) as written, NaN = missing; ``stated`` is the file's
    word and ``name`` its place. The stature that the labels tell decides, of markers that say
    none their extent, where it fits a person in another unit only.
    """
    stated_m = length_in_m(stated)
    if (tall := height_m(by_segment(labels, positions))) is not None:
        return _by_stature(tall, stated, stated_m, name)
    extent = _extent(positions)
    fitting = [size for size in _GUESSED_M if _PERSON_M[0] <= extent * size <= _PERSON_M[1]]
    if stated_m is not None:
        is_possible = _ANYTHING_M[0] <= extent * stated_m <= _ANYTHING_M[1]
        if is_possible or not fitting:
            is_plain = stated.strip().lower() in map(length_name, _GUESSED_M)
            return stated_m, [] if is_plain else [_finding(name, stated, stated_m, extent)]
    size = fitting[0] if fitting else 1e-3 if extent > _PERSON_M[1] else 1.0
    return size, [_finding(name, stated, size, extent)]


def _by_stature(
    tall: float, stated: str, stated_m: float | None, name: str
) -> tuple[float, list[Finding]]:
    """The stated unit if it makes a person; else the one that makes a person most like others."""
    low, high = PEOPLE_M
    fitting = [size for size in (*_GUESSED_M, _INCH_M) if low <= tall * size <= high]
    if stated_m is not None and (low <= tall * stated_m <= high or not fitting):
        is_plain = stated.strip().lower() in map(length_name, _GUESSED_M)
        size, is_said = stated_m, not is_plain
    else:
        usual = [abs(np.log(tall * size / _USUAL_M)) for size in fitting]
        size, is_said = fitting[int(np.argmin(usual))] if fitting else 1e-3, True
    found = f"{name} '{stated}', and the markers are those of a person {tall:.4g} of it tall"
    action = f"read lengths in {length_name(size)}"
    about = Finding(
        "unit", "points", found, "m or mm, and the size of a person", action, "corrected"
    )
    return size, [about] if is_said else []


def without_absurd(positions_m: np.ndarray) -> list[Finding]:
    """Turn positions beyond any laboratory into missing ones (in place), and say so."""
    absurd = ((positions_m > _LARGEST_LAB_M) | (positions_m < -_LARGEST_LAB_M)).any(axis=-1)
    if not absurd.any():
        return []
    positions_m[absurd] = np.nan
    return [
        Finding(
            check="points",
            subject="",
            found=f"{int(absurd.sum())} positions more than {_LARGEST_LAB_M:g} m away",
            expected="markers in a laboratory",
            action="took them as missing",
            level="warning",
        )
    ]


def move_like_markers(positions_m: np.ndarray, rate_hz: float) -> bool:
    """Whether positions (n_frames, n_markers, 3) can only be those of markers on a person.

    They are as far apart as a person is large, no two at one place, change from frame to frame,
    no faster than people, and smoothly. Numbers that are none, or left from another trial's
    memory, do not.
    """
    known = np.isfinite(positions_m).all(axis=-1)
    if len(known) < 3 or not _PERSON_M[0] <= _extent(positions_m) <= _PERSON_M[1]:
        return False
    middle = np.nanmedian(positions_m[known.any(axis=1)], axis=0)
    middle = middle[np.isfinite(middle).all(axis=1)]
    if len(np.unique(middle, axis=0)) < max(len(middle), _FEWEST_MARKERS):
        return False
    steps = np.diff(positions_m, axis=0)
    size = np.linalg.norm(steps, axis=-1)
    size = size[np.isfinite(size)]
    bend = np.linalg.norm(np.diff(steps, axis=0), axis=-1)
    bend = bend[np.isfinite(bend)]
    if not len(bend) or (size > 0).mean() < 0.5:
        return False
    spread = float(np.median(np.linalg.norm(middle - middle.mean(axis=0), axis=1)))
    return bool(np.median(size) * rate_hz < _FASTEST_M_S and np.median(bend) < _SMOOTH * spread)


def _extent(positions: np.ndarray) -> float:
    """Median over the frames of the largest side of the markers' box; NaN if there are few."""
    known = np.isfinite(positions).all(axis=-1)
    enough = known.sum(axis=1) >= _FEWEST_MARKERS
    if not enough.any():
        return float("nan")
    some = np.flatnonzero(enough)[:: max(1, int(enough.sum()) // 200)]
    sides = [np.ptp(positions[k, known[k]], axis=0).max() for k in some]
    return float(np.median(sides))


def _finding(name: str, stated: str, size: float, extent: float) -> Finding:
    return Finding(
        check="unit",
        subject="points",
        found=f"{name} '{stated}', and the markers span {extent:.4g} of it",
        expected="m or mm, and the size of a person",
        action=f"read lengths in {length_name(size)}",
        level="corrected",
    )
