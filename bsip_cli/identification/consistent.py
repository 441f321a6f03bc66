"""Estimator ``consistent``: bodies that can exist, near to RM, that explain the wrench.

Least squares on the wrench, regularised by the log-det (Bregman) divergence of every segment's
pseudo-inertia from the table's (Wensing 2018, Lee 2020, Rucker 2022) and by the spread of people
about the table, the sum of the masses tied to the scale. Every segment is physically possible with
any data. Errors of the kinematics follow the movement and look like parameters, so the data are
trusted less than their residual says (``trust_ratio``). How far this person strays from the table
in centres and tensors and the weight of the log-det term follow from the data.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from scipy.linalg import block_diag, cho_factor, cho_solve

from bsip_cli.errors import NumericalError
from bsip_cli.identification.problem import INSTRUMENT_GROUPS, Estimate, Problem

# --- segments as pseudo-inertias, and the log-det divergence between them -------------------------

# The 4x4 pseudo-inertia of a segment is J = [[S, m c], [m c^T, m]], S the second moments of mass
# about the joint: a body can have these parameters exactly if J > 0 (Wensing, Kim and Slotine
# 2018). Parameters (10 n,) of n segments are in Pinocchio's order.

BASIS = np.array([pin.PseudoInertia.FromDynamicParameters(one).toMatrix() for one in np.eye(10)])
"""(10, 4, 4) derivative of J with respect to the ten parameters."""


def pseudo_inertias(phi: np.ndarray) -> np.ndarray:
    """(n, 4, 4) pseudo-inertias."""
    return np.einsum("nk,kij->nij", phi.reshape(-1, 10), BASIS)


def are_physical(phi: np.ndarray) -> bool:
    """Every segment is one that a body can have."""
    try:
        np.linalg.cholesky(pseudo_inertias(phi))
    except np.linalg.LinAlgError:
        return False
    return True


def divergences(phi: np.ndarray, table: np.ndarray) -> np.ndarray:
    """(n,) Bregman divergence of -log det: tr(J0^-1 J) - log det(J0^-1 J) - 4; inf if not J > 0."""
    if not are_physical(phi):
        return np.full(len(phi) // 10, np.inf)
    ratio = np.linalg.solve(pseudo_inertias(table), pseudo_inertias(phi))
    return np.einsum("nii->n", ratio) - np.linalg.slogdet(ratio)[1] - 4.0


def gradient(phi: np.ndarray, table: np.ndarray) -> np.ndarray:
    """(10 n,) of the sum of the divergences."""
    pull = np.linalg.inv(pseudo_inertias(table)) - np.linalg.inv(pseudo_inertias(phi))
    return np.einsum("nij,kji->nk", pull, BASIS).ravel()


def hessian(phi: np.ndarray) -> np.ndarray:
    """(10 n, 10 n) of the sum of the divergences, one block per segment, whatever the table."""
    turned = np.einsum("nij,kjl->nkil", np.linalg.inv(pseudo_inertias(phi)), BASIS)
    blocks = np.einsum("nkil,nmli->nkm", turned, turned)
    return block_diag(*blocks)


# --- the convex problem behind ``consistent``, and a damped Newton method for it ------------------

# minimise over x, with phi = phi_RM + shown x,
#     1/2 x^T Q x - b^T x + gamma * sum over segments of the log-det divergence from the table


_STEPS = 60
# A step that promises less than this part of the objective is the last: after it, Newton's
# quadratic convergence leaves nothing that the objective's own rounding would show.
_LAST = 1e-11
_RIDGES = (0.0, 1e-14, 1e-12, 1e-10, 1e-8, 1e-6)
_ARMIJO = 1e-4
_SHORTEST = 1e-10


@dataclass(frozen=True, eq=False)
class Objective:
    """quadratic (k, k), linear (k,), shown (P, k), table (P,) of J > 0, gamma > 0."""

    quadratic: np.ndarray
    linear: np.ndarray
    shown: np.ndarray
    table: np.ndarray
    gamma: float

    def phi(self, x: np.ndarray) -> np.ndarray:
        return self.table + self.shown @ x

    def value(self, x: np.ndarray) -> float:
        """Infinite where a segment is not physical."""
        divergence = float(divergences(self.phi(x), self.table).sum())
        return float(0.5 * x @ self.quadratic @ x - self.linear @ x) + self.gamma * divergence

    def gradient(self, x: np.ndarray) -> np.ndarray:
        pull = self.shown.T @ gradient(self.phi(x), self.table)
        return self.quadratic @ x - self.linear + self.gamma * pull

    def hessian(self, x: np.ndarray) -> np.ndarray:
        curvature = hessian(self.phi(x))
        return self.quadratic + self.gamma * self.shown.T @ curvature @ self.shown


@dataclass(frozen=True, eq=False)
class Optimum:
    """x of the smallest value, that value, the inverse Hessian there, and Newton's steps."""

    x: np.ndarray
    value: float
    covariance: np.ndarray
    steps: int


