"""One model of what a simulation errs by: r = sum of terms + what is left, over all trials.

Each term is Gaussian, with columns of unit variance times a scale. The scales follow from the data
by expectation and maximisation (Dempster 1977, J R Stat Soc B 39), each with a hyperprior that it
is as usual. What is left is an autoregression per component and trial, never quieter than the
noise of the instruments.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import cho_factor
from scipy.linalg.lapack import dpotri, dtrtri

from bsip_cli.diagnosis.error_terms import FAULT, Term
from bsip_cli.diagnosis.filtering import FLOOR, Filter, recursion_of

# How many observations a hyperprior counts for. With one, a fault has the wide tails of Cauchy: it
# is hardly there or of any size. With four, ordinary errors are rarely three times the usual.
WEIGHT, WEIGHT_OF_FAULTS = 4.0, 1.0
_STEPS = 25  # of expectation and maximisation
_ROUNDS = 3  # of what is left
_NEGLIGIBLE = 0.5  # that a direction may add to the squared residual, whose noise is one


@dataclass(frozen=True, eq=False)
class TrialErrors:
    """A trial's residual (n, 6) and terms, filtered; noise (6,) that its instruments have."""

    name: str
    filter: Filter
    residual: np.ndarray
    terms: tuple[Term, ...]
    noise: np.ndarray


@dataclass(frozen=True)
class Part:
    """Coefficients ``start`` to ``stop`` are a term's at a target, in one trial or in all (-1)."""

    term: str
    target: str
    scale: str
    trial: int
    start: int
    stop: int


@dataclass(frozen=True, eq=False)
class Fold:
    """Some samples ``rows`` of a trial, and their part (K', K'), (K',) of the white equations."""

    trial: int
    rows: np.ndarray
    used: np.ndarray
    gram: np.ndarray
    right: np.ndarray


@dataclass(frozen=True, eq=False)
class Laid:
    """The terms of all trials, laid out.

    used : per trial which coefficients (K',) the last axis of its ``columns`` (n, 6, K') is about.
    known : (n, 6) what a named fault adds to a trial at its size.
    mixed : (P, m) of a part, from whose coefficients it turns to those of a term's own columns.
    """

    parts: tuple[Part, ...]
    used: tuple[np.ndarray, ...]
    columns: tuple[np.ndarray, ...]
    known: dict[tuple[Part, int], np.ndarray]
    mixed: dict[Part, np.ndarray]

    @property
    def count(self) -> int:
        """Of coefficients."""
        return max(part.stop for part in self.parts)


def laid_out(trials: Sequence[TrialErrors]) -> Laid:
    """Columns that matter given the noise; of unit variance before the data."""
    groups: dict[tuple[str, str, str, int], dict[int, Term]] = {}
    for t, one in enumerate(trials):
        for term in one.terms:
            key = (term.term, term.target, term.scale, t if term.own else -1)
            groups.setdefault(key, {})[t] = term
    parts: list[Part] = []
    known, mixed = {}, {}
    blocks: list[list[tuple[np.ndarray, np.ndarray]]] = [[] for _ in trials]
    stop = 0
    for key, terms in groups.items():
        columns = [x.of_unit_variance for x in terms.values()]
        white = [a / trials[t].noise[:, None] for t, a in zip(terms, columns, strict=True)]
        flat = np.concatenate([a.reshape(-1, a.shape[2]) for a in white])
        values, vectors = np.linalg.eigh(flat.T @ flat)
        turn = vectors[:, values > _NEGLIGIBLE]  # the same covariance by as few as matter
        part = Part(*key, stop, stop + turn.shape[1])
        parts.append(part)
        stop = part.stop
        for (t, term), unit in zip(terms.items(), columns, strict=True):
            blocks[t].append((np.arange(part.start, part.stop), unit @ turn))
            if term.known is not None:
                known[part, t] = term.known
            if term.mixing is not None:
                mixed[part] = term.mixing @ turn
    used = tuple(np.concatenate([u for u, _ in one]) for one in blocks)
    together = tuple(np.concatenate([a for _, a in one], axis=2) for one in blocks)
    return Laid(tuple(parts), used, together, known, mixed)


@dataclass(frozen=True, eq=False)
class ErrorModel(Laid):
    """The posterior of all coefficients.

    mean (K,), covariance (K, K) : of the coefficients. scales : how many times as large as usual.
    left : per trial (n, 6) what no term explains. adapt : whether scales follow from the data.
    """

    trials: tuple[TrialErrors, ...]
    mean: np.ndarray
    covariance: np.ndarray
    scales: dict[str, float]
    left: tuple[np.ndarray, ...]
    folds: tuple[Fold, ...]
    adapt: bool

    def of(self, part: Part, trial: int, mean: np.ndarray | None = None) -> np.ndarray:
        """(n, 6) what a part adds to a trial's simulated wrench, with coefficients (K,)."""
        used = self.used[trial]
        here = np.flatnonzero((used >= part.start) & (used < part.stop))
        x = (self.mean if mean is None else mean)[used[here]]
        return self.columns[trial][..., here] @ x + self.known.get((part, trial), 0.0)

    @cached_property
    def without(self) -> tuple[np.ndarray, ...]:
        """Per fold the coefficients (K,), and their scales, of all other folds."""
        others = ([one for one in self.folds if one is not out] for out in self.folds)
        return tuple(_solution(rest, self, self.adapt)[0] for rest in others)


