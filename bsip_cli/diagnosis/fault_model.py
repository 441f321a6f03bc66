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

from bsip_cli.diagnosis.error_model import (
    WEIGHT,
    TrialErrors,
    laid_out,
    left_by,
    moments,
    posterior,
    white_noise_of,
)
from bsip_cli.diagnosis.error_terms import FAULT, as_simulated
from bsip_cli.diagnosis.hypothesis import Hypothesis
from bsip_cli.effects.scene import Scene

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


@dataclass(frozen=True, eq=False)
class FaultTrial:
    """A trial's errors, and its motion and plates at a slow rate, which faults see."""

    errors: TrialErrors
    scene: Scene

    @cached_property
    def simulated(self) -> Scene:
        """What faults change: plates that read what is simulated. Of what they measured, which
        holds the residual, every gain would explain a part of it. What comes late is as measured:
        the simulated signal lacks what is fast."""
        return self.scene.reading(as_simulated(self.scene).plates, self.scene.measured)

    @property
    def name(self) -> str:
        return self.errors.name


@dataclass(frozen=True, eq=False)
class Session:
    """All trials of a person, and the ordinary terms of the model laid out.

    used : per trial which coefficients its columns (n, 6, K') are about. count : of coefficients.
    adapts : those (k,) of each scale that follows from the data; the instruments are as far off as
    every laboratory has them.
    """

    trials: tuple[FaultTrial, ...]
    used: tuple[np.ndarray, ...]
    columns: tuple[np.ndarray, ...]
    count: int
    adapts: tuple[np.ndarray, ...]


def session_of(trials: Sequence[FaultTrial]) -> Session:
    """Lay out the ordinary terms of all trials."""
    laid = laid_out([one.errors for one in trials])
    scales: dict[str, list[np.ndarray]] = {}
    for part in laid.parts:
        if not part.scale.startswith(FAULT):
            scales.setdefault(part.scale, []).append(np.arange(part.start, part.stop))
    adapts = (np.concatenate(x) for x in scales.values())
    adapting = tuple(a for a in adapts if len(a))
    return Session(tuple(trials), laid.used, laid.columns, laid.count, adapting)


def columns_of(session: Session, one: Hypothesis, trial: int) -> tuple[np.ndarray, np.ndarray]:
    """Of a filtered trial about a fault's values: slope (n, 6, k) of its change by all parameters
    [typical], those with a scan counting as deviations from theirs; and offset (n, 6), the change
    less what the slope makes of the sizes."""
    scene, filter_ = session.trials[trial].simulated, session.trials[trial].errors.filter
    free, typical = one.is_free(session), one.typical(session)
    change = filter_.one(one.effect.change(scene, one.target, one.values))
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


def _prior_root(session: Session, one: Hypothesis) -> np.ndarray:
    """(k,) spreads before the data of all parameters [typical]: a scanned one may be anywhere."""
    spreads = [
        (p.most - p.least) / np.sqrt(12) / p.typical if p.scan else 1.0
        for p in one.parameters(session)
    ]
    return np.where([p.is_given for p in one.parameters(session)], _GIVEN, spreads)


@dataclass(frozen=True, eq=False)
class Piece:
    """A trial's equations, white under the noise of size (6,) and recursion (6, p).

    white (6 n, K'), right (6 n,) : columns about the coefficients ``used`` (K',), and residual.
    gram (K', K'), against (K',) : their products.
    """

    size: np.ndarray
    recursion: np.ndarray
    used: np.ndarray
    white: np.ndarray
    right: np.ndarray
    gram: np.ndarray
    against: np.ndarray

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
        return len(self.right) / 6 * float(np.log(self.size).sum())


