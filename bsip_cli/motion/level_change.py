"""One change of level in an autocorrelated signal that also follows known columns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import chdtri, fdtrc

_ROUNDS = 4
_LARGEST_CORRELATION = 0.98
_LEAST_FREEDOM = 8
_LEAST_ERROR = 1e-6  # keeps columns that stand still from making the equations singular


@dataclass(frozen=True, eq=False)
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


@dataclass(frozen=True, eq=False)
class _Problem:
    """Sums over the samples z = [X, y] (n, 1 + k + d): the constant, the columns, the signal.

    Whitened by a correlation r, the sample at t is z[t] - r z[t - 1], the first one
    sqrt(1 - r^2) z[0]; so every product of whitened signals follows from these sums, and no
    correlation that is tried needs the samples again.

    Attributes
    ----------
    z : (n, 1 + k + d); ``of_x`` = 1 + k.
    squares, neighbours, ends : sums of z z', of z[t] z[t - 1]' and its transpose, and of the
        first and the last sample's z z'.
    places : (p,) where a step may be.
    after, beside : (p, 1 + k + d) sums of the samples from a place on, and of those from the
        places before and after it on.
    penalised : (1 + k, 1 + k) ones on the diagonal for the columns, zero for the constant.
    coefficient_sd : prior spread of the columns' coefficients.
    """

    z: np.ndarray
    of_x: int
    squares: np.ndarray
    neighbours: np.ndarray
    ends: np.ndarray
    places: np.ndarray
    after: np.ndarray
    beside: np.ndarray
    penalised: np.ndarray
    coefficient_sd: float

    def products(self, r: float) -> np.ndarray:
        """Sum of z z', whitened."""
        return (1.0 + r * r) * self.squares - r * self.neighbours - r * r * self.ends

    def with_steps(self, r: float) -> np.ndarray:
        """(p, 1 + k + d) products of z with a step at each place, both whitened."""
        return (1.0 + r * r) * self.after - r * self.beside + r * (1.0 - r) * self.z[-1]

    def prior(self, error: float) -> np.ndarray:
        """(1 + k, 1 + k) what the prior adds to the equations."""
        return self.penalised * (error / self.coefficient_sd) ** 2


def two_levels(y: np.ndarray, before: int, after: int) -> int:
    """Number of first samples of y (n, d) that differ most from the others, by least squares.

    before, after : samples at least on either side; n must be as many.
    """
    n = len(y)
    sizes = np.arange(before, n - after + 1)
    first = np.cumsum(y, axis=0)[sizes - 1]
    rest = y.sum(axis=0) - first
    between = (first**2 / sizes[:, None] + rest**2 / (n - sizes)[:, None]).sum(axis=1)
    return int(sizes[np.argmax(between)])


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
    problem = _problem(y, columns, places, coefficient_sd)
    correlation = 0.0
    error = max(float(np.median(np.abs(np.diff(y, axis=0)))), _LEAST_ERROR)
    for _ in range(_ROUNDS):
        found = _best(problem, correlation, error)
        if found is None:
            return None
        correlation = _correlation(problem, found, error)
        error = max(found.spread * np.sqrt(1.0 - correlation**2), _LEAST_ERROR)
    return _best(problem, correlation, error)


def _problem(
    y: np.ndarray, columns: np.ndarray, places: np.ndarray, coefficient_sd: float
) -> _Problem:
    z = np.concatenate([np.ones((len(y), 1)), columns, y], axis=1)
    z[:, 1:] -= z[:, 1:].mean(axis=0)
    follow = z[1:].T @ z[:-1]
    from_on = np.zeros((len(z) + 1, z.shape[1]))
    from_on[:-1] = np.cumsum(z[::-1], axis=0)[::-1]
    return _Problem(
        z,
        1 + columns.shape[1],
        z.T @ z,
        follow + follow.T,
        np.outer(z[0], z[0]) + np.outer(z[-1], z[-1]),
        places,
        from_on[places],
        from_on[places - 1] + from_on[places + 1],
        np.diag([0.0] + [1.0] * columns.shape[1]),
        coefficient_sd,
    )


def _best(problem: _Problem, correlation: float, error: float) -> LevelChange | None:
    n, x = len(problem.z), problem.of_x
    d = problem.z.shape[1] - x
    products, steps = problem.products(correlation), problem.with_steps(correlation)
    inverse = np.linalg.inv(products[:x, :x] + problem.prior(error))
    coefficients = inverse @ products[:x, x:]
    # What the columns leave of the signal and of the steps: the gain of each step follows.
    rest = steps[:, x:] - steps[:, :x] @ coefficients
    length = 1.0 + (1.0 - correlation) ** 2 * (n - 1 - problem.places)
    own = length - ((steps[:, :x] @ inverse) * steps[:, :x]).sum(axis=1)
    freedom = n - 1 - float((inverse * products[:x, :x]).sum())
    possible = own > 1e-3 * length
    if not possible.any() or freedom < _LEAST_FREEDOM:
        return None
    gain = np.where(possible, (rest**2).sum(axis=1) / np.where(possible, own, 1.0), -1.0)
    k = int(np.argmax(gain))
    # What the prior holds back of the columns counts among the errors.
    squares = float(np.trace(products[x:, x:]) - (coefficients * products[:x, x:]).sum())
    variance = max((squares - gain[k]) / (d * freedom), 1e-18)
    z2 = chdtri(d, max(fdtrc(d, d * freedom, gain[k] / variance / d), 1e-300))
    return LevelChange(
        at=int(problem.places[k]),
        step=rest[k] / own[k],
        step_sd=float(np.sqrt(variance / own[k])),
        spread=float(np.sqrt(variance / (1.0 - correlation**2))),
        z=float(np.sqrt(z2)),
    )


def _correlation(problem: _Problem, found: LevelChange, error: float) -> float:
    """Of neighbours among what columns and step leave, fitted as if there were none."""
    x = problem.of_x
    stepped = problem.z[:, x:].copy()
    stepped[found.at :] -= found.step
    X = problem.z[:, :x]
    system = problem.squares[:x, :x] + problem.prior(error)
    left = stepped - X @ np.linalg.solve(system, X.T @ stepped)
    power = float((left[:-1] ** 2).sum())
    value = float((left[1:] * left[:-1]).sum()) / power if power > 0 else 0.0
    return float(np.clip(value, 0.0, _LARGEST_CORRELATION))
