"""Estimator ``consistent``: bodies that can exist, near to RM, that explain the wrench.

Least squares on the wrench, regularised by the log-det (Bregman) divergence of every segment's
pseudo-inertia from the table's (Wensing 2018, Lee 2020, Rucker 2022) and by the spread of people
about the table, the sum of the masses tied to the scale. Every segment is physically possible with
any data. Errors of the kinematics follow the movement and look like parameters, so the data are
trusted less than their residual says (``trust_ratio``). How far this person strays from the table
in masses, centres and tensors and the weight of the log-det term follow from the data
(``weights``).
"""

from __future__ import annotations

import numpy as np

from bsip_cli.identification.estimator import Estimate, Problem
from bsip_cli.identification.weights import Fit, Terms, fit_with_weights, terms_of

# Decided parameters: a sequence that moves everything decides 26 to 41, some squats 8 to 12.
_LITTLE = 20.0


def estimate(problem: Problem) -> Estimate:
    """Parameters at the optimum with the likeliest weights, covariance by Laplace.

    The covariance is the inverse Hessian; before the data it is that of the same weights, so that
    a narrower prior does not count as knowledge from the wrench.
    """
    terms = terms_of(problem)
    fit = fit_with_weights(terms)
    shown = terms.shown
    return Estimate(
        terms.table + shown @ fit.optimum.x,
        shown @ fit.optimum.covariance @ shown.T,
        _note(fit, terms, 2 + len(problem.prior.pairs)),
        prior_covariance=shown @ fit.prior_covariance @ shown.T,
    )


def _note(fit: Fit, terms: Terms, of_the_body: int) -> str:
    """``of_the_body``: how many of the spreads are; those of the instruments come after them."""
    masses, centres, *tensors = 1 / np.sqrt(fit.weights.spread[:of_the_body])
    note = (
        f"the data decide as much as {fit.decided:.0f} of {terms.table.size} parameters, the table "
        "the rest; distance from the table in standard deviations among people: masses "
        f"{masses:.2f}, centres of mass {centres:.2f}, inertias "
        f"{min(tensors):.2f} to {max(tensors):.2f}"
    )
    if fit.decided < _LITTLE:
        note += (
            "; too little motion, or errors that hide what it tells (see the diagnosis): the "
            "parameters stay near the table (RM)"
        )
    return note
