"""How much smaller an error becomes, with an interval from whole blocks of time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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
    return BlockErrors(
        np.concatenate([one.before for one in parts]),
        np.concatenate([one.after for one in parts]),
        np.concatenate([one.samples for one in parts]),
    )


def error_gain(errors: BlockErrors, rng: np.random.Generator) -> ErrorGain:
    """Gain over all blocks; its 95 % interval from blocks drawn with replacement."""
    number = len(errors.samples)
    if number == 0:
        return ErrorGain(*[np.nan] * 5)
    before, after = errors.before.sum(), errors.after.sum()
    samples = errors.samples.sum()
    low, high = np.nan, np.nan
    if number > 1:
        drawn = rng.integers(0, number, (_DRAWS, number))
        gains = _percent(errors.before[drawn].sum(axis=1), errors.after[drawn].sum(axis=1))
        low, high = np.percentile(gains, [2.5, 97.5])
    return ErrorGain(
        float(np.sqrt(before / samples)),
        float(np.sqrt(after / samples)),
        float(_percent(before, after)),
        float(low),
        float(high),
    )


def _percent(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Of squared errors: by what part the root is smaller [%]."""
    return 100 * (1 - np.sqrt(after / before))
