"""From time stamps as written to an even grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bsip_cli.recordings.model import Finding

_JITTER = 0.05  # of the sample interval: below it the stamps count as even
_JUMP = 2.5  # sample intervals: above it the recording is torn
MOST_HZ = 1e5  # no camera and no plate is faster
_SAME = 0.02  # of the sample interval: stamps that all lie on the grid
_EXACT = 1e-3  # of the sample interval: a stamp that lies on the grid among others that do not


@dataclass(frozen=True, eq=False)
class Grid:
    time_s: np.ndarray  # (n,), even
    rate_hz: float
    findings: tuple[Finding, ...]


def even_grid(stamps_s: np.ndarray, stated_rate_hz: float) -> Grid | None:
    """The even grid nearest to the stamps (n,); torn stamps give their longest stretch.

    None if the stamps do not increase, faster than ``MOST_HZ``, or so unevenly that the grid would
    have more times than their largest steps allow.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        steps = np.diff(stamps_s)
    if not len(steps) or not np.isfinite(steps).all() or np.median(steps) <= 0:
        return None
    rate_hz = _rate(steps, stated_rate_hz)
    if rate_hz > MOST_HZ:
        return None
    findings: list[Finding] = []
    start, stop = _longest_stretch(steps, rate_hz)
    if stop - start < len(stamps_s):
        findings.append(_torn(steps, start, stop, len(stamps_s)))
    kept = stamps_s[start:stop]
    if len(kept) < 2:
        return None
    if np.isfinite(stated_rate_hz) and rate_hz != stated_rate_hz:
        findings.append(_other_rate(rate_hz, stated_rate_hz))
    jitter = np.abs(kept - kept[0] - np.arange(len(kept)) / rate_hz).max() * rate_hz
    if jitter > _JITTER:
        rate_hz = float(1 / np.median(np.diff(kept)))
        findings.append(_uneven(np.diff(kept), rate_hz))
    n = int(np.floor((kept[-1] - kept[0]) * rate_hz + _SAME)) + 1
    if n > _JUMP * len(kept) + 1 or rate_hz > MOST_HZ:
        return None
    return Grid(kept[0] + np.arange(n) / rate_hz, rate_hz, tuple(findings))


def onto_grid(grid: Grid, stamps_s: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values (n, ...) at the grid's times: copied where they lie on it, else interpolated.

    Times outside the stamps and beside a NaN become NaN.
    """
    nearest = np.clip(np.searchsorted(stamps_s, grid.time_s), 1, len(stamps_s) - 1)
    left_is_nearer = grid.time_s - stamps_s[nearest - 1] < stamps_s[nearest] - grid.time_s
    nearest = nearest - left_is_nearer
    off = np.abs(stamps_s[nearest] - grid.time_s) * grid.rate_hz
    if off.max() <= _SAME:
        is_all = np.array_equal(nearest, np.arange(len(values)))
        return values if is_all else values[nearest]
    flat = values.reshape(len(values), -1)
    columns = [_interpolated(grid.time_s, stamps_s, column) for column in flat.T]
    result = np.column_stack(columns)
    exact = off <= _EXACT
    result[exact] = flat[nearest[exact]]
    return result.reshape(len(grid.time_s), *values.shape[1:])


def _interpolated(time_s: np.ndarray, stamps_s: np.ndarray, column: np.ndarray) -> np.ndarray:
    return np.interp(time_s, stamps_s, column, left=np.nan, right=np.nan)


def _rate(steps: np.ndarray, stated_rate_hz: float) -> float:
    """The stated rate if the stamps agree within 1 %, else the stamps' own."""
    own = 1 / float(np.median(steps))
    if stated_rate_hz > 0 and abs(own / stated_rate_hz - 1) < 0.01:
        return stated_rate_hz
    own = 1 / float(np.mean(steps)) if np.ptp(steps) < np.median(steps) else own
    return float(round(own)) if abs(own - round(own)) < 1e-3 * own else own


def _longest_stretch(steps: np.ndarray, rate_hz: float) -> tuple[int, int]:
    """Start and stop (exclusive) of the longest stretch without a jump or a step back."""
    torn = np.flatnonzero((steps * rate_hz > _JUMP) | (steps <= 0))
    edges = np.concatenate([[0], torn + 1, [len(steps) + 1]])
    longest = int(np.argmax(np.diff(edges)))
    return int(edges[longest]), int(edges[longest + 1])


def _other_rate(rate_hz: float, stated_rate_hz: float) -> Finding:
    return Finding(
        check="rate",
        subject="points",
        found=f"the header says {stated_rate_hz:g} Hz, the time stamps {rate_hz:.4g} Hz",
        expected="one rate",
        action="took the time stamps",
        level="warning",
    )


def _torn(steps: np.ndarray, start: int, stop: int, n: int) -> Finding:
    return Finding(
        check="time",
        subject="",
        found=f"time stamps with a step of {steps.max():.3g} s (least {steps.min():.3g} s)",
        expected=f"even steps of {np.median(steps):.4g} s",
        action=f"kept the longest stretch, samples {start + 1} to {stop} of {n}",
        level="warning",
    )


def _uneven(steps: np.ndarray, rate_hz: float) -> Finding:
    return Finding(
        check="time",
        subject="",
        found=f"uneven time stamps, steps of {1e3 * steps.min():.3g} to {1e3 * steps.max():.3g} ms",
        expected="even steps",
        action=f"interpolated at {rate_hz:.4g} Hz",
        level="corrected",
    )
