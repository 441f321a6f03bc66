"""How much each part of the prior and the data count, from the data themselves.

The weights are those of the largest marginal likelihood of the measured wrench, by Laplace's
approximation. The spreads follow MacKay's rule (1992, Bayesian interpolation): a spread is the
mean square of the deviations over the number of them that the data decided; the option
``spread_weight`` says how many deviations as large as [prior] says count beside them, so that
little data leave [prior] as it is. The log-det weight is the best of a grid.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bsip_cli.body.inertia import readable_jacobian
from bsip_cli.identification import pseudo_inertia
from bsip_cli.identification.estimator import Problem
from bsip_cli.identification.logdet_fit import Objective, Optimum, minimise
from bsip_cli.identification.prior import Prior

_KINDS = (("masses", (0,)), ("centres", (1, 2, 3)), ("tensors", (4, 5, 6, 7, 8, 9)))
# 6 is about the weight at which the log-det term alone spreads people as [prior] does; from far
# below, where it is a mere barrier, to far above.
_GAMMAS = (0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0)
_ROUNDS = 20
_SETTLED = 0.02  # relative change of the weights
_LARGEST_CHANGE = 4.0  # per round


@dataclass(frozen=True)
class Terms:
    """The sums behind the objective, in steps x from the table and frame errors (P + 6 n).

    information, right, square : of the weighted wrench residual 1/2 (x^T A x - 2 b^T x + square)
    with ``effective`` independent samples. spreads : precision per kind in ``names``; fixed : what
    keeps its weight (total mass, frames). table (P,).
    """

    information: np.ndarray
    right: np.ndarray
    square: float
    effective: float
    names: tuple[str, ...]
    spreads: tuple[np.ndarray, ...]
    fixed: np.ndarray
    table: np.ndarray
    spread_weight: float


@dataclass(frozen=True)
class Weights:
    """Of the kinds of deviations (1 = as [prior] says), of the log-det term, and the factor by
    which the variance of the noise grows."""

    spread: np.ndarray
    gamma: float
    noise: float


@dataclass(frozen=True)
class Fit:
    """Optimum with its weights, its evidence, the covariance before the data, and how many
    parameters the data decided."""

    weights: Weights
    optimum: Optimum
    evidence: float
    prior_covariance: np.ndarray
    decided: float


def terms_of(problem: Problem) -> Terms:
    """Normal equations and priors of a problem, about the table's values."""
    prior, weights = problem.prior, problem.noise.weights()
    information, right = problem.equations.weighted(weights)
    slope = right - information @ prior.phi
    square = weights @ problem.equations.squares - prior.phi @ (right + slope)
    shown = np.hstack([np.eye(prior.phi.size), pseudo_inertia.frame_jacobian(prior.phi)])
    return Terms(
        shown.T @ information @ shown,
        shown.T @ slope,
        float(square),
        float(problem.noise.effective.sum()),
        tuple(name for name, _ in _KINDS),
        tuple(_spread(prior, members) for _, members in _KINDS),
        _fixed(prior, problem.frame_sd_m, problem.frame_sd_rad),
        prior.phi,
        problem.spread_weight,
    )


def _spread(prior: Prior, members: tuple[int, ...]) -> np.ndarray:
    """Precision of one kind of readable parameters, all segments, linearised about the table."""
    n = len(prior.inertias)
    out = np.zeros((16 * n, 16 * n))
    for i in range(n):
        block = slice(10 * i, 10 * i + 10)
        jacobian = readable_jacobian(prior.phi[block])[list(members)]
        scaled = jacobian / prior.spread_sd[i, list(members), None]
        out[block, block] = scaled.T @ scaled
    return out


def _fixed(prior: Prior, frame_sd_m: float, frame_sd_rad: float) -> np.ndarray:
    n = len(prior.inertias)
    frames = np.tile([frame_sd_m] * 3 + [frame_sd_rad] * 3, n)
    out = np.diag(np.concatenate([np.zeros(10 * n), 1 / frames**2]))
    masses = np.zeros(16 * n)
    masses[: 10 * n : 10] = 1 / prior.total_mass_sd_kg
    return out + np.outer(masses, masses)


def objective_of(terms: Terms, weights: Weights) -> Objective:
    """The convex problem for given weights."""
    return Objective(
        terms.information / weights.noise + _precision(terms, weights),
        terms.right / weights.noise,
        terms.table,
        weights.gamma,
    )


def _precision(terms: Terms, weights: Weights) -> np.ndarray:
    return terms.fixed + sum(w * p for w, p in zip(weights.spread, terms.spreads, strict=True))


def fit_with_weights(terms: Terms) -> Fit:
    """The fit of the largest evidence over the grid of log-det weights."""
    best: Fit | None = None
    start = Weights(np.ones(len(terms.spreads)), _GAMMAS[0], 1.0)
    for gamma in _GAMMAS:
        fit = _settled(terms, Weights(start.spread, gamma, start.noise), best)
        if best is None or fit.evidence > best.evidence:
            best, start = fit, fit.weights
    assert best is not None
    return best


def _settled(terms: Terms, weights: Weights, near: Fit | None) -> Fit:
    """Weights of the spreads and the noise that no longer change, for one log-det weight."""
    fit = fit_at(terms, weights, near)
    for _ in range(_ROUNDS):
        spread, noise = _updated(terms, fit)
        change = np.append(spread / fit.weights.spread, noise / fit.weights.noise)
        fit = fit_at(terms, Weights(spread, weights.gamma, noise), fit)
        if np.abs(np.log(change)).max() < _SETTLED:
            break
    return fit


def fit_at(terms: Terms, weights: Weights, near: Fit | None = None) -> Fit:
    """Optimum and evidence for given weights."""
    optimum = minimise(objective_of(terms, weights), near.optimum.x if near else None)
    size = terms.table.size
    before = _precision(terms, weights)
    before[:size, :size] += weights.gamma * pseudo_inertia.hessian(terms.table)
    evidence = (
        -optimum.value
        - 0.5 * terms.square / weights.noise
        - 0.5 * terms.effective * np.log(weights.noise)
        + 0.5 * np.linalg.slogdet(optimum.covariance)[1]
        + 0.5 * np.linalg.slogdet(before)[1]
    )
    inverse = np.linalg.inv(before)
    decided = float(np.sum(optimum.covariance * terms.information) / weights.noise)
    return Fit(weights, optimum, float(evidence), inverse, decided)


def _updated(terms: Terms, fit: Fit) -> tuple[np.ndarray, float]:
    """MacKay's rule for the spreads, residual over degrees of freedom for the noise.

    The noise never shrinks: what the frames explain in the fit they may not explain elsewhere.
    """
    x, covariance, old = fit.optimum.x, fit.optimum.covariance, fit.weights.spread
    removed = fit.prior_covariance - covariance
    count = terms.spread_weight
    spread = np.array(
        [
            (count + max(weight * np.sum(removed * precision), 0.0)) / (count + x @ precision @ x)
            for weight, precision in zip(old, terms.spreads, strict=True)
        ]
    )
    spread = np.clip(spread, old / _LARGEST_CHANGE, old * _LARGEST_CHANGE)
    residual = terms.square - 2 * terms.right @ x + x @ terms.information @ x
    free = max(terms.effective - fit.decided, 1.0)
    noise = max(residual / free, 1.0)
    return spread, min(noise, fit.weights.noise * _LARGEST_CHANGE)
