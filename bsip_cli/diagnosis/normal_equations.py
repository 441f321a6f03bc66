"""Normal equations of several trials, of whose coefficients many are one trial's alone.

Each trial's own coefficients are eliminated first (a Schur complement), then the shared ones are
solved: so the cost grows with the number of trials, not with its cube.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg.lapack import dtrtri


@dataclass(frozen=True, eq=False)
class Equations:
    """gram (K', K'), against (K',) : products of white columns about the coefficients ``used``
    (K',) with themselves and with the residual."""

    used: np.ndarray
    gram: np.ndarray
    against: np.ndarray


def summed(equations: Iterable[Equations], count: int) -> tuple[np.ndarray, np.ndarray]:
    """(K, K) and (K,) normal equations of some trials."""
    gram, against = np.zeros((count, count)), np.zeros(count)
    for one in equations:
        gram[np.ix_(one.used, one.used)] += one.gram
        against[one.used] += one.against
    return gram, against


@dataclass(frozen=True, eq=False)
class _Eliminated:
    """A trial's own coefficients, ``own`` (K',) of those ``used`` (K',), over their spreads before
    the data: inverse factor (o, o) of their precision, times that across to the shared ones (o, s);
    ``others`` (s,): which these are."""

    used: np.ndarray
    own: np.ndarray
    inverse: np.ndarray
    across: np.ndarray
    others: np.ndarray


@dataclass(frozen=True, eq=False)
class Solution:
    """Posterior of coefficients with standard deviations ``root`` (K,) before the data.

    against (K,) : of all trials. shared (S,) : coefficients of several trials; ``factor`` (S, S):
    the inverse factor of their precision.
    """

    root: np.ndarray
    against: np.ndarray
    trials: tuple[_Eliminated, ...]
    shared: np.ndarray
    factor: np.ndarray

    @cached_property
    def mean(self) -> np.ndarray:
        """(K,)."""
        return self.times(self.against[:, None])[:, 0]

    @cached_property
    def variance(self) -> np.ndarray:
        """(K,)."""
        variance = self.root**2
        for trial, one in enumerate(self.trials):
            variance[one.used] = sum((x**2).sum(axis=0) for x in self.roots(trial))
        return variance

    @cached_property
    def covariance(self) -> np.ndarray:
        """(K, K)."""
        return self.times(np.eye(len(self.root)))

    @property
    def log_determinant(self) -> float:
        """Of the precision after the data times the covariance before them."""
        factors = (*(one.inverse for one in self.trials), self.factor)
        return -2 * sum(float(np.log(np.diag(one)).sum()) for one in factors)

    def times(self, x: np.ndarray) -> np.ndarray:
        """(K, k) the covariance times x (K, k)."""
        x = self.root[:, None] * x
        found, left = x.copy(), x[self.shared]
        pulls = [one.inverse @ x[one.used[one.own]] for one in self.trials]
        for one, pull in zip(self.trials, pulls, strict=True):
            left[one.others] -= one.across.T @ pull
        found[self.shared] = left = self.factor.T @ (self.factor @ left)
        for one, pull in zip(self.trials, pulls, strict=True):
            found[one.used[one.own]] = one.inverse.T @ (pull - one.across @ left[one.others])
        return self.root[:, None] * found

    def covariance_in(self, trial: int) -> np.ndarray:
        """(K', K') of what a trial uses."""
        return sum(x.T @ x for x in self.roots(trial))

    def roots(self, trial: int) -> tuple[np.ndarray, np.ndarray]:
        """(o, K') and (S, K') of the covariance of what a trial uses: A'A + B'B, of what it uses
        with what another one does B'B alone."""
        one = self.trials[trial]
        alone, together = (np.zeros((len(x), len(one.used))) for x in (one.inverse, self.factor))
        alone[:, one.own] = one.inverse
        together[:, ~one.own] = self.factor[:, one.others]
        together[:, one.own] = -self.factor[:, one.others] @ (one.across.T @ one.inverse)
        return alone * self.root[one.used], together * self.root[one.used]


def solved(equations: Sequence[Equations], root: np.ndarray) -> Solution:
    """equations : one for each trial. What none of them is about stays as before the data."""
    times, against = np.zeros(len(root), dtype=int), np.zeros(len(root))
    for one in equations:
        times[one.used] += 1
        against[one.used] += one.against
    (shared,) = np.nonzero(times > 1)
    precision, trials = np.eye(len(shared)), []
    for one in equations:
        own = times[one.used] == 1
        gram = one.gram * np.outer(root[one.used], root[one.used])
        inverse = _inverse_factor(gram[own][:, own] + np.eye(own.sum()))
        across, others = inverse @ gram[own][:, ~own], np.searchsorted(shared, one.used[~own])
        precision[np.ix_(others, others)] += gram[~own][:, ~own] - across.T @ across
        trials.append(_Eliminated(one.used, own, inverse, across, others))
    return Solution(root, against, tuple(trials), shared, _inverse_factor(precision))


def _inverse_factor(precision: np.ndarray) -> np.ndarray:
    """(k, k) lower triangle L, the inverse of ``precision`` being L' L."""
    if not len(precision):
        return precision
    upper, _ = dtrtri(np.linalg.cholesky(precision).T, overwrite_c=1)
    return upper.T
