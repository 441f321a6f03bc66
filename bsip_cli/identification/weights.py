"""How much each part of the prior counts beside the data, from the data themselves.

The weights are those of the largest marginal likelihood of the measured wrench, by Laplace's
approximation. The spreads follow MacKay's rule (1992, Bayesian interpolation): a spread is the
mean square of the deviations over the number of them that the data decided; the option
``spread_weight`` says how many deviations as large as [prior] says count beside them, so that
little data leave [prior] as it is. Masses share one spread and centres of mass another, neither
wider than [prior] says; the tensors of a pair of limbs, or of a segment of the midline, have their
own, because a table may miss a single one by far (Dumas 2007's trunk). Where the plates are and
when they read are two spreads more. The log-det weight is the best of a grid.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bsip_cli.identification import pseudo_inertia
from bsip_cli.identification.estimator import Problem
from bsip_cli.identification.instruments import GROUPS
from bsip_cli.identification.logdet_fit import Objective, Optimum, minimise
from bsip_cli.identification.prior import Prior

_MASS, _CENTRE, _TENSOR = (0,), (1, 2, 3), (4, 5, 6, 7, 8, 9)  # of the readable parameters
_NEVER_WIDER = slice(0, 2)  # of the spreads: masses, centres
# At 6 the log-det term alone would spread people about as [prior] does. From a mere barrier to half
# of that: it shapes what [prior] spreads, and little data must not make it a narrower prior.
_GAMMAS = (0.03, 0.1, 0.3, 1.0, 3.0)
_ROUNDS = 20
_SETTLED = 0.02  # relative change of the weights
_LARGEST_CHANGE = 4.0  # per round


@dataclass(frozen=True, eq=False)
class Terms:
    """The sums behind the objective, in coordinates x in which people scatter as N(0, 1) as [prior]
    says, along the directions that the data show from best to not at all: in the parameters' own
    units rounding would hide what the prior says about the latter.

    strength, right : of the weighted wrench residual 1/2 x^T diag(strength) x - right^T x.
    spreads : precision of all masses, of all centres of mass, of each pair's tensors, and of the
    instruments; fixed : that of the total mass, which keeps its weight. phi = table + shown x, and
    beside x (m,) is what the instruments do wrong.
    """

    strength: np.ndarray
    right: np.ndarray
    spreads: tuple[np.ndarray, ...]
    fixed: np.ndarray
    shown: np.ndarray
    beside: np.ndarray
    table: np.ndarray
    spread_weight: float


@dataclass(frozen=True, eq=False)
class Weights:
    """Of the deviations, one per spread, 1 as the options say, and of the log-det term."""

    spread: np.ndarray
    gamma: float


@dataclass(frozen=True, eq=False)
class Fit:
    """Optimum with its weights, its evidence, the covariance before the data, and how many of the
    body's parameters the data decided."""

    weights: Weights
    optimum: Optimum
    evidence: float
    prior_covariance: np.ndarray
    decided: float


def terms_of(problem: Problem) -> Terms:
    """Normal equations and priors of a problem, about the table's values."""
    prior = problem.prior
    information, right = problem.trusted_with_instruments()
    size, beyond = len(prior.phi), len(right) - len(prior.phi)
    body = [np.pad(one, (0, beyond)) for one in (*_spreads(prior), _total_mass(prior))]
    spreads = (*body[:-1], *_of_instruments(size, beyond))
    root = _inverse_root(sum(spreads, body[-1]))
    strength, directions = np.linalg.eigh(root.T @ information @ root)
    axes = root @ directions
    return Terms(
        np.maximum(strength, 0.0),
        axes.T @ (right - information[:, :size] @ prior.phi),
        tuple(axes.T @ precision @ axes for precision in spreads),
        axes.T @ body[-1] @ axes,
        axes[:size],
        axes[size:],
        prior.phi,
        problem.spread_weight,
    )


def _inverse_root(precision: np.ndarray) -> np.ndarray:
    """R with R R^T the inverse of a matrix whose rows have different units."""
    scale = 1 / np.sqrt(np.diag(precision))
    lower = np.linalg.cholesky(precision * np.outer(scale, scale))
    return scale[:, None] * np.linalg.inv(lower).T


