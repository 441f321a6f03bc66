"""The interface of the estimators and what they return."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bsip_cli.dynamics.base_parameters import Basis
from bsip_cli.identification.equations import NormalEquations
from bsip_cli.identification.noise import Noise
from bsip_cli.identification.prior import Prior


@dataclass(frozen=True)
class Problem:
    """Everything an estimator may use.

    ``trust_ratio``: how many times better than the table the data must know a combination.
    """

    equations: NormalEquations
    noise: Noise
    prior: Prior
    basis: Basis
    trust_ratio: float


@dataclass(frozen=True)
class Estimate:
    """Parameters (P,) about the joint centres, their covariance (P, P), and a note for people."""

    phi: np.ndarray
    covariance: np.ndarray
    note: str

    def residual_rms(self, problem: Problem) -> np.ndarray:
        """(6,) residual [N, N m] that the estimate leaves in its own data."""
        return problem.equations.residual_rms(self.phi)


Estimator = Callable[[Problem], Estimate]
