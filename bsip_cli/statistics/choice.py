"""Errors compared: which parameters follow the measured forces best, and what a correction gains.

The error of a method in a trial is the geometric mean of the RMSE in all components, so that
newtons, newton metres and millimetres count alike; two methods are compared by the difference of
its logarithms.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bsip_cli.statistics.methods import OM, RM, RM_MASS, SAME_WITHIN
from bsip_cli.statistics.samples import effective_samples

COMPONENTS = ("fx", "fy", "fz", "mx", "my", "mz", "cop_ap", "cop_ml")
PAIRS = ((OM, RM), (OM, RM_MASS), (RM_MASS, RM))

Pair = tuple[str, str]


@dataclass(frozen=True)
class Difference:
    """Of the logarithms of two methods' errors, and its standard error; that is widened by
    Student's t where few trials or samples decide it, so that it always means the same confidence
    (84 % to one side), and is nan where nothing decides it."""

    log: float
    error: float

    @classmethod
    def of_ratio(cls, ratio: float, error: float) -> Difference:
        return cls(float(np.log(ratio)), error)

    def is_better(self) -> bool:
        """The first errs less, by more than the standard error and than what counts as equal."""
        return self.log < -self.error and self.log < np.log(1 - SAME_WITHIN)

    @property
    def ratio(self) -> float:
        return float(np.exp(self.log))

    def interval(self) -> tuple[float, float]:
        """Of the ratio, one standard error to either side."""
        return float(np.exp(self.log - self.error)), float(np.exp(self.log + self.error))


Differences = Mapping[Pair, Difference]


def between(logs: Sequence[float]) -> Difference:
    """From as many independent differences: of trials of a movement, or of movements."""
    n = len(logs)
    error = float(np.std(logs, ddof=1)) / np.sqrt(n) if n > 1 else np.nan
    return Difference(float(np.mean(logs)), error * _widened(n))


def within(first: np.ndarray, second: np.ndarray) -> Difference:
    """From one trial: residuals (N, components) of two methods, nan where none is judged.

    The mean logarithm of the RMSE is linearised in the squared residuals; its change over time is
    a series whose independent samples give the standard error.
    """
    (log, slopes), (other_log, other_slopes) = map(_log_error, (first, second))
    series = slopes - other_slopes
    n = effective_samples(series)
    error = float(np.nanstd(series)) / np.sqrt(n)
    return Difference(log - other_log, error * _widened(n))


def chosen(differences: Differences, is_rare: bool) -> str:
    """OM where it is better than both others and a likely body, else RM+mass where it is better
    than RM, else RM."""
    better = {pair for pair, one in differences.items() if one.is_better()}
    if {(OM, RM), (OM, RM_MASS)} <= better and not is_rare:
        return OM
    return RM_MASS if (RM_MASS, RM) in better else RM


def _widened(n: float) -> float:
    """By how much Student's t of n samples widens one standard error of a known spread."""
    from scipy.stats import norm, t  # heavy

    return float(t.ppf(norm.cdf(1.0), n - 1)) if n > 1 else np.nan


def _log_error(residuals: np.ndarray) -> tuple[float, np.ndarray]:
    """Mean logarithm of the RMSE, and how each frame (N,) moves it; nan where there is none."""
    squares = residuals**2
    frames = int(np.isfinite(squares).any(axis=1).sum())
    counts = np.isfinite(squares).sum(axis=0)
    squares, counts = squares[:, counts > 0], counts[counts > 0]
    means = np.nanmean(squares, axis=0)
    slopes = 0.5 * np.nan_to_num(squares / means - 1) * frames / counts
    slopes[~np.isfinite(squares).any(axis=1)] = np.nan
    return float(0.5 * np.log(means).mean()), slopes.mean(axis=1)


# --- how much smaller an error becomes, with an interval from whole blocks of time ----------------

_DRAWS = 500


@dataclass(frozen=True, eq=False)
class BlockErrors:
    """Squared errors before and after, summed per block (b,), and the number of samples (b,)."""

    before: np.ndarray
    after: np.ndarray
    samples: np.ndarray


@dataclass(frozen=True)
class ErrorGain:
    """Root-mean-square errors, and by what part the second is smaller [%]; NaN without samples."""

    rmse_before: float
    rmse_after: float
    percent: float
    ci_low: float
    ci_high: float


def block_errors(
    measured: np.ndarray, before: np.ndarray, after: np.ndarray, blocks: np.ndarray
) -> BlockErrors:
    """Sums over the samples (n,) at which all three signals are finite.

    blocks : (n,) number of the block of each sample.
    """
    known = np.isfinite(measured) & np.isfinite(before) & np.isfinite(after)
    _, place = np.unique(blocks[known], return_inverse=True)
    left, right = (((one - measured)[known]) ** 2 for one in (before, after))
    return BlockErrors(
        np.bincount(place, left), np.bincount(place, right), np.bincount(place).astype(float)
    )


def pooled(parts: list[BlockErrors]) -> BlockErrors:
    """The blocks of several trials."""
    sums = zip(*((one.before, one.after, one.samples) for one in parts), strict=True)
    return BlockErrors(*map(np.concatenate, sums))


def error_gain(errors: BlockErrors, rng: np.random.Generator) -> ErrorGain:
    """Gain over all blocks; its 95 % interval from blocks drawn with replacement."""
    number = len(errors.samples)
    if number == 0:
        return ErrorGain(*[np.nan] * 5)
    before, after, samples = (x.sum() for x in (errors.before, errors.after, errors.samples))
    low, high = np.nan, np.nan
    if number > 1:
        drawn = rng.integers(0, number, (_DRAWS, number))
        gains = _percent(errors.before[drawn].sum(axis=1), errors.after[drawn].sum(axis=1))
        low, high = np.percentile(gains, [2.5, 97.5])
    rmse = np.sqrt(before / samples), np.sqrt(after / samples)
    return ErrorGain(*map(float, (*rmse, _percent(before, after), low, high)))


def _percent(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Of squared errors: by what part the root is smaller [%]."""
    return 100 * (1 - np.sqrt(after / before))