def minimise(objective: Objective, start: np.ndarray | None = None) -> Optimum:
    """Damped Newton; the Cholesky factor of every J keeps the steps among possible bodies.

    NumericalError: the equations hold values that are not finite.
    """
    x = np.zeros_like(objective.linear) if start is None else start
    value = objective.value(x)
    steps = 0
    while steps < _STEPS:
        slope, (scale, factor) = objective.gradient(x), _factor(objective.hessian(x))
        step = -scale * cho_solve(factor, scale * slope)
        promise = float(-slope @ step)
        if promise <= _LAST * (1.0 + abs(value)):
            x = x + step if are_physical(objective.phi(x + step)) else x
            break
        length = 1.0
        while length > _SHORTEST:
            candidate = objective.value(x + length * step)
            if candidate <= value - _ARMIJO * length * promise:
                break
            length *= 0.5
        else:
            break  # at the limit of the arithmetic
        x, value, steps = x + length * step, candidate, steps + 1
    inverse = scale[:, None] * cho_solve(factor, np.diag(scale))
    return Optimum(x, value, 0.5 * (inverse + inverse.T), steps)


def _factor(matrix: np.ndarray) -> tuple[np.ndarray, tuple[np.ndarray, bool]]:
    """Scale (n,) and Cholesky factor of the matrix scaled to a unit diagonal.

    Next to a segment that the data press flat, rounding may hide the rest: then a little is added
    to the diagonal, which shortens the step and changes no optimum.
    """
    scale = 1.0 / np.sqrt(np.diag(matrix))
    scaled = matrix * np.outer(scale, scale)
    for ridge in _RIDGES:
        try:
            return scale, cho_factor(scaled + ridge * np.eye(len(scale)))
        except np.linalg.LinAlgError:
            continue
        except ValueError:
            break
    raise NumericalError(
        "the normal equations of the identification cannot be solved",
        expected="finite motion and forces",
        remedy="look at the kinematics and the wrench of the identification trial",
    )


# --- how much each part of the prior counts against the data, from the data themselves ------------

# The weights are those of the largest marginal likelihood of the measured wrench, by Laplace's
# approximation. The spreads follow MacKay's rule (1992, Bayesian interpolation): a spread is the
# mean square of the deviations over the number of them that the data decided; the option
# ``spread_weight`` says how many deviations as large as [prior] says count against them, so that
# little data leave [prior] as it is. Centres of mass share one spread, never wider than [prior]
# says; the tensors of a pair of limbs, or of a segment of the midline, have their own, because a
# table may miss a single one by far (Dumas 2007's trunk). Masses keep that of [prior], which was
# measured: from one body's dozen it comes out too narrow. Where the plates are and when they read
# are two spreads more. The log-det weight is the best of a grid.


_MASS, _CENTRE, _TENSOR = (0,), (1, 2, 3), (4, 5, 6, 7, 8, 9)  # of the readable parameters
_CENTRES = 0  # of the spreads
# At 6 the log-det term alone would spread people about as [prior] does. From a mere barrier to half
# of that: it shapes what [prior] spreads, and little data must not make it a narrower prior.
_GAMMAS = (0.03, 0.1, 0.3, 1.0, 3.0)
_ROUNDS = 20
_CONVERGED = 0.02  # relative change of the weights
_LARGEST_CHANGE = 4.0  # per round


@dataclass(frozen=True, eq=False)
class Terms:
    """The sums behind the objective, in coordinates x in which people scatter as N(0, 1) as [prior]
    says, along the directions that the data show from best to not at all: in the parameters' own
    units rounding would hide what the prior says about the latter.

    strength, right : of the weighted wrench residual 1/2 x^T diag(strength) x - right^T x.
    spreads : precision of all centres of mass, of each pair's tensors, and of the instruments;
    fixed : of all masses and of their sum, which keep their weights. phi = table + shown x, and
    what the instruments do wrong is instruments x, of x (m,).
    """

    strength: np.ndarray
    right: np.ndarray
    spreads: tuple[np.ndarray, ...]
    fixed: np.ndarray
    shown: np.ndarray
    instruments: np.ndarray
    table: np.ndarray
    spread_weight: float


@dataclass(frozen=True, eq=False)
class Fit:
    """Optimum with its evidence, the covariance before the data, and how many of the body's
    parameters the data decided.

    spread : weights of the deviations, one per spread, 1 as the options say. gamma : that of the
    log-det term.
    """

    spread: np.ndarray
    gamma: float
    optimum: Optimum
    evidence: float
    prior_covariance: np.ndarray
    decided: float