def error_model(trials: Sequence[TrialErrors], parts: int, adapt: bool = True) -> ErrorModel:
    """Fit coefficients, scales and what is left.

    parts : into so many each trial is cut, of which each is held out in turn.
    adapt : scales from the data; else everything is as large as usual.
    """
    laid = laid_out(trials)
    off = [sum((x for (_, t), x in laid.known.items() if t == k), 0.0) for k in range(len(trials))]
    residual = [one.residual - x for one, x in zip(trials, off, strict=True)]
    signals = residual
    for _ in range(_ROUNDS):
        equations = zip(trials, residual, laid.columns, laid.used, signals, strict=True)
        folds = tuple(f for t, one in enumerate(equations) for f in _folds(t, *one, parts))
        solution = _solution(folds, laid, adapt)
        by_trial = zip(residual, laid.columns, laid.used, strict=True)
        left, signals = zip(*(left_by(*one, *solution[:2]) for one in by_trial), strict=True)
    return ErrorModel(
        **vars(laid),
        trials=tuple(trials),
        mean=solution[0],
        covariance=solution[1],
        scales=solution[2],
        left=left,
        folds=folds,
        adapt=adapt,
    )


def _folds(
    trial: int,
    one: TrialErrors,
    residual: np.ndarray,
    columns: np.ndarray,
    used: np.ndarray,
    signal: np.ndarray,
    parts: int,
) -> Iterator[Fold]:
    """White equations of a trial; ``signal`` (n, 6) is what may be left of it."""
    size, recursion = white_noise_of(one, signal)
    rows = one.filter.innovations(columns / size[:, None], recursion)
    right = one.filter.innovations((residual / size)[..., None], recursion)[:, 0]
    for part in np.array_split(np.arange(len(signal)), min(parts, len(signal))):
        at = (6 * part[:, None] + np.arange(6)).ravel()
        yield Fold(trial, part, used, rows[at].T @ rows[at], rows[at].T @ right[at])


def white_noise_of(one: TrialErrors, signal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Size (6,) and recursion (6, p) of a signal (n, 6) that may be left of a trial; it is never
    quieter than the instruments."""
    spread = np.maximum(signal.std(axis=0), one.noise)
    share = one.noise / spread
    recursion = np.stack(
        [
            recursion_of(x, one.filter.rate_hz, max(FLOOR, float(s**2)))
            for x, s in zip((signal / spread).T, share, strict=True)
        ]
    )
    white = one.filter.innovations((signal / spread)[..., None], recursion).reshape(-1, 6)
    return spread * np.maximum(white.std(axis=0), share), recursion


def left_by(
    residual: np.ndarray,
    columns: np.ndarray,
    used: np.ndarray,
    mean: np.ndarray,
    covariance: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """(n, 6) what the terms leave, and a signal as large as it may be, they being uncertain."""
    left = residual - columns @ mean[used]
    inside = covariance[np.ix_(used, used)]
    doubt = np.stack([((a @ inside) * a).sum() for a in columns.swapaxes(0, 1)])
    return left, left * np.sqrt(1 + doubt / np.maximum((left**2).sum(axis=0), 1e-12))


def _solution(
    folds: Sequence[Fold], laid: Laid, adapt: bool
) -> tuple[np.ndarray, np.ndarray, dict[str, float]]:
    """Coefficients (K,), their covariance (K, K), and the scales of the largest evidence."""
    count = laid.count
    gram, right = np.zeros((count, count)), np.zeros(count)
    for one in folds:
        gram[np.ix_(one.used, one.used)] += one.gram
        right[one.used] += one.right
    shown = np.zeros(count, dtype=bool)  # the others, of a trial that is held out, stay as they are
    shown[np.unique(np.concatenate([one.used for one in folds]))] = True
    gram, right = gram[np.ix_(shown, shown)], right[shown]
    place = np.cumsum(shown) - 1
    at: dict[str, np.ndarray] = {}
    for part in laid.parts:
        mine = np.arange(part.start, part.stop)
        mine = place[mine[shown[mine]]]
        at[part.scale] = np.concatenate([at.get(part.scale, mine[:0]), mine])
    root = np.ones(len(right))
    for _ in range(_STEPS if adapt else 0):
        mean, variance = moments(gram, right, root)
        second = mean**2 + variance
        for scale, mine in at.items():
            weight = WEIGHT_OF_FAULTS if scale.startswith(FAULT) else WEIGHT
            root[mine] = np.sqrt((weight + second[mine].sum()) / (weight + len(mine)))
    mean, covariance = posterior(gram, right, root)
    scales = {s: float(root[x[0]]) if len(x) else 1.0 for s, x in at.items()}
    if shown.all():
        return mean, covariance, scales
    whole = np.zeros(count)
    whole[shown] = mean
    return whole, covariance, scales


def moments(gram: np.ndarray, right: np.ndarray, root: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean (K,) and variance (K,) of coefficients with standard deviations ``root`` (K,)."""
    inner = gram * np.outer(root, root) + np.eye(len(right))
    factor, _ = cho_factor(inner, lower=True, overwrite_a=True)
    inverse, _ = dtrtri(factor, lower=1, overwrite_c=1)
    inverse = np.tril(inverse)
    mean = root * (inverse.T @ (inverse @ (root * right)))
    return mean, root**2 * (inverse**2).sum(axis=0)


def posterior(
    gram: np.ndarray, right: np.ndarray, root: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Mean (K,) and covariance (K, K) of coefficients with standard deviations ``root`` (K,)."""
    inner = gram * np.outer(root, root) + np.eye(len(right))
    factor, _ = cho_factor(inner, lower=True, overwrite_a=True)
    lower, _ = dpotri(factor, lower=1, overwrite_c=1)
    covariance = (np.tril(lower) + np.tril(lower, -1).T) * np.outer(root, root)
    return covariance @ right, covariance
