"""Estimator ``robert2017``: nearest to RM, drawn to the base parameters that are well identified.

Robert 2017 solves the quadratic programme

    min |phi_RM - phi|^2 + alpha W (L phi - phi_b)^2   subject to masses > 0

over the base-parameter relations whose relative standard deviation sigma% is below a limit
(``identify.sigma_percent_limit``; 5 % in the paper). The paper leaves units and alpha open: here
every parameter counts in its own prior spread, and W is one over the variance that sigma% stands
for, with alpha = 1, so that table and relations count as what they are known to.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bsip_cli.identification.base import base_parameters
from bsip_cli.identification.hansen2017 import smallest
from bsip_cli.identification.problem import Estimate, Problem

_SMALLEST_MASS = 0.05  # of the table's


@dataclass(frozen=True, eq=False)
class Programme:
    """min 1/2 |z|^2 + 1/2 |relations z - targets|^2, every mass of table + spread z above floor.

    spread (P,) of each parameter on its own; relations (k, P) and targets (k,) in units of the
    relations' standard deviations; masses' floor (n,) [kg]; covariance (k, k) of the targets.
    """

    table: np.ndarray
    spread: np.ndarray
    relations: np.ndarray
    targets: np.ndarray
    floor: np.ndarray
    covariance: np.ndarray


def estimate(problem: Problem) -> Estimate:
    """The programme's solution; covariance of the same rule without its bounds.

    The errors of the relations hang together, and those of the people about the table too: the
    covariance is that of the linear rule under both, not the inverse Hessian of the programme,
    which knows neither.

    NumericalError: the solver finds no parameters with positive masses.
    """
    programme = programme_of(problem)
    z = solve(programme)
    count, size = programme.relations.shape
    relations, spread = programme.relations, programme.spread
    gain = np.linalg.solve(np.eye(size) + relations.T @ relations, relations.T)
    kept = spread[:, None] * (np.eye(size) - gain @ relations) / spread @ problem.prior.root
    drawn = spread[:, None] * gain
    covariance = kept @ kept.T + drawn @ programme.covariance @ drawn.T
    note = f"{count} of {problem.basis.rank} relations below {problem.sigma_percent_limit:g} %"
    return Estimate(programme.table + spread * z, covariance, note)


def programme_of(problem: Problem) -> Programme:
    """The relations that are sure enough, and everything in its own spread."""
    fit = base_parameters(problem)
    sure = fit.sigma_percent() < problem.sigma_percent_limit
    sd = np.sqrt(np.diag(fit.covariance))[sure]
    table = problem.prior.phi
    spread = np.linalg.norm(problem.prior.root, axis=1)
    return Programme(
        table,
        spread,
        problem.basis.combine[sure] * spread / sd[:, None],
        (fit.values - fit.rm_values)[sure] / sd,
        _SMALLEST_MASS * table[::10],
        fit.covariance[np.ix_(sure, sure)] / np.outer(sd, sd),
    )


def solve(programme: Programme) -> np.ndarray:
    """(P,) steps z from the table, in spreads."""
    # The relations are variables of their own: squared, their weights would cost half the digits.
    size, count = programme.table.size, len(programme.targets)
    relations = np.hstack([programme.relations, -np.eye(count)])
    bounds = np.hstack([-np.diag(programme.spread)[::10], np.zeros((size // 10, count))])
    limits = programme.table[::10] - programme.floor
    return smallest(relations, programme.targets, bounds, limits)[:size]
