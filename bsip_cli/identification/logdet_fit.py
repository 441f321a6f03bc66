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
        divergence = float(pseudo_inertia.divergences(self.phi(x), self.table).sum())
        return float(0.5 * x @ self.quadratic @ x - self.linear @ x) + self.gamma * divergence

    def gradient(self, x: np.ndarray) -> np.ndarray:
        slope = pseudo_inertia.gradient(self.phi(x), self.table)
        return self.quadratic @ x - self.linear + self.gamma * self.shown.T @ slope

    def hessian(self, x: np.ndarray) -> np.ndarray:
        curvature = pseudo_inertia.hessian(self.phi(x))
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

    Raises
    ------
    NumericalError
        The equations hold values that are not finite.
    """
    x = np.zeros_like(objective.linear) if start is None else start
    value = objective.value(x)
    steps = 0
    while steps < _STEPS:
        slope, (scale, factor) = objective.gradient(x), _factor(objective.hessian(x))
        step = -scale * cho_solve(factor, scale * slope)
        promise = float(-slope @ step)
        if promise <= _LAST * (1.0 + abs(value)):
            x = x + step if pseudo_inertia.are_physical(objective.phi(x + step)) else x
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


def _factor(matrix: np.ndarray) -> tuple[np.ndarray, tuple]:
    """Scale (n,) and Cholesky factor of the matrix scaled to a unit diagonal.

    Beside a segment that the data press flat, rounding may hide the rest: then a little is added to
    the diagonal, which shortens the step and changes no optimum.
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
