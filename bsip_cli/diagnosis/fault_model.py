"""Faults inside the one model of the error: their evidence, sizes and uncertainty.

A fault is a term like the others (``error_model``): columns about the values that it has by now,
whose size before the data lies between a tenth and ten times what laboratories meet.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bsip_cli.diagnosis.error_model import (
    WEIGHT,
    TrialErrors,
    laid_out,
    left_by,
    moments,
    posterior,
    white_columns,
    white_noise_of,
)
from bsip_cli.diagnosis.error_terms import FAULT, as_simulated
from bsip_cli.diagnosis.hypothesis import Hypothesis
from bsip_cli.effects.scene import Scene

SIZES = (0.1, 10.0)  # of a fault, in what laboratories meet: two decades about it
_STEPS, _FEW_STEPS = 8, 2  # of expectation and maximisation
_ROUNDS = 12  # of what is left, at most
_STEADY = 0.01  # change of every scale
_SETTLED = 0.3  # change of the logarithm of the evidence
_DIFFERENCE = 0.05  # of the typical size: a moment in time moves by a part of a frame at least
_CORRECTIONS = 3  # of the values about which the columns are
_EXACT = 0.02  # of the typical size
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
        the simulated course lacks what is fast."""
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
    parts, used, columns, _, _ = laid_out([one.errors for one in trials])
    scales: dict[str, list[np.ndarray]] = {}
    for part in parts:
        if not part.scale.startswith(FAULT):
            scales.setdefault(part.scale, []).append(np.arange(part.start, part.stop))
    adapts = (np.concatenate(x) for x in scales.values())
    count = max(part.stop for part in parts)
    return Session(tuple(trials), used, columns, count, tuple(a for a in adapts if len(a)))


@dataclass(frozen=True, eq=False)
class FaultColumns:
    """Change (n, 6) of a filtered trial by a fault at its values, and its slope (n, 6, k) by all
    parameters [typical]; ``offset`` (n, 6) is the change less what the slope makes of the sizes."""

    change: np.ndarray
    slope: np.ndarray
    offset: np.ndarray


def columns_of(session: Session, one: Hypothesis, trial: int) -> FaultColumns:
    """About the values of a fault; parameters with a scan count as deviations from theirs."""
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
    offset = change - slope[..., free] @ (one.values[free] / typical[free])
    return FaultColumns(change, slope, offset)


def _prior_root(session: Session, one: Hypothesis) -> np.ndarray:
    """(k,) spreads before the data of all parameters [typical]: a scanned one may be anywhere."""
    spreads = [
        (p.most - p.least) / np.sqrt(12) / p.typical if p.scan else 1.0
        for p in one.parameters(session)
    ]
    return np.where([p.is_given for p in one.parameters(session)], _GIVEN, spreads)


@dataclass(frozen=True, eq=False)
class Piece:
    """A trial's equations, white beside the noise of size (6,) and recursion (6, p).

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

    def log_likelihood(self, mean: np.ndarray) -> float:
        """Of the trial with coefficients (K,), less a constant."""
        left = self.right - self.white @ mean[self.used]
        return -0.5 * float(left @ left) - self.log_volume

    @property
    def log_volume(self) -> float:
        """Logarithm of the determinant that turns white noise to the trial's."""
        return len(self.right) / 6 * float(np.log(self.size).sum())


@dataclass(frozen=True, eq=False)
class Fitted:
    """The model beside some faults.

    Attributes
    ----------
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
        one = self.pieces[trial]
        return white_columns(
            columns, one.size, one.recursion, self.session.trials[trial].errors.filter
        )

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
        one = self.pieces[trial]
        return one.right - one.white @ self.mean[one.used]

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
    """Coefficients, scales and noise beside faults with the values that these have by now.

    start : a fit beside other faults to begin with. whole : until noise and scales are settled;
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
        trials = range(len(session.trials))
        self.used, self.columns, self.residual = zip(*map(self._laid, trials), strict=True)
        self.changed = [start is None or self._touching(t) != _touching(start, t) for t in trials]

    def _touching(self, trial: int) -> list[tuple[int, Hypothesis]]:
        pairs = zip(self.starts, self.faults, strict=True)
        return [(first, one) for first, one in pairs if trial in one.trials]

    def _laid(self, trial: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Coefficients, columns and residual of a trial."""
        mine = [(f, columns_of(self.session, one, trial)) for f, one in self._touching(trial)]
        at = [first + np.arange(x.slope.shape[2]) for first, x in mine]
        used = np.concatenate([self.session.used[trial], *at])
        columns = np.concatenate([self.session.columns[trial], *(x.slope for _, x in mine)], axis=2)
        residual = self.session.trials[trial].errors.residual
        return used, columns, residual - sum((x.offset for _, x in mine), np.zeros(()))

    def run(self, whole: bool, rounds: int) -> Fitted:
        trials = range(len(self.session.trials))
        pieces = [self._first(t) for t in trials]
        found = self._solved(pieces, whole)
        for _ in range(rounds):
            before = found
            pieces = [
                self._again(t, found) if whole or self.changed[t] else pieces[t] for t in trials
            ]
            found = self._solved(pieces, whole)
            if abs(found.log_evidence - before.log_evidence) < _SETTLED:
                break
        return found

    def _first(self, trial: int) -> Piece:
        if self.start is None:
            course = self.residual[trial]
            return self._piece(trial, *white_noise_of(self.session.trials[trial].errors, course))
        one = self.start.pieces[trial]
        return self._piece(trial, one.size, one.recursion) if self.changed[trial] else one

    def _again(self, trial: int, found: Fitted) -> Piece:
        """With the noise that a fit leaves."""
        told = self.residual[trial], self.columns[trial], self.used[trial]
        _, course = left_by(*told, found.mean, found.covariance)
        return self._piece(trial, *white_noise_of(self.session.trials[trial].errors, course))

    def _piece(self, trial: int, size: np.ndarray, recursion: np.ndarray) -> Piece:
        filter_ = self.session.trials[trial].errors.filter
        white = white_columns(self.columns[trial], size, recursion, filter_)
        right = white_columns(self.residual[trial][..., None], size, recursion, filter_)[:, 0]
        products = white.T @ white, white.T @ right
        return Piece(size, recursion, self.used[trial], white, right, *products)

    def _solved(self, pieces: Sequence[Piece], whole: bool) -> Fitted:
        """Coefficients and scales of the largest evidence beside given noise."""
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
        told = self.root.copy(), mean, covariance, each, log
        return Fitted(self.session, self.faults, self.starts, tuple(pieces), *told)


def _touching(fit: Fitted, trial: int) -> list[tuple[int, Hypothesis]]:
    """Faults in a trial, with their first coefficients."""
    pairs = zip(fit.starts, fit.faults, strict=True)
    return [(first, one) for first, one in pairs if trial in one.trials]


def summed(pieces: Sequence[Piece], count: int) -> tuple[np.ndarray, np.ndarray]:
    """(K, K) and (K,) normal equations of some trials."""
    gram, against = np.zeros((count, count)), np.zeros(count)
    for one in pieces:
        gram[np.ix_(one.used, one.used)] += one.gram
        against[one.used] += one.against
    return gram, against
