"""Estimator ``consistent``: bodies that can exist, near to RM, that explain the wrench.

Least squares on the wrench, regularised by the log-det (Bregman) divergence of every segment's
pseudo-inertia from the table's (Wensing 2018, Lee 2020, Rucker 2022) and by the spread of people
about the table, the sum of the masses tied to the scale. Every segment is physically possible with
any data. Two things keep the data from being trusted too far:

- Frames. The model knows where a segment's joint lies to a centimetre only, and a segment that
  sits elsewhere in its frame looks in the wrench like one with another centre of mass. Each
  segment's shift and turn in its frame are estimated along, about zero.
- Weights. How far this person strays from the table in masses, centres and tensors, the weight of
  the log-det term and an inflation of the noise follow from the data (``weights``).
"""

from __future__ import annotations

import numpy as np

from bsip_cli.identification.estimator import Estimate, Problem
from bsip_cli.identification.weights import Fit, Terms, fit_with_weights, terms_of

_LITTLE = 10.0  # decided parameters; fewer than the wrench of standing still shows


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
        _note(fit, terms),
        prior_covariance=shown @ fit.prior_covariance @ shown.T,
    )


def _note(fit: Fit, terms: Terms) -> str:
    masses, centres, *tensors = 100 / np.sqrt(fit.weights.spread)
    note = (
        f"the data decide {fit.decided:.0f} of {terms.table.size} parameters; this person's spread "
        f"as a part of [prior]'s: masses {masses:.0f} %, centres of mass {centres:.0f} %, tensors "
        f"{min(tensors):.0f} to {max(tensors):.0f} %; log-det weight {fit.weights.gamma:g}"
    )
    if fit.weights.noise > 1.0:
        note += f"; noise variance times {fit.weights.noise:.2f}"
    if fit.decided < _LITTLE:
        note += "; too little motion: the parameters stay near the table (RM)"
    return note