def terms_of(problem: Problem) -> Terms:
    """Normal equations and priors of a problem, about the table's values."""
    prior = problem.prior
    equations = problem.jointly or problem.equations
    information, right = equations.weighted(problem.noise.weights() / problem.trust_ratio**2)
    size, beyond = len(prior.phi), len(right) - len(prior.phi)
    every = tuple(range(len(prior.inertias)))
    groups = [(every, _MASS), (every, _CENTRE), *((pair, _TENSOR) for pair in prior.pairs)]
    rows = [prior.white[[10 * i + k for i in pair for k in kind]] for pair, kind in groups]
    masses = np.zeros(size)
    masses[::10] = np.where(prior.fixed, 0.0, 1 / prior.total_mass_sd_kg)
    own, *body, total = (np.pad(x.T @ x, (0, beyond)) for x in (*rows, masses[None]))
    on = np.eye(size + beyond)[size:]  # of the instruments: where the plates are, when they read
    spreads = [*body, *(on[k].T @ on[k] for k in INSTRUMENT_GROUPS if beyond)]
    root = _inverse_root(sum(spreads, own + total))
    strength, directions = np.linalg.eigh(root.T @ information @ root)
    axes = root @ directions
    return Terms(
        np.maximum(strength, 0.0),
        axes.T @ (right - information[:, :size] @ prior.phi),
        tuple(axes.T @ precision @ axes for precision in spreads),
        axes.T @ (own + total) @ axes,
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


def objective_of(terms: Terms, spread: np.ndarray, gamma: float) -> Objective:
    """The convex problem for given weights."""
    quadratic = np.diag(terms.strength) + _precision(terms, spread)
    return Objective(quadratic, terms.right, terms.shown, terms.table, gamma)


def _precision(terms: Terms, spread: np.ndarray) -> np.ndarray:
    weighted = (w * p for w, p in zip(spread, terms.spreads, strict=True))
    return sum(weighted, terms.fixed)


def fit_with_weights(terms: Terms) -> Fit:
    """The fit of the largest evidence over the grid of log-det weights, each with spreads that no
    longer change."""
    best: Fit | None = None
    spread = np.ones(len(terms.spreads))
    for gamma in _GAMMAS:
        fit = fit_at(terms, spread, gamma, best)
        for _ in range(_ROUNDS):
            x, old = fit.optimum.x, fit.spread
            removed, count = fit.prior_covariance - fit.optimum.covariance, terms.spread_weight
            new = np.array(  # MacKay's rule
                [
                    (count + max(weight * np.sum(removed * precision), 0.0))
                    / (count + x @ precision @ x)
                    for weight, precision in zip(old, terms.spreads, strict=True)
                ]
            )
            new = np.clip(new, old / _LARGEST_CHANGE, old * _LARGEST_CHANGE)
            new[_CENTRES] = max(new[_CENTRES], 1.0)
            fit = fit_at(terms, new, gamma, fit)
            if np.abs(np.log(new / old)).max() < _CONVERGED:
                break
        if best is None or fit.evidence > best.evidence:
            best, spread = fit, fit.spread
    assert best is not None
    return best


def fit_at(terms: Terms, spread: np.ndarray, gamma: float, near: Fit | None = None) -> Fit:
    """Optimum and evidence for given weights."""
    optimum = minimise(objective_of(terms, spread, gamma), near.optimum.x if near else None)
    curvature = hessian(terms.table)
    before = _precision(terms, spread) + gamma * terms.shown.T @ curvature @ terms.shown
    logs = sum(np.linalg.slogdet(x)[1] for x in (optimum.covariance, before))
    root = _inverse_root(before)
    covariance = root @ root.T
    decided = np.trace(np.eye(len(root)) - np.linalg.solve(covariance, optimum.covariance))
    # Beforehand nothing ties the instruments to the body or to each other: their share comes off.
    kept, known = (
        np.sum(terms.instruments @ x * terms.instruments, axis=1)
        for x in (optimum.covariance, covariance)
    )
    decided = max(float(decided - (1 - kept / known).sum()), 0.0)
    return Fit(spread, gamma, optimum, float(0.5 * logs - optimum.value), covariance, decided)


# Decided parameters: a sequence that moves everything decides 26 to 41, some squats 8 to 12.
_LITTLE = 20.0


def estimate(problem: Problem) -> Estimate:
    """Parameters at the optimum with the likeliest weights, covariance by Laplace.

    The covariance is the inverse Hessian; before the data it is that of the same weights, so that
    a narrower prior does not count as knowledge from the wrench.
    """
    terms = terms_of(problem)
    fit, shown = fit_with_weights(terms), terms.shown
    of_the_body = fit.spread[: 1 + len(problem.prior.pairs)]  # the instruments' come after
    centres, *tensors = 1 / np.sqrt(of_the_body)
    note = (
        f"the data decide {fit.decided:.0f} of {terms.table.size} parameters, the table the rest; "
        f"centres of mass lie {centres:.2f} standard deviations among people from the table, "
        f"inertias {' to '.join(dict.fromkeys(f'{x:.2f}' for x in (min(tensors), max(tensors))))}"
    )
    if fit.decided < _LITTLE:
        note += "; too little motion, or errors that hide what it shows"
    return Estimate(
        terms.table + shown @ fit.optimum.x,
        shown @ fit.optimum.covariance @ shown.T,
        note,
        prior_covariance=shown @ fit.prior_covariance @ shown.T,
        decided=fit.decided,
    )
