"""One model of what a simulation errs by: r = sum of terms + what is left, over all trials.

Each term is Gaussian, with columns of unit variance times a scale. The scales follow from the data
by expectation and maximisation (Dempster 1977, J R Stat Soc B 39), each with a hyperprior that it
is as usual. What is left is an autoregression per component and trial, never quieter than the
noise of the instruments.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from typing import NamedTuple

import numpy as np

from bsip_cli.diagnosis.error_terms import FAULT, Term, as_simulated
from bsip_cli.diagnosis.filtering import Filter, noise_like
from bsip_cli.diagnosis.normal_equations import Equations, Solution, solved
from bsip_cli.effects.scene import Scene

# How many observations a hyperprior counts for. With one, a fault has the wide tails of Cauchy: it
# is hardly there or of any size. With four, ordinary errors are rarely three times the usual.
WEIGHT, WEIGHT_OF_FAULTS = 4.0, 1.0
BLOCK_S = 1.0  # intervals of time that stand for independent ones
_STEPS = 25  # of expectation and maximisation
_ROUNDS = 3  # of what is left
_NEGLIGIBLE = 0.5  # that a direction may add to the squared residual, whose noise is one


@dataclass(frozen=True, eq=False)
class TrialErrors:
    """A trial's residual (n, 6) and terms, filtered; noise (6,) that its instruments have.

    scene : its motion and plates at a slow rate, which faults see. late_as_measured : whether the
    signal that a fault makes late is the measured one; else the simulated one too.
    """

    name: str
    scene: Scene
    filter: Filter
    residual: np.ndarray
    terms: tuple[Term, ...]
    noise: np.ndarray
    late_as_measured: bool = True

    @cached_property
    def simulated(self) -> Scene:
        """What faults change: plates that read what is simulated. Of what they measured, which
        holds the residual, every gain would explain a part of it. What comes late is as measured:
        the simulated signal lacks what is fast."""
        shown = as_simulated(self.scene)
        if not self.late_as_measured:
            return shown
        return self.scene.reading(shown.plates, self.scene.measured)

    @property
    def times_s(self) -> np.ndarray:
        """(n,) of the filtered samples."""
        return self.scene.times_s[self.filter.frames]

    @property
    def blocks(self) -> np.ndarray:
        """(n,) interval of BLOCK_S that each sample is in."""
        return ((self.times_s - self.times_s[0]) / BLOCK_S).astype(int)


@dataclass(frozen=True, eq=False)
class Part:
    """Coefficients (m,) of a term at a target, in one trial or in all (-1).

    at : by trial, which columns of the session they are about. known : by trial, (n, 6) what a
    named fault adds at its size. mixing : (P, m) from them to the coefficients of the term's own
    columns, where several targets have one.
    """

    term: str
    target: str
    scale: str
    trial: int
    coefficients: np.ndarray
    at: dict[int, slice]
    known: dict[int, np.ndarray]
    mixing: np.ndarray | None


@dataclass(frozen=True, eq=False)
class Session:
    """All trials of a person, and their terms laid out.

    used : per trial which coefficients (K',) the last axis of its ``columns`` (n, 6, K') is about.
    """

    trials: tuple[TrialErrors, ...]
    parts: tuple[Part, ...]
    used: tuple[np.ndarray, ...]
    columns: tuple[np.ndarray, ...]

    @cached_property
    def count(self) -> int:
        """Of coefficients."""
        return sum(len(part.coefficients) for part in self.parts)

    @cached_property
    def grams(self) -> tuple[np.ndarray, ...]:
        """Per trial (6, K', K') products of the columns with each other, by component."""
        by_component = (np.moveaxis(one, 1, 0) for one in self.columns)
        return tuple(np.array([x.T @ x for x in one]) for one in by_component)

    @cached_property
    def scales(self) -> dict[str, np.ndarray]:
        """The coefficients (k,) that have a scale in common."""
        found: dict[str, list[np.ndarray]] = {}
        for part in self.parts:
            found.setdefault(part.scale, []).append(part.coefficients)
        return {scale: np.concatenate(mine) for scale, mine in found.items()}


def session_of(trials: Sequence[TrialErrors]) -> Session:
    """Columns that matter given the noise; of unit variance before the data."""
    groups: dict[tuple[str, str, str, int], dict[int, Term]] = {}
    for t, one in enumerate(trials):
        for term in one.terms:
            key = (term.term, term.target, term.scale, t if term.own else -1)
            groups.setdefault(key, {})[t] = term
    parts: list[Part] = []
    used: list[list[int]] = [[] for _ in trials]
    columns: list[list[np.ndarray]] = [[] for _ in trials]
    count = 0
    for key, terms in groups.items():
        units = {t: x.of_unit_variance for t, x in terms.items()}
        white = [unit / trials[t].noise[:, None] for t, unit in units.items()]
        flat = np.concatenate([a.reshape(-1, a.shape[2]) for a in white])
        values, vectors = np.linalg.eigh(flat.T @ flat)
        turn = vectors[:, values > _NEGLIGIBLE]  # the same covariance by as few as matter
        mine = np.arange(count, count := count + turn.shape[1])
        at = {t: slice(len(used[t]), len(used[t]) + len(mine)) for t in terms}
        known = {t: x.known for t, x in terms.items() if x.known is not None}
        mixing = [x.mixing @ turn for x in terms.values() if x.mixing is not None]
        parts.append(Part(*key, mine, at, known, mixing[-1] if mixing else None))
        for t, unit in units.items():
            used[t] += mine.tolist()
            columns[t].append(unit @ turn)
    together = tuple(np.concatenate(one, axis=2) for one in columns)
    return Session(tuple(trials), tuple(parts), tuple(map(np.array, used)), together)


@dataclass(frozen=True, eq=False)
class Fold(Equations):
    """Of some samples ``rows`` of a trial."""

    trial: int
    rows: np.ndarray


@dataclass(frozen=True, eq=False)
class ErrorModel:
    """The posterior of all coefficients.

    scales : how many times as large as usual. left : per trial (n, 6) what no term explains.
    adapt : whether scales follow from the data.
    """

    session: Session
    solution: Solution
    scales: dict[str, float]
    left: tuple[np.ndarray, ...]
    folds: tuple[Fold, ...]
    adapt: bool

    @property
    def mean(self) -> np.ndarray:
        """(K,) of the coefficients."""
        return self.solution.mean

    def of(self, part: Part, trial: int, mean: np.ndarray | None = None) -> np.ndarray:
        """(n, 6) what a part adds to a trial's simulated wrench, with coefficients (K,)."""
        if trial not in part.at:
            return np.zeros_like(self.left[trial])
        x = (self.mean if mean is None else mean)[part.coefficients]
        columns = self.session.columns[trial][..., part.at[trial]]
        return columns @ x + part.known.get(trial, 0.0)

    @cached_property
    def without(self) -> tuple[np.ndarray, ...]:
        """Per fold the coefficients (K,), and their scales, of all other folds."""
        others = ([one for one in self.folds if one is not out] for out in self.folds)
        return tuple(_solution(rest, self.session, self.adapt)[0].mean for rest in others)