@dataclass(frozen=True, eq=False)
class Fitted:
    """The model given some faults.

    faults : with their values; ``starts``: first coefficient of each, behind the ordinary ones.
    pieces : of the trials. root, mean (K,), covariance (K, K) : of all coefficients.
    log_likelihoods : (T,) of the trials at the mean. log_evidence : of all, natural logarithm.
    """

    session: Session
    faults: tuple[Hypothesis, ...]
    starts: tuple[int, ...]
    pieces: tuple[Piece, ...]
    root: np.ndarray
    mean: np.ndarray
    covariance: np.ndarray
    log_likelihoods: np.ndarray
    log_evidence: float

    def whitened(self, trial: int, columns: np.ndarray) -> np.ndarray:
        """(6 n, k) of filtered columns (n, 6, k) of a trial."""
        one, filter_ = self.pieces[trial], self.session.trials[trial].errors.filter
        return filter_.innovations(columns / one.size[:, None], one.recursion)

    @cached_property
    def sums(self) -> tuple[np.ndarray, float]:
        """(K,) products of all columns with the white residuals, and the squares of these."""
        against = summed(self.pieces, len(self.mean))[1]
        return against, sum(float(one.right @ one.right) for one in self.pieces)

    @cached_property
    def root_of_covariance(self) -> np.ndarray:
        """(K, K) lower triangle L, covariance L L'."""
        tiny = 1e-12 * np.trace(self.covariance) / len(self.covariance)
        return np.linalg.cholesky(self.covariance + tiny * np.eye(len(self.covariance)))

    def left(self, trial: int) -> np.ndarray:
        """(6 n,) white, what all terms leave of a trial."""
        return self.pieces[trial].left(self.mean)

    def touching(self, trial: int) -> list[tuple[int, Hypothesis]]:
        """Faults in a trial, with their first coefficients."""
        return _touching(self.starts, self.faults, trial)

    def coefficients(self, number: int) -> slice:
        """Of a fault."""
        first = self.starts[number]
        return slice(first, first + len(self.faults[number].values))

    def values_at(self, number: int, mean: np.ndarray) -> np.ndarray:
        """(k,) all parameters of a fault, from coefficients (K,)."""
        one = self.faults[number]
        free, typical = one.is_free(self.session), one.typical(self.session)
        moved = one.values * ~free + mean[self.coefficients(number)] * typical
        return one.with_values(self.session, moved).values


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
        values = [fit.values_at(k, fit.mean) for k in range(len(fit.faults))]
        steps = [
            np.abs((x - one.values) / one.typical(fit.session)).max()
            for x, one in zip(values, fit.faults, strict=True)
        ]
        if max(steps) < _EXACT:
            break
        faults = [replace(one, values=x) for x, one in zip(values, fit.faults, strict=True)]
        fit = fitted(fit.session, faults, start=fit)
    return fit


def _touching(
    starts: Sequence[int], faults: Sequence[Hypothesis], trial: int
) -> list[tuple[int, Hypothesis]]:
    return [(first, x) for first, x in zip(starts, faults, strict=True) if trial in x.trials]


