"""One change of level in an autocorrelated signal that also follows known columns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular
from scipy.special import chdtri, fdtrc

_ROUNDS = 4
_LARGEST_CORRELATION = 0.98
_LEAST_FREEDOM = 8
_LEAST_ERROR = 1e-6  # keeps columns that stand still from making the equations singular


@dataclass(frozen=True)
class LevelChange:
    """The most likely change of level of a signal.

    Attributes
    ----------
    at : index of the first sample at the new level.
    step : (d,) new level less old one, in the signal's unit.
    step_sd : standard deviation of the step, each direction.
    spread : standard deviation of what neither columns nor step explain, each direction.
    z : how unlikely the gain in likelihood is by chance at one place: the length of a normal
        vector of d directions that is as unlikely (so it counts the samples, as F does).
    """

    at: int
    step: np.ndarray
    step_sd: float
    spread: float
    z: float


@dataclass(frozen=True)
class _Problem:
    """y (n, d), columns with the constant first (n, 1 + k), and where a step may be."""

    y: np.ndarray
    X: np.ndarray
    places: np.ndarray
    coefficient_sd: float


def find_level_change(
    y: np.ndarray,
    columns: np.ndarray,
    coefficient_sd: float,
    least: int,
    at: int | None = None,
) -> LevelChange | None:
    """Generalised least squares of y (n, d) on a constant, columns (n, k) and one step.

    The error is autoregressive of order one; its correlation is estimated with the step in the
    model, or a step would look like correlation. A step that the columns could make as well gets
    a large standard deviation and no significance.

    Parameters
    ----------
    coefficient_sd : prior spread of the columns' coefficients: columns that show a small step of
        their own cannot explain a large one of the signal.
    least : samples at least on each side of the step.
    at : where the step is, or None to look for the place with the largest gain.

    Returns
    -------
    None where there are too few samples, or no place for a step.
    """
    n = len(y)
    places = np.arange(least, n - least + 1) if at is None else np.array([at])
    places = places[(places > 0) & (places < n)]
    if len(places) == 0 or n < _LEAST_FREEDOM + 2:
        return None
    X = np.concatenate([np.ones((n, 1)), columns - columns.mean(axis=0)], axis=1)
    problem = _Problem(y, X, places, coefficient_sd)
    correlation = 0.0
    error = max(float(np.median(np.abs(np.diff(y, axis=0)))), _LEAST_ERROR)
    for _ in range(_ROUNDS):
        found = _best(problem, correlation, error)
        if found is None:
            return None
        correlation = _correlation(problem, found, error)
        error = max(found.spread * np.sqrt(1.0 - correlation**2), _LEAST_ERROR)
    return _best(problem, correlation, error)


def _best(problem: _Problem, correlation: float, error: float) -> LevelChange | None:
    n, d = problem.y.shape
    white = _whitened(problem.y, correlation)
    Q = _basis(problem, correlation, error)
    free = white - Q[:n] @ (Q[:n].T @ white)
    # A step whitened is 1 at its place and 1 - correlation after it.
    rest = (1.0 - correlation) * _after(free) + free
    shadow = (1.0 - correlation) * _after(Q[:n]) + Q[:n]
    length = 1.0 + (1.0 - correlation) ** 2 * (n - 1 - np.arange(n))
    own = length - (shadow**2).sum(axis=1)
    places = problem.places[own[problem.places] > 1e-3 * length[problem.places]]
    freedom = n - 1 - float((Q[:n] ** 2).sum())
    if len(places) == 0 or freedom < _LEAST_FREEDOM:
        return None
    gain = (rest[places] ** 2).sum(axis=1) / own[places]
    k = int(places[np.argmax(gain)])
    # What the prior holds back of the columns counts among the errors: y'(I - QQ')y.
    squares = float((white**2).sum() - ((Q[:n].T @ white) ** 2).sum())
    variance = max((squares - gain.max()) / (d * freedom), 1e-18)
    z2 = chdtri(d, max(fdtrc(d, d * freedom, gain.max() / variance / d), 1e-300))
    return LevelChange(
        at=k,
        step=rest[k] / own[k],
        step_sd=float(np.sqrt(variance / own[k])),
        spread=float(np.sqrt(variance / (1.0 - correlation**2))),
        z=float(np.sqrt(z2)),
    )


def _basis(problem: _Problem, correlation: float, error: float) -> np.ndarray:
    """(n + k, 1 + k) orthonormal columns; the last k rows are the prior's."""
    k = problem.X.shape[1] - 1
    prior = np.concatenate([np.zeros((k, 1)), error / problem.coefficient_sd * np.eye(k)], axis=1)
    A = np.concatenate([_whitened(problem.X, correlation), prior])
    return solve_triangular(np.linalg.cholesky(A.T @ A), A.T, lower=True).T


def _correlation(problem: _Problem, found: LevelChange, error: float) -> float:
    n = len(problem.y)
    stepped = problem.y - (np.arange(n) >= found.at)[:, None] * found.step
    Q = _basis(problem, 0.0, error)[:n]
    left = stepped - Q @ (Q.T @ stepped)
    power = float((left[:-1] ** 2).sum())
    value = float((left[1:] * left[:-1]).sum()) / power if power > 0 else 0.0
    return float(np.clip(value, 0.0, _LARGEST_CORRELATION))


def _whitened(x: np.ndarray, correlation: float) -> np.ndarray:
    white = x.copy()
    white[1:] -= correlation * x[:-1]
    white[0] *= np.sqrt(1.0 - correlation**2)
    return white


def _after(x: np.ndarray) -> np.ndarray:
    """Sum of all later rows, for each row."""
    return np.cumsum(x[::-1], axis=0)[::-1] - x
