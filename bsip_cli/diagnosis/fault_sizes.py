"""The likeliest sizes of one more fault beside a fit, and its moments, frequencies and windows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from bsip_cli.diagnosis.fault_model import SIZES, Fitted
from bsip_cli.diagnosis.hypothesis import Hypothesis

_SEARCH = 40  # evaluations for a moment, a frequency or a window
_STEPS = 8  # of Gauss and Newton
_HALVES = (1.0, 0.5, 0.25, 0.125)


@dataclass(frozen=True, eq=False)
class _Marginal:
    """Given the ordinary terms, of a fault at its values: squares of what is left, and pull (k,)
    and information (k, k) of its free parameters [typical]."""

    squares: float
    pull: np.ndarray
    information: np.ndarray


def _marginal(fit: Fitted, one: Hypothesis) -> _Marginal:
    session = fit.session
    free = one.is_free(session)
    against, squares = fit.sums[0].copy(), fit.sums[1]
    count = int(free.sum())
    shared = np.zeros((len(fit.mean), count))
    pull, gram = np.zeros(count), np.zeros((count, count))
    for t in one.trials:
        piece, trial = fit.pieces[t], session.trials[t]
        change = one.effect.change(trial.simulated, one.target, one.values)[..., None]
        slope = one.effect.tangent(trial.simulated, one.target, one.values)
        slope = slope * one.typical(session)[free]
        white = fit.whitened(t, trial.errors.filter(np.concatenate([change, slope], axis=2)))
        products = piece.white.T @ white
        left, mine = piece.right - white[:, 0], white[:, 1:]
        pull += mine.T @ left
        gram += mine.T @ mine
        shared[piece.used] += products[:, 1:]
        against[piece.used] -= products[:, 0]
        squares += float(left @ left - piece.right @ piece.right)
    mean = fit.covariance @ against
    return _Marginal(
        squares - float(against @ mean),
        pull - shared.T @ mean,
        gram - shared.T @ (fit.covariance @ shared),
    )


def sized(fit: Fitted, one: Hypothesis) -> Hypothesis:
    """Free parameters by Gauss and Newton, within their bounds; a step that does not help is
    halved."""
    session = fit.session
    free, now = one.is_free(session), _marginal(fit, one)
    typical = one.typical(session)[free]
    for _ in range(_STEPS):
        sizes = one.values[free] / typical
        weight = 1 / np.clip((sizes**2).mean(), SIZES[0] ** 2, SIZES[1] ** 2)
        ridge = now.information + weight * np.eye(len(sizes))
        step = np.linalg.solve(ridge, now.pull - weight * sizes)
        tried = ((x, _marginal(fit, x)) for x in (one.moved(session, h * step) for h in _HALVES))
        better = next(((x, m) for x, m in tried if m.squares < now.squares), None)
        if better is None:
            return one
        before = now.squares
        one, now = better
        if before - now.squares < 0.1:  # of a squared residual whose noise is one
            return one
    return one


def refined(fit: Fitted, one: Hypothesis) -> Hypothesis:
    """Scanned parameters moved to where the fault explains most."""
    session = fit.session
    scanned = ~one.is_free(session)
    if not scanned.any():
        return one
    scale = one.effect.spacing(one.scene(session), one.target, one.values)

    def at(x: np.ndarray) -> Hypothesis:
        values = np.where(scanned, one.values, 0.0)
        values[scanned] += x * scale
        return one.with_values(session, values)

    def of(x: np.ndarray) -> tuple[np.ndarray, _Marginal]:
        told = _marginal(fit, at(x))
        ridge = told.information + np.eye(len(told.pull)) / SIZES[1] ** 2
        return np.linalg.solve(ridge, told.pull), told

    def left(x: np.ndarray) -> float:
        size, told = of(x)
        return -float(told.pull @ size)

    start = np.zeros(int(scanned.sum()))
    simplex = {"initial_simplex": np.vstack([start, np.eye(len(start))])}
    options = {**simplex, "maxfev": _SEARCH, "xatol": 0.02, "fatol": 0.1}
    found = minimize(left, start, method="Nelder-Mead", options=options)
    return at(found.x).moved(session, of(found.x)[0])
