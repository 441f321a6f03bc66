"""The convex problem behind ``consistent``, and a damped Newton method for it.

minimise over x, with phi = phi_RM + shown x,
    1/2 x^T Q x - b^T x + gamma * sum over segments of the log-det divergence from the table
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from bsip_cli.errors import NumericalError
from bsip_cli.identification import pseudo_inertia

_STEPS = 60
_DECREMENT = 1e-12  # of the objective, relative to its size: Newton's own distance to the optimum
_ARMIJO = 1e-4
_SHORTEST = 1e-10


@dataclass(frozen=True)
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
        divergence = float(pseudo_inertia.divergences(self.phi(x), self.table).sum())
        return float(0.5 * x @ self.quadratic @ x - self.linear @ x) + self.gamma * divergence

    def gradient(self, x: np.ndarray) -> np.ndarray:
        slope = pseudo_inertia.gradient(self.phi(x), self.table)
        return self.quadratic @ x - self.linear + self.gamma * self.shown.T @ slope

    def hessian(self, x: np.ndarray) -> np.ndarray:
        curvature = pseudo_inertia.hessian(self.phi(x))
        return self.quadratic + self.gamma * self.shown.T @ curvature @ self.shown


@dataclass(frozen=True)
class Optimum:
    """x of the smallest value, that value, the inverse Hessian there, and Newton's steps."""

    x: np.ndarray
    value: float
    covariance: np.ndarray
    steps: int


def minimise(objective: Objective, start: np.ndarray | None = None) -> Optimum:
    """Damped Newton; the Cholesky factor of every J keeps the steps among possible bodies.

    Raises
    ------
    NumericalError
        The equations hold values that are not finite.
    """
    x = np.zeros_like(objective.linear) if start is None else start
    value = objective.value(x)
    for count in range(_STEPS):
        slope, (scale, factor) = objective.gradient(x), _factor(objective.hessian(x))
        step = -scale * cho_solve(factor, scale * slope)
        promise = float(-slope @ step)
        if promise <= _DECREMENT * (1.0 + abs(value)):
            break
        length = 1.0
        while length > _SHORTEST:
            candidate = objective.value(x + length * step)
            if candidate <= value - _ARMIJO * length * promise:
                break
            length *= 0.5
        else:
            break  # at the limit of the arithmetic
        x, value = x + length * step, candidate
    inverse = scale[:, None] * cho_solve(factor, np.diag(scale))
    return Optimum(x, value, 0.5 * (inverse + inverse.T), count)


def _factor(matrix: np.ndarray) -> tuple[np.ndarray, tuple]:
    """Scale (n,) and Cholesky factor of the matrix scaled to a unit diagonal."""
    scale = 1.0 / np.sqrt(np.diag(matrix))
    try:
        return scale, cho_factor(matrix * np.outer(scale, scale))
    except (np.linalg.LinAlgError, ValueError) as error:
        raise NumericalError(
            f"the normal equations cannot be solved ({error})",
            expected="finite motion and forces",
            remedy="look at the kinematics and the wrench of the identification trial",
        ) from None
