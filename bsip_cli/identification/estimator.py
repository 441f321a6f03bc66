"""The interface of the estimators and what they return."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bsip_cli.dynamics.base_parameters import Basis
from bsip_cli.identification.equations import Noise, NormalEquations
from bsip_cli.identification.prior import Prior


@dataclass(frozen=True)
class Problem:
    """Everything an estimator may use.

    The next three are options of [identify]: how many times worse the data are than they look; the
    sigma% below which a base parameter counts; and how many deviations as large as [prior] says
    count with this person's own. ``whole``: the equations before the wrench of segments that keep
    the table's values was taken off; None where no segment does. ``jointly``: the equations with
    the instruments' columns after the parameters.
    """

    equations: NormalEquations
    noise: Noise
    prior: Prior
    basis: Basis
    trust_ratio: float
    sigma_percent_limit: float = 5.0
    spread_weight: float = 4.0
    whole: NormalEquations | None = None
    jointly: NormalEquations | None = None

    def every_equation(self) -> NormalEquations:
        """Those of all segments' parameters."""
        return self.equations if self.whole is None else self.whole

    def trusted_equations(self) -> tuple[np.ndarray, np.ndarray]:
        """Information (P, P) and right side (P,), each component in its noise as it is trusted."""
        return self.equations.weighted(self.noise.weights() / self.trust_ratio**2)

    def trusted_with_instruments(self) -> tuple[np.ndarray, np.ndarray]:
        """The same (P + m, P + m) and (P + m,) with the m columns of the instruments, if any."""
        equations = self.jointly or self.equations
        return equations.weighted(self.noise.weights() / self.trust_ratio**2)


@dataclass(frozen=True, eq=False)
class Estimate:
    """Parameters (P,) about the joint centres, their covariance (P, P), and a note for people.

    ``prior_covariance`` (P, P) where the estimator weighs the prior itself: what the data share is
    counted from.
    """

    phi: np.ndarray
    covariance: np.ndarray
    note: str
    prior_covariance: np.ndarray | None = None

    def residual_rms(self, problem: Problem) -> np.ndarray:
        """(6,) residual [N, N m] that the estimate leaves in its own data."""
        return problem.every_equation().residual_rms(self.phi)


Estimator = Callable[[Problem], Estimate]
