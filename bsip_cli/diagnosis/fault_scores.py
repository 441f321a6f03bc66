"""All places of all effects in a person's trials, and how likely each is in one linear step."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple, TypeVar
from weakref import WeakKeyDictionary

import numpy as np
from scipy.special import logit, logsumexp
from scipy.stats import chi2

from bsip_cli.diagnosis.error_model import Session, TrialErrors
from bsip_cli.diagnosis.fault_model import SIZES, Fitted, Piece
from bsip_cli.effects.effect import Effect
from bsip_cli.effects.nameless import UNEXPLAINED
from bsip_cli.effects.scene import Scene

BEFORE = np.geomspace(*SIZES, 5)  # sizes before the data, evenly in the logarithm [typical]
_BATCH = 60  # candidates whose signatures are filtered, or made white, at a time
_SURE = 1.645  # standard deviations: found in 95 of 100 recordings like these
# Part of a parameter, squared, that lies in what the motion does not determine.
_UNDETERMINED = 1e-3
# Of what the likeliest combination of parameters is determined: less is rounding.
_DETERMINED = 1e-5
Key = TypeVar("Key")
_MEDIANS = [np.nan, *chi2.median(np.arange(1, 50))]


class Candidate(NamedTuple):
    """An effect at one place; ``scanned`` are the values of its parameters that have a scan."""

    effect: Effect
    target: str
    scanned: tuple[float, ...]

    def null(self, scene: Scene) -> np.ndarray:
        """(K,) all parameters where it has no size."""
        free = self.effect.is_free(scene, self.target)
        values = np.zeros(len(free))
        values[~free] = self.scanned
        return values


class Kind(NamedTuple):
    """What, where and in which trials, whatever the values of a scan."""

    effect: Effect
    target: str
    trials: tuple[int, ...]


class Place(NamedTuple):
    """A candidate in some of the trials, by their numbers."""

    candidate: Candidate
    trials: tuple[int, ...]

    @property
    def kind(self) -> Kind:
        return Kind(self.candidate.effect, self.candidate.target, self.trials)


_Products = tuple[np.ndarray, np.ndarray, dict[Candidate, np.ndarray]]


@dataclass(frozen=True, eq=False)
class Library:
    """All places of all effects in the trials of a session.

    columns : signatures (n, 6, C) of each trial; ``parts``: which of them are a candidate's.
    prior_odds : of one more fault against none; ``log_prior`` (P,) of those that it is just there.
    """

    session: Session
    columns: tuple[np.ndarray, ...]
    parts: tuple[dict[Candidate, slice], ...]
    places: tuple[Place, ...]
    prior_odds: float
    log_prior: np.ndarray

    @cached_property
    def kinds(self) -> dict[Kind, list[int]]:
        """Numbers of the places of each kind."""
        found: dict[Kind, list[int]] = {}
        for k, place in enumerate(self.places):
            found.setdefault(place.kind, []).append(k)
        return found

    def log_prior_of(self, kind: Kind) -> float:
        """Logarithm of the prior odds of a kind, whatever the values of a scan."""
        return float(np.logaddexp.reduce(self.log_prior[self.kinds.get(kind, [])]))

    def products(self, fit: Fitted, trial: int) -> _Products:
        """Of the white signatures of a trial with its residual (C,), with the columns of all terms
        (K', C), and each candidate's with itself (k, k); once for the same noise and faults."""
        piece = fit.pieces[trial]
        if piece not in self._products:
            count, grams = self.columns[trial].shape[2], {}
            with_right, with_columns = np.zeros(count), np.zeros((len(piece.used), count))
            parts = [*self.parts[trial].items()]
            for batch in (parts[k : k + _BATCH] for k in range(0, len(parts), _BATCH)):
                first, last = batch[0][1].start, batch[-1][1].stop
                white = piece.noise.white(self.columns[trial][..., first:last])
                with_right[first:last] = white.T @ piece.right
                with_columns[:, first:last] = piece.white.T @ white
                for candidate, mine in batch:
                    own = white[:, mine.start - first : mine.stop - first]
                    grams[candidate] = own.T @ own
            self._products[piece] = with_right, with_columns, grams
        return self._products[piece]

    @cached_property
    def _products(self) -> WeakKeyDictionary[Piece, _Products]:
        return WeakKeyDictionary()


def library_of(
    session: Session, effects: Sequence[Effect], alone: Sequence[int], prior_odds: float
) -> Library:
    """alone : trials in which a fault may be by itself; in the others only what trials share is
    asked.
    prior_odds : of one more fault in a person's recordings against none."""
    columns, parts = zip(*(_signatures(one, effects) for one in session.trials), strict=True)
    places = tuple(_places(parts, [one.scene for one in session.trials], alone))
    # even over the names of effects, over the effects of a name, and over the places of each
    counts = Counter(one.candidate.effect for one in places)
    names = Counter(effect.name for effect in counts)
    asked = (one.candidate.effect for one in places)
    shares = [len(names) * names[effect.name] * counts[effect] for effect in asked]
    log_prior = np.log(prior_odds) - np.log(shares)
    return Library(session, columns, parts, places, prior_odds, log_prior)


def _signatures(
    trial: TrialErrors, effects: Sequence[Effect]
) -> tuple[np.ndarray, dict[Candidate, slice]]:
    scene = trial.scene
    candidates = [
        Candidate(effect, target, scanned)
        for effect in effects
        for target in effect.targets(scene)
        for scanned in effect.scans(scene, target)
    ]
    counts = [int(one.effect.is_free(scene, one.target).sum()) for one in candidates]
    pairs = [*zip(candidates, pairwise(np.cumsum([0, *counts]).tolist()), strict=True)]
    columns = np.zeros((*trial.residual.shape, sum(counts)), np.float32)
    parts = {}
    for batch in (pairs[k : k + _BATCH] for k in range(0, len(pairs), _BATCH)):
        signatures = [
            one.effect.signature(trial.simulated, one.target, one.null(trial.simulated))
            for one, _ in batch
        ]
        filtered = trial.filter(np.concatenate(signatures, axis=2))
        begin, end = batch[0][1][0], batch[-1][1][1]
        columns[..., begin:end] = filtered
        touched = np.asarray(filtered.any(axis=(0, 1)))
        for candidate, (start, stop) in batch:
            if touched[start - begin : stop - begin].all():  # else it touches no valid frame
                parts[candidate] = slice(start, stop)
    return columns, parts


def _places(
    parts: Sequence[dict[Candidate, slice]], scenes: Sequence[Scene], alone: Sequence[int]
) -> Iterator[Place]:
    held = Counter(c for one in parts for c in one)
    for t in alone:
        for candidate in parts[t]:
            if held[candidate] == 1 or not candidate.effect.of_the_body:
                yield Place(candidate, (t,))
    for candidate in held:
        effect, target = candidate.effect, candidate.target
        asked = alone if effect.while_moving else range(len(parts))
        held_in = (t for t in asked if candidate in parts[t])
        holding = tuple(t for t in held_in if effect.is_shared_at(scenes[t], target))
        holding = alike_in(effect, target, scenes, holding)
        if effect.is_shared and len(holding) > 1:
            yield Place(candidate, holding)


def alike_in(
    effect: Effect, target: str, scenes: Sequence[Scene], trials: Sequence[int]
) -> tuple[int, ...]:
    """Of these trials those in which a fault has the numbers that it has in the first: a file that
    does not say where its plates lie has more."""
    names = [tuple(p.name for p in effect.parameters(scenes[t], target)) for t in trials]
    return tuple(t for t, mine in zip(trials, names, strict=True) if mine == names[0])


@dataclass(frozen=True, eq=False)
class Scores:
    """Of all places: logarithm of the Bayes factor (P,), likeliest sizes and information of each
    [typical]; (T,) how many times more of a trial candidates explain than chance lets them."""

    log_factor: np.ndarray
    sizes: tuple[np.ndarray, ...]
    information: tuple[np.ndarray, ...]
    inflation: np.ndarray

    def inflation_in(self, trials: Sequence[int]) -> float:
        """Of a fault in some trials together."""
        return float(self.inflation[list(trials)].mean())


def scores_of(library: Library, fit: Fitted) -> Scores:
    """Given what the model holds by now, its scales and its noise: one linear step."""
    shown: list[dict[Candidate, tuple[np.ndarray, ...]]] = []  # by trial
    for t, piece in enumerate(fit.pieces):
        right, columns, own = library.products(fit, t)
        pull = right - fit.mean[piece.used] @ columns
        alone, together = (x @ columns for x in fit.solution.roots(t))
        mine = library.parts[t].items()
        shown.append(
            {c: (pull[s], together[:, s], own[c], alone[:, s].T @ alone[:, s]) for c, s in mine}
        )
    count = len(library.places)
    log_factor = np.empty(count)
    sizes, known = [np.zeros(0)] * count, [np.zeros(0)] * count
    saved: list[dict[Effect, list[float]]] = [{} for _ in fit.pieces]
    sums = [
        [np.sum(x, axis=0) for x in zip(*(shown[t][p.candidate] for t in p.trials), strict=True)]
        for p in library.places
    ]
    widths = np.array([len(pull) for pull, *_ in sums])
    for width in np.unique(widths):  # all of as many free parameters at once
        numbers = np.flatnonzero(widths == width).tolist()
        pull, taken, whole, gone = map(np.array, zip(*(sums[k] for k in numbers), strict=True))
        information = whole - gone - taken.swapaxes(1, 2) @ taken
        values, vectors = np.linalg.eigh(information)
        least = 1e-9 * np.trace(whole, axis1=1, axis2=2) + 1e-300  # less is rounding
        values = np.maximum(values, least[:, None])
        along = np.einsum("nki,nk->ni", vectors, pull)
        gains = log_factors(values, along, BEFORE)
        log_factor[numbers] = logsumexp(gains, axis=1) - np.log(len(BEFORE))
        best = values + 1 / BEFORE[np.argmax(gains, axis=1), None] ** 2
        likeliest = np.einsum("nki,ni->nk", vectors, along / best)
        determined = values > 1.0  # of which the recording shows a typical size
        squares = (along**2 / values * determined).sum(axis=1)
        for n, k in enumerate(numbers):
            sizes[k], known[k], place = likeliest[n], information[n], library.places[k]
            if len(place.trials) == 1 and determined[n].any():
                ratio = float(squares[n] / _MEDIANS[int(determined[n].sum())])
                saved[place.trials[0]].setdefault(place.candidate.effect, []).append(ratio)
    medians = [[float(np.median(x)) for x in one.values()] or [1.0] for one in saved]
    inflation = np.array([max(1.0, float(np.median(one))) for one in medians])
    return Scores(log_factor, tuple(sizes), tuple(known), inflation)


def log_factors(values: np.ndarray, along: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """(..., S) logarithms of the Bayes factors that k numbers are there, of S standard deviations
    before the data, from the eigenvalues (..., k) of their precision and their pull along its
    eigenvectors (..., k)."""
    added = values[..., None, :] + 1 / sizes[:, None] ** 2
    gains = along[..., None, :] ** 2 / added - np.log(added * sizes[:, None] ** 2)
    return np.asarray(0.5 * gains.sum(axis=-1))


def smallest(shares: Mapping[Key, float], least: float) -> Iterator[Key]:
    """The fewest, the likeliest first, that hold as much probability."""
    held = 0.0
    for key, share in sorted(shares.items(), key=lambda one: -one[1]):
        yield key
        held += share
        if held >= least:
            return


# --- how small each fault might have been and still been named ------------------------------------


@dataclass(frozen=True)
class Limit:
    """Size of one parameter, the effect's others free, that would have been named; infinite where
    no possible one would."""

    kind: Kind
    parameter: str
    unit: str
    size: float


def limits_of(library: Library, scores: Scores, named_from: float) -> Iterator[Limit]:
    """Per effect, target and parameter, in the trials together or alone; what is of the body cannot
    be in one trial alone. Of moments, frequencies and windows the median counts: half of them show
    the fault better.
    """
    for kind, mine in library.kinds.items():
        effect = kind.effect
        if effect.name == UNEXPLAINED:
            continue
        inflation = np.sqrt(scores.inflation_in(kind.trials))
        needed = float(logit(named_from)) - library.log_prior_of(kind)
        parameters = effect.parameters(library.session.trials[kind.trials[0]].scene, kind.target)
        spreads = np.stack([inflation * _spreads(scores.information[k]) for k in mine])
        free = (p for p in parameters if not p.scan)
        for parameter, each in zip(free, spreads.T, strict=True):
            sizes = sorted(named_size(float(sd), needed) * parameter.typical for sd in each)
            size = max(sizes[len(mine) // 2], effect.least_named.get(parameter.name, 0.0))
            size = size if size < parameter.most else np.inf
            yield Limit(kind, parameter.name, parameter.unit, size)


def named_size(sd: float, needed: float) -> float:
    """Size that is named in 95 of 100 recordings, in the unit of its standard deviation [typical].

    Evidence of a size x whose standard deviation is s is x^2 / (2 s^2), less what spreading over
    two decades costs, and must outweigh the prior odds (``needed``, a logarithm).
    """
    cost = np.log(np.hypot(1.0, SIZES[1] / sd)) if np.isfinite(sd) else 0.0
    return float(sd * (np.sqrt(2 * (needed + cost)) + _SURE))


def _spreads(information: np.ndarray) -> np.ndarray:
    """(k,) standard deviations of an effect's sizes [typical], infinite where the motion does not
    determine them: a hinge hides a shift along its axis."""
    squares, directions = np.linalg.eigh(information)
    determined = squares > _DETERMINED * max(squares[-1], 1.0)
    spread = np.sqrt((directions[:, determined] ** 2 / squares[determined]).sum(axis=1))
    hidden = (directions[:, ~determined] ** 2).sum(axis=1) > _UNDETERMINED
    return np.where(hidden, np.inf, spread)