class _Fitting:
    """Noise and coefficients in turn."""

    def __init__(
        self, session: Session, faults: tuple[Hypothesis, ...], start: Fitted | None
    ) -> None:
        self.session, self.faults, self.start = session, faults, start
        ends = np.cumsum([session.count, *(len(one.values) for one in faults)])
        self.starts, self.count = tuple(ends[:-1].tolist()), int(ends[-1])
        ordinary = np.ones(session.count) if start is None else start.root[: session.count]
        self.root = np.concatenate([ordinary, *(_prior_root(session, one) for one in faults)])
        self.free = [
            first + np.flatnonzero(one.is_free(session))
            for first, one in zip(self.starts, faults, strict=True)
        ]
        self.laid = [self._laid(t) for t in range(len(session.trials))]

    def _laid(self, trial: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Residual, columns and their coefficients, of a trial."""
        touching = _touching(self.starts, self.faults, trial)
        mine = [(first, *columns_of(self.session, one, trial)) for first, one in touching]
        at = [first + np.arange(slope.shape[2]) for first, slope, _ in mine]
        used = np.concatenate([self.session.used[trial], *at])
        columns = np.concatenate([self.session.columns[trial], *(x for _, x, _ in mine)], axis=2)
        residual = self.session.trials[trial].errors.residual
        return residual - sum((x for _, _, x in mine), np.zeros(())), columns, used

    def run(self, whole: bool, rounds: int) -> Fitted:
        start, trials = self.start, range(len(self.session.trials))
        changed = [
            start is None or _touching(self.starts, self.faults, t) != start.touching(t)
            for t in trials
        ]
        pieces = []
        for t in trials:
            if start is None:
                pieces.append(self._piece(t, self.laid[t][0]))
            else:
                one = start.pieces[t]
                pieces.append(self._white(t, one.size, one.recursion) if changed[t] else one)
        found = self._solved(pieces, whole)
        for _ in range(rounds):
            before = found
            for t in trials:
                if whole or changed[t]:  # with the noise that the fit leaves
                    left = left_by(*self.laid[t], found.mean, found.covariance)[1]
                    pieces[t] = self._piece(t, left)
            found = self._solved(pieces, whole)
            if abs(found.log_evidence - before.log_evidence) < _CONVERGED:
                break
        return found

    def _piece(self, trial: int, left: np.ndarray) -> Piece:
        """Whitened by what may be left of a trial (n, 6)."""
        return self._white(trial, *white_noise_of(self.session.trials[trial].errors, left))

    def _white(self, trial: int, size: np.ndarray, recursion: np.ndarray) -> Piece:
        filter_, (residual, columns, used) = (
            self.session.trials[trial].errors.filter,
            self.laid[trial],
        )
        white = filter_.innovations(columns / size[:, None], recursion)
        right = filter_.innovations((residual / size)[..., None], recursion)[:, 0]
        return Piece(size, recursion, used, white, right, white.T @ white, white.T @ right)

    def _solved(self, pieces: Sequence[Piece], whole: bool) -> Fitted:
        """Coefficients and scales of the largest evidence for given noise."""
        gram, against = summed(pieces, self.count)
        for _ in range(_STEPS if whole else _FEW_STEPS):
            before = self.root.copy()
            mean, variance = moments(gram, against, self.root)
            second = mean**2 + variance
            for mine in self.session.adapts if whole else ():
                self.root[mine] = np.sqrt((WEIGHT + second[mine].sum()) / (WEIGHT + len(mine)))
            for mine in self.free:
                self.root[mine] = np.clip(np.sqrt(second[mine].mean()), *SIZES)
            if np.abs(self.root / before - 1).max() < _STEADY:
                break
        mean, covariance = posterior(gram, against, self.root)
        inner = gram * np.outer(self.root, self.root) + np.eye(self.count)
        log = 0.5 * float(against @ mean) - 0.5 * float(np.linalg.slogdet(inner)[1])
        log -= sum(0.5 * float(one.right @ one.right) + one.log_volume for one in pieces)
        scales = np.array([self.root[mine[0]] for mine in self.session.adapts])
        log -= 0.5 * WEIGHT * float((2 * np.log(scales) + 1 / scales**2 - 1).sum())
        each = np.array([one.log_likelihood(mean) for one in pieces])
        copied = self.root.copy(), mean, covariance, each, log
        return Fitted(self.session, self.faults, self.starts, tuple(pieces), *copied)


def summed(pieces: Sequence[Piece], count: int) -> tuple[np.ndarray, np.ndarray]:
    """(K, K) and (K,) normal equations of some trials."""
    gram, against = np.zeros((count, count)), np.zeros(count)
    for one in pieces:
        gram[np.ix_(one.used, one.used)] += one.gram
        against[one.used] += one.against
    return gram, against


# --- the likeliest sizes of one more fault given a fit --------------------------------------------


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
    for _ in range(_NEWTON_STEPS):
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
        scores = _marginal(fit, at(x))
        ridge = scores.information + np.eye(len(scores.pull)) / SIZES[1] ** 2
        return np.linalg.solve(ridge, scores.pull), scores

    def left(x: np.ndarray) -> float:
        size, scores = of(x)
        return -float(scores.pull @ size)

    start = np.zeros(int(scanned.sum()))
    simplex = {"initial_simplex": np.vstack([start, np.eye(len(start))])}
    options = {**simplex, "maxfev": _SEARCH, "xatol": 0.02, "fatol": 0.1}
    found = minimize(left, start, method="Nelder-Mead", options=options)
    return at(found.x).moved(session, of(found.x)[0])
