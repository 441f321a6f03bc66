"""Faults inside the one model of the error: their evidence, sizes and uncertainty.

A fault is a term like the others (``error_model``): columns about the values that it has by now,
whose size before the data lies between a tenth and ten times what laboratories meet.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import minimize

from bsip_cli.diagnosis.error_model import WEIGHT, Noise, Session, left_by, noise_like
from bsip_cli.diagnosis.error_terms import FAULT
from bsip_cli.diagnosis.hypothesis import Hypothesis
from bsip_cli.diagnosis.normal_equations import Equations, Solution, solved

SIZES = (0.1, 10.0)  # of a fault, in what laboratories meet: two decades about it
_STEPS, _FEW_STEPS = 8, 2  # of expectation and maximisation
_ROUNDS = 12  # of what is left, at most
_STEADY = 0.01  # change of every scale
_CONVERGED = 0.3  # change of the logarithm of the evidence
_DIFFERENCE = 0.05  # of the typical size: a moment in time moves by a part of a frame at least
_CORRECTIONS = 3  # of the values about which the columns are
_EXACT = 0.02  # of the typical size
_SEARCH = 40  # evaluations for a moment, a frequency or a window
_NEWTON_STEPS = 8  # of Gauss and Newton
_HALVES = (1.0, 0.5, 0.25, 0.125)
_GIVEN = 1e-9  # spread of what the data do not move [typical]


def columns_of(one: Hypothesis, trial: int) -> tuple[np.ndarray, np.ndarray]:
    """Of a filtered trial about a fault's values: slope (n, 6, k) of its change by all parameters
    [typical], those with a scan counting as deviations from theirs; and offset (n, 6), the change
    less what the slope makes of the sizes."""
    errors, free, typical = one.session.trials[trial], one.is_free, one.typical
    scene, filter_, change = errors.simulated, errors.filter, one.filtered_change(errors)
    slope = np.zeros((*change.shape, len(typical)))
    slope[..., free] = filter_(one.effect.tangent(scene, one.target, one.values) * typical[free])
    for k in np.flatnonzero(~free):
        step = np.zeros(len(typical))
        step[k] = _DIFFERENCE * typical[k]
        ahead, behind = (
            one.effect.change(scene, one.target, one.values + sign * step) for sign in (1, -1)
        )
        slope[..., k] = filter_.one(ahead - behind) / (2 * _DIFFERENCE)
    return slope, change - slope[..., free] @ (one.values[free] / typical[free])


def _prior_root(one: Hypothesis) -> np.ndarray:
    """(k,) spreads before the data of all parameters [typical]: a scanned one may be anywhere."""
    spreads = [
        (p.most - p.least) / np.sqrt(12) / p.typical if p.scan else 1.0 for p in one.parameters
    ]
    return np.where([p.is_given for p in one.parameters], _GIVEN, spreads)


@dataclass(frozen=True, eq=False)
class Piece(Equations):
    """Of a trial, white under its noise: columns white (6 n, K'), residual right (6 n,)."""

    noise: Noise
    white: np.ndarray
    right: np.ndarray

    def left(self, mean: np.ndarray) -> np.ndarray:
        """(6 n,) white, what all terms leave of the trial with coefficients (K,)."""
        return self.right - self.white @ mean[self.used]

    def log_likelihood(self, mean: np.ndarray) -> float:
        """Of the trial with coefficients (K,), less a constant."""
        left = self.left(mean)
        return -0.5 * float(left @ left) - self.log_volume

    @property
    def log_volume(self) -> float:
        """Logarithm of the determinant that turns white noise to the trial's."""
        return len(self.right) / 6 * float(np.log(self.noise.size).sum())


@dataclass(frozen=True, eq=False)
class Fitted:
    """The model given some faults.

    faults : with their values; ``starts``: first coefficient of each, behind the ordinary ones.
    pieces : of the trials. solution : of all coefficients.
    log_likelihoods : (T,) of the trials at the mean. log_evidence : of all, natural logarithm.
    """

    session: Session
    faults: tuple[Hypothesis, ...]
    starts: tuple[int, ...]
    pieces: tuple[Piece, ...]
    solution: Solution
    log_likelihoods: np.ndarray
    log_evidence: float

    @property
    def mean(self) -> np.ndarray:
        """(K,) of all coefficients."""
        return self.solution.mean

    @property
    def root(self) -> np.ndarray:
        """(K,) standard deviations of all coefficients before the data."""
        return self.solution.root

    @cached_property
    def squares(self) -> float:
        """Of the white residuals."""
        return sum(float(one.right @ one.right) for one in self.pieces)

    def coefficients(self, number: int) -> slice:
        """Of a fault."""
        first = self.starts[number]
        return slice(first, first + len(self.faults[number].values))

    def covariance_of(self, number: int) -> np.ndarray:
        """(k, k) of the coefficients of a fault."""
        mine = self.coefficients(number)
        return self.solution.times(np.eye(len(self.mean))[:, mine])[mine]

    def values_at(self, number: int, mean: np.ndarray) -> np.ndarray:
        """(k,) all parameters of a fault, from coefficients (K,)."""
        one = self.faults[number]
        moved = one.values * ~one.is_free + mean[self.coefficients(number)] * one.typical
        return one.with_values(moved).values


def fitted(
    session: Session,
    faults: Sequence[Hypothesis],
    start: Fitted | None = None,
    whole: bool = True,
    same_noise: bool = False,
) -> Fitted:
    """Coefficients, scales and noise given faults with the values that these have by now.

    start : a fit with other faults to begin with. whole : until noise and scales converge;
    else the noise of trials alone whose faults are others, once. same_noise : that of ``start``.
    """
    rounds = _ROUNDS if whole else 1
    return _Fitting(session, tuple(faults), start).run(whole, 0 if same_noise else rounds)


def corrected(fit: Fitted) -> Fitted:
    """With the faults' columns about their likeliest values."""
    for _ in range(_CORRECTIONS if fit.faults else 0):
        faults = [
            replace(one, values=fit.values_at(k, fit.mean)) for k, one in enumerate(fit.faults)
        ]
        pairs = zip(faults, fit.faults, strict=True)
        if max(np.abs((x.values - one.values) / one.typical).max() for x, one in pairs) < _EXACT:
            break
        fit = fitted(fit.session, faults, start=fit)
    return fit


class _Fitting:
    """Noise and coefficients in turn."""

    def __init__(
        self, session: Session, faults: tuple[Hypothesis, ...], start: Fitted | None
    ) -> None:
        self.session, self.faults, self.start = session, faults, start
        ends = np.cumsum([session.count, *(len(one.values) for one in faults)])
        self.starts, self.count = tuple(ends[:-1].tolist()), int(ends[-1])
        ordinary = np.ones(session.count) if start is None else start.root[: session.count]
        self.root = np.concatenate([ordinary, *map(_prior_root, faults)])
        # The instruments are as far off as every laboratory has them: of the ordinary scales only
        # the others follow from the data.
        scales = session.scales.items()
        self.adapts = [mine for x, mine in scales if not x.startswith(FAULT) and len(mine)]
        pairs = zip(self.starts, faults, strict=True)
        self.free = [first + np.flatnonzero(one.is_free) for first, one in pairs]
        self.laid = [self._laid(t) for t in range(len(session.trials))]

    def _laid(self, trial: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Residual, columns and their coefficients, of a trial."""
        residual, offset = self.session.trials[trial].residual, np.zeros(())
        columns, used = [self.session.columns[trial]], [self.session.used[trial]]
        for first, one in zip(self.starts, self.faults, strict=True):
            if trial in one.trials:
                slope, its_offset = columns_of(one, trial)
                offset = offset + its_offset
                columns.append(slope)
                used.append(first + np.arange(slope.shape[2]))
        return residual - offset, np.concatenate(columns, axis=2), np.concatenate(used)

    def run(self, whole: bool, rounds: int) -> Fitted:
        trials = range(len(self.session.trials))
        changed = [self._is_changed(t) for t in trials]
        pieces = []
        for t in trials:
            if self.start is None:
                pieces.append(self._like(t, self.laid[t][0]))
            else:
                one = self.start.pieces[t]
                pieces.append(self._white(t, one.noise) if changed[t] else one)
        found = self._solved(pieces, whole)
        for _ in range(rounds):
            before = found
            for t in trials:
                if whole or changed[t]:  # with the noise that the fit leaves
                    left = left_by(*self.laid[t][:2], found.solution, t)[1]
                    pieces[t] = self._like(t, left)
            found = self._solved(pieces, whole)
            if abs(found.log_evidence - before.log_evidence) < _CONVERGED:
                break
        return found

    def _is_changed(self, trial: int) -> bool:
        """Whether other faults touch a trial than before, or their coefficients are others."""
        if self.start is None:
            return True
        mine, before = (
            [
                (first, one)
                for first, one in zip(x.starts, x.faults, strict=True)
                if trial in one.trials
            ]
            for x in (self, self.start)
        )
        return mine != before

    def _like(self, trial: int, left: np.ndarray) -> Piece:
        """Whitened by what may be left of a trial (n, 6)."""
        return self._white(trial, noise_like(self.session.trials[trial], left))

    def _white(self, trial: int, noise: Noise) -> Piece:
        residual, columns, used = self.laid[trial]
        white, right = noise.white(columns), noise.white(residual[..., None])[:, 0]
        return Piece(used, white.T @ white, white.T @ right, noise, white, right)

    def _solved(self, pieces: Sequence[Piece], whole: bool) -> Fitted:
        """Coefficients and scales of the largest evidence for given noise."""
        for _ in range(_STEPS if whole else _FEW_STEPS):
            before, self.root = self.root, self.root.copy()
            found = solved(pieces, before)
            second = found.mean**2 + found.variance
            for mine in self.adapts if whole else ():
                self.root[mine] = np.sqrt((WEIGHT + second[mine].sum()) / (WEIGHT + len(mine)))
            for mine in self.free:
                self.root[mine] = np.clip(np.sqrt(second[mine].mean()), *SIZES)
            if np.abs(self.root / before - 1).max() < _STEADY:
                break
        found = solved(pieces, self.root)
        log = 0.5 * float(found.against @ found.mean) - 0.5 * found.log_determinant
        log -= sum(0.5 * float(one.right @ one.right) + one.log_volume for one in pieces)
        scales = np.array([self.root[mine[0]] for mine in self.adapts])
        log -= 0.5 * WEIGHT * float((2 * np.log(scales) + 1 / scales**2 - 1).sum())
        each = np.array([one.log_likelihood(found.mean) for one in pieces])
        fixed = self.session, self.faults, self.starts, tuple(pieces)
        return Fitted(*fixed, found, each, log)


# --- the likeliest sizes of one more fault given a fit --------------------------------------------


@dataclass(frozen=True, eq=False)
class _Marginal:
    """Given the ordinary terms, of a fault at its values: squares of what is left, and pull (k,)
    and information (k, k) of its free parameters [typical]."""

    squares: float
    pull: np.ndarray
    information: np.ndarray


def _marginal(fit: Fitted, one: Hypothesis) -> _Marginal:
    free = one.is_free
    against, squares = fit.solution.against.copy(), fit.squares
    count = int(free.sum())
    shared = np.zeros((len(fit.mean), count))
    pull, gram = np.zeros(count), np.zeros((count, count))
    for t in one.trials:
        piece, errors = fit.pieces[t], fit.session.trials[t]
        change = one.change(errors.simulated)[..., None]
        slope = one.effect.tangent(errors.simulated, one.target, one.values) * one.typical[free]
        white = piece.noise.white(errors.filter(np.concatenate([change, slope], axis=2)))
        products = piece.white.T @ white
        left, mine = piece.right - white[:, 0], white[:, 1:]
        pull += mine.T @ left
        gram += mine.T @ mine
        shared[piece.used] += products[:, 1:]
        against[piece.used] -= products[:, 0]
        squares += float(left @ left - piece.right @ piece.right)
    found = fit.solution.times(np.column_stack([against, shared]))
    mean, across = found[:, 0], found[:, 1:]
    squares -= float(against @ mean)
    return _Marginal(squares, pull - shared.T @ mean, gram - shared.T @ across)


def sized(fit: Fitted, one: Hypothesis) -> Hypothesis:
    """Free parameters by Gauss and Newton, within their bounds; a step that does not help is
    halved."""
    free, now = one.is_free, _marginal(fit, one)
    for _ in range(_NEWTON_STEPS):
        sizes = one.values[free] / one.typical[free]
        weight = 1 / np.clip((sizes**2).mean(), SIZES[0] ** 2, SIZES[1] ** 2)
        ridge = now.information + weight * np.eye(len(sizes))
        step = np.linalg.solve(ridge, now.pull - weight * sizes)
        tried = ((x, _marginal(fit, x)) for x in (one.moved(h * step) for h in _HALVES))
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
    scanned = ~one.is_free
    if not scanned.any():
        return one
    scale = one.effect.spacing(one.scene, one.target, one.values)

    def at(x: np.ndarray) -> Hypothesis:
        values = np.where(scanned, one.values, 0.0)
        values[scanned] += x * scale
        return one.with_values(values)

    def of(x: np.ndarray) -> tuple[np.ndarray, float]:
        """Likeliest sizes there, and less what they explain."""
        scores = _marginal(fit, at(x))
        ridge = scores.information + np.eye(len(scores.pull)) / SIZES[1] ** 2
        size = np.linalg.solve(ridge, scores.pull)
        return size, -float(scores.pull @ size)

    start = np.zeros(int(scanned.sum()))
    simplex = {"initial_simplex": np.vstack([start, np.eye(len(start))])}
    options = {**simplex, "maxfev": _SEARCH, "xatol": 0.02, "fatol": 0.1}
    found = minimize(lambda x: of(x)[1], start, method="Nelder-Mead", options=options)
    return at(found.x).moved(of(found.x)[0])