def error_model(trials: Sequence[TrialErrors], parts: int, adapt: bool = True) -> ErrorModel:
    """Fit coefficients, scales and what is left.

    parts : into so many each trial is cut, of which each is held out in turn.
    adapt : scales from the data; else everything is as large as usual.
    """
    session = session_of(trials)
    residual = [one.residual for one in trials]
    for t, known in (pair for part in session.parts for pair in part.known.items()):
        residual[t] = residual[t] - known
    signals = residual
    for _ in range(_ROUNDS):
        folds = tuple(
            fold
            for t, signal in enumerate(signals)
            for fold in _folds(session, t, residual[t], signal, parts)
        )
        solution, scales = _solution(folds, session, adapt)
        by_trial = enumerate(zip(residual, session.columns, strict=True))
        found = (left_by(session, t, *one, solution) for t, one in by_trial)
        left, signals = zip(*found, strict=True)
    return ErrorModel(session, solution, scales, left, folds, adapt)


def _folds(
    session: Session, trial: int, residual: np.ndarray, signal: np.ndarray, parts: int
) -> Iterator[Fold]:
    """White equations of a trial; ``signal`` (n, 6) is what may be left of it."""
    one, used = session.trials[trial], session.used[trial]
    noise = noise_like(one.filter, signal, one.noise)
    white, right = noise.white(session.columns[trial]), noise.white_one(residual)
    for part in np.array_split(np.arange(len(signal)), min(parts, len(signal))):
        at = (6 * part[:, None] + np.arange(6)).ravel()
        mine = white[at].T
        yield Fold(used, mine @ white[at], mine @ right[at], trial, part)


