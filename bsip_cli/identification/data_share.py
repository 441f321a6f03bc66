"""What a motion's information can tell of each segment, beside the table: its data share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bsip_cli.body.inertia import readable_jacobian
from bsip_cli.identification.estimator import Problem
from bsip_cli.identification.prior import Prior

_GROUPS = (("mass", slice(0, 1)), ("centre of mass", slice(1, 4)), ("inertia", slice(4, 10)))
_FROM_TABLE = 0.2


@dataclass(frozen=True, eq=False)
class Beforehand:
    """What is known before any wrench, about the table, in coordinates that scatter as N(0, 1).

    seen : (P, P) change of the parameters.
    readable : (P, P) change of mass, centre of mass and tensor of each segment that goes along, in
        units of their standard deviations.
    """

    seen: np.ndarray
    readable: np.ndarray

    def covariance(self, information: np.ndarray) -> np.ndarray:
        """(P, P) of the readable parameters, in units of their prior standard deviations.

        ``information`` (P, P) is the weighted sum of Y^T Y of the wrench's regressor.
        """
        left = np.eye(len(self.seen)) - self._removed(information)
        return self.readable @ left @ self.readable.T

    def share(self, information: np.ndarray) -> np.ndarray:
        """(n, 10) part of each parameter's prior variance that the information removes."""
        removed = np.sum(self.readable @ self._removed(information) * self.readable, axis=1)
        return removed.reshape(-1, 10)

    def wrench_variance(self, information: np.ndarray, motion: np.ndarray) -> float:
        """Sum of squares of the wrench that stays unknown in a motion of information ``motion``."""
        weight = self.seen.T @ motion @ self.seen
        return float(np.trace(weight) - np.sum(weight * self._removed(information)))

    def _removed(self, information: np.ndarray) -> np.ndarray:
        one = np.eye(len(self.seen))
        return one - np.linalg.inv(self.seen.T @ information @ self.seen + one)


def beforehand(problem: Problem) -> Beforehand:
    """The table's spread of a problem, linearised about the table."""
    return Beforehand(problem.prior.root, _readable(problem.prior))


def _readable(prior: Prior) -> np.ndarray:
    rows = np.empty_like(prior.root)
    for i, sd in enumerate(prior.readable_sd):
        block = slice(10 * i, 10 * i + 10)
        rows[block] = readable_jacobian(prior.phi[block]) @ prior.root[block] / sd[:, None]
    return rows


def in_words(share: np.ndarray) -> str:
    """One segment's data shares (10,) as people say them, the mean over each group's numbers."""
    return ", ".join(_group_in_words(name, float(share[part].mean())) for name, part in _GROUPS)


def _group_in_words(name: str, share: float) -> str:
    if share < _FROM_TABLE:
        return f"{name} from the table (prior {100 * (1 - share):.0f} %)"
    if share < 0.5:
        return f"{name}: prior {100 * (1 - share):.0f} %"
    return f"{name}: data {100 * share:.0f} %"
