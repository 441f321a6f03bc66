"""How rare an identified body is among people: all segments together, in the prior's spread."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from bsip_cli.identification.estimator import Estimate
from bsip_cli.identification.prior import Prior

RARE = 0.01  # 1 person in 100


@dataclass(frozen=True, eq=False)
class Rarity:
    """An identified body's squared distance z.z from the table, z being N(0, 1) among people.

    probability : part of people whose identified body would be as far or further. shares : (n,)
    of the distance by segment, their sum is 1; 0 for segments that keep the table's values.
    """

    distance: float
    probability: float
    shares: np.ndarray

    @property
    def is_rare(self) -> bool:
        return self.probability < RARE

    def farthest(self) -> list[int]:
        """The fewest segments that make half of the distance, the largest share first."""
        order = np.argsort(-self.shares)[: np.count_nonzero(self.shares)]
        return order[: int(np.searchsorted(self.shares[order].cumsum(), 0.5)) + 1].tolist()


def rarity_of(prior: Prior, estimate: Estimate) -> Rarity:
    """Of the free segments' parameters.

    An estimate is drawn to the table where the data are silent, so the distance of a true body,
    chi-square with as many degrees as parameters, would let everything pass. The distances of
    identified bodies of people are a sum of chi-squares weighted by what the data decide
    (:func:`_spread`), taken for one with the same mean and variance (Satterthwaite 1946).

    A segment's share is that of the standardised parameters nearest to its own (the corr-max
    transformation, Garthwaite and Koch 2016, Aust. N. Z. J. Stat. 58): with the masses' sum known,
    no segment can be put back alone.
    """
    free = ~prior.fixed_parameters()
    whiten = _whitening(prior.root[free])
    parts = np.zeros(len(free))
    parts[free] = (whiten @ (estimate.phi - prior.phi)[free]) ** 2
    distance = float(parts.sum())
    spread = _spread(estimate, free, whiten)
    mean, square = float(np.trace(spread)), float((spread**2).sum())
    probability = float(chi2.sf(distance * mean / square, mean**2 / square)) if mean > 0 else 1.0
    by_segment = parts.reshape(-1, 10).sum(axis=1)
    return Rarity(distance, probability, by_segment / distance if distance else by_segment)


def _whitening(root: np.ndarray) -> np.ndarray:
    """(F, F) from parameters of covariance ``root root^T`` to the nearest that are N(0, 1)."""
    sd = np.linalg.norm(root, axis=1)
    vectors, values, _ = np.linalg.svd(root / sd[:, None], full_matrices=False)
    return (vectors / values) @ vectors.T / sd


def _spread(estimate: Estimate, free: np.ndarray, whiten: np.ndarray) -> np.ndarray:
    """(F, F) covariance of the estimates of people, whitened.

    A body of people N(0, 1) is estimated as gain times itself, plus the data's errors.
    """
    after = whiten @ estimate.covariance[np.ix_(free, free)] @ whiten.T
    gain = np.eye(len(after)) - after
    if estimate.prior_covariance is not None:
        before = whiten @ estimate.prior_covariance[np.ix_(free, free)] @ whiten.T
        gain = np.eye(len(after)) - np.linalg.solve(before, after).T
    return gain @ (gain.T + after)