def left_by(
    session: Session, trial: int, residual: np.ndarray, columns: np.ndarray, solution: Solution
) -> tuple[np.ndarray, np.ndarray]:
    """(n, 6) what the terms leave of a trial, and a signal as large as it may be, they being
    uncertain; columns (n, 6, K') are the session's, and those of faults behind them."""
    left = residual - columns @ solution.mean[solution.trials[trial].used]
    covariance, grams = solution.covariance_in(trial), session.grams[trial]
    known = grams.shape[1]
    doubt = (grams * covariance[:known, :known]).sum(axis=(1, 2))
    if (faults := columns[..., known:]).shape[2]:  # twice with the session's, once with each other
        moved = columns @ covariance[:, known:] + columns[..., :known] @ covariance[:known, known:]
        doubt += (moved * faults).sum(axis=(0, 2))
    return left, left * np.sqrt(1 + doubt / np.maximum((left**2).sum(axis=0), 1e-12))


def _solution(
    folds: Iterable[Fold], session: Session, adapt: bool
) -> tuple[Solution, dict[str, float]]:
    """Coefficients, and the scales of the largest evidence."""
    equations = []
    for _, some in groupby(folds, key=lambda one: one.trial):
        mine = list(some)
        gram, against = (
            np.sum(x, axis=0) for x in zip(*((k.gram, k.against) for k in mine), strict=True)
        )
        equations.append(Equations(mine[0].used, gram, against))
    # the coefficients of a trial that is held out stay
    shown = np.isin(np.arange(session.count), np.concatenate([one.used for one in equations]))
    at = {scale: mine[shown[mine]] for scale, mine in session.scales.items()}
    weights = (WEIGHT_OF_FAULTS if scale.startswith(FAULT) else WEIGHT for scale in at)
    scales = [Scale(*one) for one in zip(at.values(), weights, strict=True)]
    root = adapted(equations, np.ones(session.count), scales, _STEPS if adapt else 0)
    found = {s: float(root[mine[0]]) if len(mine) else 1.0 for s, mine in at.items()}
    return solved(equations, root), found


class Scale(NamedTuple):
    """Coefficients (k,) whose standard deviation follows from the data: their mean square, that it
    is 1 counting for so many observations (``weight``), within bounds."""

    coefficients: np.ndarray
    weight: float
    bounds: tuple[float, float] = (0.0, np.inf)


def adapted(
    equations: Sequence[Equations],
    root: np.ndarray,
    scales: Sequence[Scale],
    steps: int,
    steady: float = 0.0,
) -> np.ndarray:
    """(K,) standard deviations before the data of the largest evidence, by expectation and
    maximisation from ``root`` (K,), until none changes by a part of ``steady``."""
    for _ in range(steps):
        before, root = root, root.copy()
        found = solved(equations, before)
        second = found.mean**2 + found.variance
        for mine, weight, bounds in scales:
            square = (weight + second[mine].sum()) / (weight + len(mine))
            root[mine] = np.clip(np.sqrt(square), *bounds)
        if np.abs(root / before - 1).max() < steady:
            break
    return root


def log_prior_of_scales(scales: np.ndarray, weight: float) -> float:
    """Logarithm of their density before the data, less a constant; ``weight`` : as of a scale."""
    return -0.5 * weight * float((2 * np.log(scales) + 1 / scales**2 - 1).sum())