def _spreads(prior: Prior) -> tuple[np.ndarray, ...]:
    """Precision of all masses, all centres of mass, and the tensors of every pair."""
    every = tuple(range(len(prior.inertias)))
    groups = [(every, _MASS), (every, _CENTRE), *((pair, _TENSOR) for pair in prior.pairs)]
    return tuple(_precision_of(prior, *group) for group in groups)


def _of_instruments(size: int, beyond: int) -> Iterator[np.ndarray]:
    """Precision of where the plates are and of when they read, behind ``size`` parameters."""
    for part in GROUPS if beyond else ():
        on = np.zeros(size + beyond)
        on[size:][part] = 1.0
        yield np.diag(on)


def _precision_of(prior: Prior, segments: tuple[int, ...], members: tuple[int, ...]) -> np.ndarray:
    rows = prior.white[[10 * i + k for i in segments for k in members]]
    return rows.T @ rows


def _total_mass(prior: Prior) -> np.ndarray:
    masses = np.zeros(prior.phi.size)
    masses[::10] = np.where(prior.fixed, 0.0, 1 / prior.total_mass_sd_kg)
    return np.outer(masses, masses)


def objective_of(terms: Terms, weights: Weights) -> Objective:
    """The convex problem for given weights."""
    return Objective(
        np.diag(terms.strength) + _precision(terms, weights),
        terms.right,
        terms.shown,
        terms.table,
        weights.gamma,
    )


def _precision(terms: Terms, weights: Weights) -> np.ndarray:
    weighted = (w * p for w, p in zip(weights.spread, terms.spreads, strict=True))
    return sum(weighted, terms.fixed)


def fit_with_weights(terms: Terms) -> Fit:
    """The fit of the largest evidence over the grid of log-det weights."""
    best: Fit | None = None
    spread = np.ones(len(terms.spreads))
    for gamma in _GAMMAS:
        fit = _settled(terms, Weights(spread, gamma), best)
        if best is None or fit.evidence > best.evidence:
            best, spread = fit, fit.weights.spread
    assert best is not None
    return best


def _settled(terms: Terms, weights: Weights, near: Fit | None) -> Fit:
    """Spreads that no longer change, for one log-det weight."""
    fit = fit_at(terms, weights, near)
    for _ in range(_ROUNDS):
        spread = _updated(terms, fit)
        change = np.log(spread / fit.weights.spread)
        fit = fit_at(terms, Weights(spread, weights.gamma), fit)
        if np.abs(change).max() < _SETTLED:
            break
    return fit


def fit_at(terms: Terms, weights: Weights, near: Fit | None = None) -> Fit:
    """Optimum and evidence for given weights."""
    optimum = minimise(objective_of(terms, weights), near.optimum.x if near else None)
    curvature = pseudo_inertia.hessian(terms.table)
    before = _precision(terms, weights) + weights.gamma * terms.shown.T @ curvature @ terms.shown
    evidence = (
        -optimum.value
        + 0.5 * np.linalg.slogdet(optimum.covariance)[1]
        + 0.5 * np.linalg.slogdet(before)[1]
    )
    root = _inverse_root(before)
    covariance = root @ root.T
    decided = np.trace(np.eye(len(root)) - np.linalg.solve(covariance, optimum.covariance))
    # Beforehand nothing ties the instruments to the body or to each other: their share comes off.
    kept, known = (_variances(terms.beside, one) for one in (optimum.covariance, covariance))
    decided = max(float(decided - (1 - kept / known).sum()), 0.0)
    return Fit(weights, optimum, float(evidence), covariance, decided)


def _variances(rows: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    return np.sum(rows @ covariance * rows, axis=1)


def _updated(terms: Terms, fit: Fit) -> np.ndarray:
    """MacKay's rule for the spreads."""
    x, old, count = fit.optimum.x, fit.weights.spread, terms.spread_weight
    removed = fit.prior_covariance - fit.optimum.covariance
    spread = np.array(
        [
            (count + max(weight * np.sum(removed * precision), 0.0)) / (count + x @ precision @ x)
            for weight, precision in zip(old, terms.spreads, strict=True)
        ]
    )
    spread = np.clip(spread, old / _LARGEST_CHANGE, old * _LARGEST_CHANGE)
    spread[_NEVER_WIDER] = np.maximum(spread[_NEVER_WIDER], 1.0)
    return spread
