"""The evidence of several trials of one person, whose inertial parameters are the same in all.

The parameters are a random effect of known covariance that the trials share: with A what they do
to the white residuals of all trials, one above the other, these have covariance 1 + A A^T. Its
inverse square root projects out what the parameters may explain, within what is known of them
before the data; a trial that says much of them thereby sharpens what the others can tell.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bsip_cli.diagnosis.evidence import TrialEvidence, shrunk

BLOCK_S = 1.0  # stretches of time that stand for independent ones
_CLIP = 4.0  # standard deviations: a contact's edge must not stand for a minute of movement


@dataclass(frozen=True, eq=False)
class Evidence:
    """White residual of all trials, and what turns signatures into the same coordinates.

    Attributes
    ----------
    trials : in the order of the rows.
    left, shrink : (R, p) left singular vectors of A and by how much each is shrunk (p,).
    residual : (R,) white noise of variance 1 if nothing is wrong.
    """

    trials: tuple[TrialEvidence, ...]
    left: np.ndarray
    shrink: np.ndarray
    residual: np.ndarray

    def rows(self, trial: int) -> slice:
        """Where a trial's rows are."""
        ends = np.cumsum([0, *(len(one.residual) for one in self.trials)])
        return slice(int(ends[trial]), int(ends[trial + 1]))

    def turned(self, columns: np.ndarray) -> np.ndarray:
        """(R, k) columns with what the parameters explain taken off."""
        return columns - self.left @ (self.shrink[:, None] * (self.left.T @ columns))

    def white(self, parts: dict[int, np.ndarray]) -> np.ndarray:
        """(R, k) of signatures that are white in their own trials: trial to (6 n, k)."""
        inside = sum(self.left[self.rows(trial)].T @ part for trial, part in parts.items())
        columns = self.left @ (-self.shrink[:, None] * inside)
        for trial, part in parts.items():
            columns[self.rows(trial)] += part
        return columns

    def beyond_stated(self, residual: np.ndarray) -> float:
        """By how many standard deviations of the stated mass the likeliest body is heavier, given
        what is left (R,) beside some causes."""
        shared = np.concatenate([one.shared for one in self.trials])
        sizes = shared.T @ self.turned(residual[:, None])[:, 0]
        return float(self.trials[0].filtered.heavier @ sizes)

    def first_block(self, trial: int) -> int:
        """The number of a trial's first stretch in ``blocks``."""
        return int(self.blocks()[self.rows(trial)].min())

    def blocks(self) -> np.ndarray:
        """(R,) number of the stretch of BLOCK_S that a row belongs to, counted through all
        trials."""
        numbers, first = [], 0
        for one in self.trials:
            at = one.rows_s()
            number = ((at - at[0]) / BLOCK_S).astype(int)
            numbers.append(first + number)
            first += int(number.max()) + 1
        return np.concatenate(numbers)


def together(trials: tuple[TrialEvidence, ...]) -> Evidence:
    """Join the evidence of trials that share their inertial parameters."""
    shared = np.concatenate([one.shared for one in trials])
    left, shrink = shrunk(shared)
    residual = np.concatenate([one.residual for one in trials])
    residual = residual - left @ (shrink * (left.T @ residual))
    return Evidence(trials, left, shrink, residual)


def clipped(residual: np.ndarray) -> np.ndarray:
    """A white residual whose outliers count as four standard deviations."""
    return np.clip(residual, -_CLIP, _CLIP)
