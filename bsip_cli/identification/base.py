"""Estimator ``base``: base parameters by weighted least squares (Hansen 2017, equation 7).

Only combinations are estimated. As segment parameters stands the person nearest to the table that
has them, which may be one whom no body has: they serve to predict the wrench, not to be read.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bsip_cli.identification.problem import Estimate, Problem

# The table enters with this part of its weight, so that a combination the motion never excited
# gets a large standard deviation instead of stopping the rest.
_TRACE_OF_PRIOR = 1e-8


@dataclass(frozen=True, eq=False)
class BaseParameters:
    """values (rank,), covariance (rank, rank) and the regression's values (rank,)."""

    values: np.ndarray
    covariance: np.ndarray
    rm_values: np.ndarray

    def sigma_percent(self) -> np.ndarray:
        """(rank,) 100 sd / |value|."""
        return 100 * np.sqrt(np.diag(self.covariance)) / np.maximum(np.abs(self.values), 1e-300)


def base_parameters(problem: Problem) -> BaseParameters:
    """Weighted least squares in the basis; the covariance counts independent samples only."""
    basis, prior = problem.basis, problem.prior
    information, right = problem.equations.weighted(problem.noise.weights())
    rm_values = basis.combine @ prior.phi
    # Steps from RM, in units in which people scatter as N(0, 1) and across what no wrench shows:
    # in the parameters' own units the normal equations are so ill-conditioned that digits are lost.
    shown, triangle = np.linalg.qr((basis.combine @ prior.root).T)
    spread, units = prior.root @ shown, triangle.T
    matrix = spread.T @ information @ spread + _TRACE_OF_PRIOR * np.eye(basis.rank)
    inverse = np.linalg.inv(matrix)
    steps = np.linalg.solve(matrix, spread.T @ (right - information @ prior.phi))
    return BaseParameters(rm_values + units @ steps, units @ inverse @ units.T, rm_values)


def estimate(problem: Problem) -> Estimate:
    """The smallest step from the table, in how far people stray, with these combinations.

    What no wrench shows keeps the table's spread.
    """
    fit = base_parameters(problem)
    prior, combine = problem.prior, problem.basis.combine
    step = np.linalg.pinv(combine @ prior.root)
    z = step @ (fit.values - fit.rm_values)
    hidden = prior.root @ (np.eye(prior.phi.size) - step @ combine @ prior.root)
    shown = prior.root @ step
    return Estimate(
        prior.phi + prior.root @ z,
        shown @ fit.covariance @ shown.T + hidden @ hidden.T,
        "combinations only: single segments are not to be read",
    )
