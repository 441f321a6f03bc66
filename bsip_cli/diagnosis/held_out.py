"""What an explanation is worth on stretches of time that did not help to find its size."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bsip_cli.diagnosis.explanation import Fit
from bsip_cli.diagnosis.together import Evidence
from bsip_cli.statistics.normal import Z95

FOLDS = 5


@dataclass(frozen=True, eq=False)
class Gain:
    """Squared white residual that goes, per block (b,), 0 in trials that are not concerned.

    concerned : (b,) blocks of the trials that the explanation is about.
    before : their squared white residual without it.

    percent : of the squared residual, and its standard error over the blocks.
    """

    blocks: np.ndarray
    concerned: np.ndarray
    before: float

    @property
    def percent(self) -> float:
        return 100 * float(self.blocks.sum()) / self.before

    @property
    def error_percent(self) -> float:
        return 100 * standard_error(self.blocks[self.concerned]) / self.before

    def is_real(self) -> bool:
        """Larger than its standard error."""
        return self.percent > self.error_percent

    def is_sure(self) -> bool:
        """Its 95 % interval lies above zero."""
        return self.interval()[1] > 0

    def interval(self) -> tuple[float, float, float]:
        """Percent, and its 95 % interval."""
        half = Z95 * self.error_percent
        return self.percent, self.percent - half, self.percent + half


def standard_error(blocks: np.ndarray) -> float:
    """Of the sum of blocks (b,)."""
    return float(np.sqrt(len(blocks)) * blocks.std(ddof=1)) if len(blocks) > 1 else np.inf


def gain_of(
    evidence: Evidence,
    trials: tuple[int, ...],
    before: np.ndarray,
    after: np.ndarray,
    tangent: np.ndarray,
) -> Gain:
    """Gain on the blocks of some trials.

    Every block is left out once, with a fifth of the others, and the sizes are estimated anew.
    The percentage is of the residual in the trials that the explanation is about.

    before, after : (R,) residual without the explanation, and with its likeliest sizes.
    tangent : (R, k) of everything that is estimated anew.
    """
    blocks = evidence.blocks()
    there = np.concatenate(
        [np.full(len(one.residual), t in trials) for t, one in enumerate(evidence.trials)]
    )
    numbers = np.unique(blocks)
    gains = np.zeros(len(numbers))
    for fold in range(FOLDS):
        test = blocks % FOLDS == fold
        train = ~test
        step = np.linalg.lstsq(tangent[train], after[train], rcond=None)[0]
        saved = before**2 - (after - tangent @ step) ** 2
        for k in np.flatnonzero(numbers % FOLDS == fold):
            gains[k] = saved[blocks == numbers[k]].sum()
    concerned = np.isin(numbers, blocks[there])
    return Gain(np.where(concerned, gains, 0.0), concerned, float((before[there] ** 2).sum()))


def values_without(evidence: Evidence, fit: Fit) -> list[list[list[float]]]:
    """Per explanation and fold, all its parameters, the free ones estimated without the fold's
    blocks."""
    fold = evidence.blocks() % FOLDS
    kept: list[list[list[float]]] = [[] for _ in fit.explanations]
    for number in range(FOLDS):
        train = fold != number
        step = np.linalg.lstsq(fit.tangent[train], fit.residual[train], rcond=None)[0]
        for k, one in enumerate(fit.explanations):
            moved = one.moved(evidence, step[fit.columns(k, evidence)])
            kept[k].append(moved.values.tolist())
    return kept
