"""Which faults a laboratory has: one after the other, while one more is likelier than none."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from string import ascii_uppercase

import numpy as np
from scipy.special import expit, logit, logsumexp

from bsip_cli.diagnosis.error_model import WEIGHT_OF_FAULTS, log_prior_of_scales
from bsip_cli.diagnosis.fault_scores import BEFORE, named_size, smallest
from bsip_cli.diagnosis.findings import SCALE_ERROR
from bsip_cli.diagnosis.laboratory import (
    Persons,
    Pooled,
    Posterior,
    Sums,
    alike_in,
    anything,
    posterior_of,
    resampled,
    scales_of,
    sums_of,
)
from bsip_cli.diagnosis.shared_faults import OF_A_LABORATORY, STATED_MASS, Coordinate
from bsip_cli.effects.effect import Parameter
from bsip_cli.effects.plates import ALL, PlateRotation, PlateTranslation, PlateZero

_TIMES = np.geomspace(0.3, 3.0, 5)  # deviations so many times as large as is likeliest
_MOST = 8  # faults of a laboratory
_DRAWS = 4000
_RESAMPLED = 100  # times the persons, to tell faults apart
_JUDGED = 10  # sessions that are judged with scales of their own
_RANKS = ("named", "ambiguous", "rejected", "inconclusive")


@dataclass(frozen=True, eq=False)
class Cause:
    """A fault at a place: its k numbers are directions (C, k) among the C coordinates."""

    effect: str
    target: str
    parameters: tuple[Parameter, ...]
    directions: np.ndarray

    @property
    def most(self) -> np.ndarray:
        """(k,) no number is larger [typical]."""
        return np.array([one.most / one.typical for one in self.parameters])

    def evidence(self, posterior: Posterior, sums: Sums) -> tuple[float, float]:
        """Logarithm of the Bayes factor that some persons have it on top of what is known, and its
        likeliest size before the data [typical]."""
        logs = posterior.offset(sums, self.directions).log_factors(BEFORE, self.most)
        mean = float(np.logaddexp.reduce(logs) - np.log(len(BEFORE)))
        return mean, float(BEFORE[int(np.argmax(logs))])


@dataclass(frozen=True, eq=False)
class Size:
    """A number of a cause if it is there, with its 95 % interval, and the size that would have been
    named; infinite where no possible one would."""

    parameter: Parameter
    value: float
    low: float
    high: float
    limit: float


@dataclass(frozen=True, eq=False)
class Verdict:
    """What is made of a cause, given the others that are there.

    said : named; ambiguous: it is one of those of its ``class_id``, which cannot be distinguished;
    rejected; or inconclusive: even ten times what laboratories meet would not have been named.
    probability : that it is there, and not another one in its place. sessions : that have it on top
    of what their laboratory has, by their numbers among its own, one or all from one on; none of a
    cause that is the laboratory's.
    """

    cause: Cause
    said: str
    class_id: str
    probability: float
    sizes: tuple[Size, ...]
    sessions: tuple[int, ...] = ()


def causes_of(persons: Persons, centres_m: Mapping[str, np.ndarray]) -> tuple[Cause, ...]:
    """Every fault at every plate and, where there are several, at all of them.

    centres_m : (3,) of each plate's surface; all plates are turned about the middle of them.
    """
    found = []
    for effect in OF_A_LABORATORY:
        mine = [one.target for one in persons.moving if one.effect == effect.name]
        alike: dict[str, list[str]] = {}
        for target in dict.fromkeys(mine):
            found.append(_cause(persons, effect.name, target, [target], centres_m))
            plate, *channel = target.split(" ")
            if plate and not isinstance(effect, PlateZero):
                alike.setdefault(" ".join([ALL, *channel]), []).append(target)
        for name, parts in alike.items():
            if len(parts) > 1:
                found.append(_cause(persons, effect.name, name, parts, centres_m))
    return tuple(found)


def _cause(
    persons: Persons,
    effect: str,
    target: str,
    parts: Sequence[str],
    centres_m: Mapping[str, np.ndarray],
) -> Cause:
    """At some parts alike; what turns them about their middle shifts each of them too."""
    known = dict(zip(persons.moving, persons.parameters, strict=False))
    at = {one: k for k, one in enumerate(known)}
    mine = [p for one, p in known.items() if (one.effect, one.target) == (effect, parts[0])]
    directions = np.zeros((len(at), len(mine)))
    for part, (k, parameter) in product(parts, enumerate(mine)):
        directions[at[Coordinate(effect, part, parameter.name)], k] = 1.0
        if effect == PlateRotation.name and len(parts) > 1:
            turns = dict(zip(("tilt_x", "tilt_y", "yaw"), np.eye(3), strict=True))
            middle = np.mean([centres_m[one] for one in parts], axis=0)
            shift_m = np.cross(turns[parameter.name], centres_m[part] - middle)
            for axis, metres in zip("xyz", parameter.typical * shift_m, strict=True):
                moved = Coordinate(PlateTranslation.name, part, axis)
                directions[at[moved], k] = metres / known[moved].typical
    return Cause(effect, target, tuple(mine), persons.both @ directions)


def log_prior_of(causes: Sequence[Cause], prior_odds: float) -> np.ndarray:
    """(K,) logarithm of the odds before the data: even over names, and over the places of each."""
    places = Counter(one.effect for one in causes)
    return np.log(prior_odds) - np.log([len(places) * places[one.effect] for one in causes])


@dataclass(frozen=True, eq=False)
class Laboratory:
    """The faults that are there, of sizes before the data [typical], by all persons together.

    scale (G,) : of the persons' deviations. log_prior (K,) : of ``causes``. alike (C, L) : root of
    the covariance of what is the same in all persons.
    """

    persons: Persons
    causes: tuple[Cause, ...]
    log_prior: np.ndarray
    scale: np.ndarray
    sums: Sums
    alike: np.ndarray
    found: Mapping[int, float]

    def posterior(self, but: int | None = None, sums: Sums | None = None) -> Posterior:
        """Of the coordinates, of all that is there but one fault."""
        return posterior_of(self.sums if sums is None else sums, self._root(but))

    def _root(self, but: int | None = None) -> np.ndarray:
        there = [s * self.causes[k].directions for k, s in self.found.items() if k != but]
        ordinary = self.persons.both * self.persons.ordinary
        differences = self.persons.differences(self.scale)
        return np.column_stack([ordinary, differences, self.alike, *there])

    def sizes(
        self, k: int, named_from: float, rng: np.random.Generator, instead: int | None = None
    ) -> tuple[Size, ...]:
        """Of a cause, if it is there, perhaps ``instead`` of one that was found: from the posterior
        over how large the persons' deviations may be, which few persons do not determine."""
        but = k if instead is None else instead
        cause, persons = self.causes[k], self.persons
        touched = persons.groups[persons.numbers[cause.directions.any(axis=1)]]
        others = self.with_other_scales(frozenset(touched.tolist()))
        logs = np.array([log for _, log in others])
        shares = np.exp(logs - logsumexp(logs))
        counts = rng.multinomial(_DRAWS, shares / shares.sum())
        offsets = [self.posterior(but, x).offset(x, cause.directions) for x, _ in others]
        drawn = [x.drawn(int(n), rng) for x, n in zip(offsets, counts, strict=True)]
        return sizes_of(np.concatenate(drawn), cause, self.log_prior[k], named_from, rng)

    def with_other_scales(self, groups: frozenset[int]) -> list[tuple[Sums, float]]:
        """Sums with the deviations of some groups so many times as large, and the logarithm of the
        evidence for each; once for all causes of these groups."""
        if groups not in self._kept:
            touched = np.isin(np.arange(len(self.scale)), list(groups))  # of persons alone
            self._kept[groups] = []
            for times in _TIMES:
                scale = np.where(touched, times * self.scale, self.scale)
                sums = sums_of(self.persons, scale)
                log = log_prior_of_scales(scale, WEIGHT_OF_FAULTS)
                log += posterior_of(sums, anything(self.persons, scale)).log_evidence
                self._kept[groups].append((sums, log))
        return self._kept[groups]

    @cached_property
    def _kept(self) -> dict[frozenset[int], list[tuple[Sums, float]]]:
        return {}

    def pooled(self) -> Pooled:
        """What is kept of it for the diagnosis of each person."""
        persons, sums = self.persons, self.sums
        spread = np.median(persons.usual, axis=0) * self.scale[persons.groups]
        parts = sums.precision, sums.pull, spread[persons.numbers]
        return Pooled(persons.coordinates, *parts, self._root())


def laboratory_of(persons: Persons, causes: tuple[Cause, ...], prior_odds: float) -> Laboratory:
    """Fit the deviations jointly with any fault, look for what is there, and judge each fault given
    the others: one that is likelier absent goes, the least likely first."""
    scale = scales_of(persons)
    log_prior = log_prior_of(causes, prior_odds)
    sums = sums_of(persons, scale)
    lab = Laboratory(persons, causes, log_prior, scale, sums, alike_in(persons), {})
    while len(lab.found) < _MOST:
        odds = _log_odds(lab)
        best = max(odds, key=lambda k: odds[k][0], default=None)
        if best is None or odds[best][0] < 0:
            break
        lab = replace(lab, found={**lab.found, best: odds[best][1]})
    while lab.found:
        odds = {k: _log_odds(lab, but=k)[k] for k in lab.found}
        lab = replace(lab, found={k: size for k, (_, size) in odds.items()})
        worst = min(odds, key=lambda k: odds[k][0])
        if odds[worst][0] > 0:
            break
        lab = replace(lab, found={k: s for k, s in lab.found.items() if k != worst})
    return lab


def _log_odds(
    lab: Laboratory, but: int | None = None, sums: Sums | None = None
) -> dict[int, tuple[float, float]]:
    """Of each cause that is not there: logarithm of the odds that it is too, and its likeliest size
    before the data. ``but`` : a fault that counts as not there. sums : of others than all."""
    sums = lab.sums if sums is None else sums
    posterior = lab.posterior(but, sums)
    found = {}
    for k, cause in enumerate(lab.causes):
        if k == but or k not in lab.found:
            log, size = cause.evidence(posterior, sums)
            found[k] = (log + float(lab.log_prior[k]), size)
    return found


def verdicts_of(
    lab: Laboratory, named_from: float, rng: np.random.Generator
) -> tuple[Verdict, ...]:
    """Of every cause, what is there first."""
    said: dict[int, tuple[str, str, float]] = {}
    instead: dict[int, int] = {}  # of which fault that was found
    letters = iter(ascii_uppercase)
    others = resampled(lab.persons, lab.scale, _RESAMPLED, rng)
    for k in lab.found:
        shares = _shares(lab, k, others)
        if shares[k] >= named_from:
            said[k] = ("named", "", shares[k])
        elif sum(shares.values()) >= named_from:
            letter = next(letters)
            for member in smallest(shares, named_from):
                said.setdefault(member, ("ambiguous", letter, shares[member]))
                instead.setdefault(member, k)
        else:
            said[k] = ("rejected", "", shares[k])
    rest = _log_odds(lab)
    for k in range(len(lab.causes)):
        said.setdefault(k, ("rejected", "", float(expit(rest[k][0])) if k in rest else 0.0))
    found = []
    for k in sorted(said, key=lambda k: (_RANKS.index(said[k][0]), said[k][1], -said[k][2])):
        what, class_id, probability = said[k]
        sizes = lab.sizes(k, named_from, rng, instead.get(k))
        if what == "rejected" and all(np.isinf(one.limit) for one in sizes):
            what = "inconclusive"
        found.append(Verdict(lab.causes[k], what, class_id, probability, sizes))
    return tuple(found)


def _shares(lab: Laboratory, k: int, others: Sequence[Sums]) -> dict[int, float]:
    """Probability of each cause in the place of one that was found. That there is one at all is by
    all persons. Which it is, is the mean over ``others``, persons drawn with replacement: what a
    model gets wrong, it takes for one of two similar faults as surely as if it were true (bagged
    posteriors: Huggins and Miller 2023, Bayesian Anal 18)."""

    def shares(odds: Mapping[int, tuple[float, float]]) -> np.ndarray:
        return shares_of(np.array([log for log, _ in odds.values()]))

    by_all = _log_odds(lab, k)
    drawn = np.array([shares(_log_odds(lab, k, one)) for one in others])
    which = (drawn / drawn.sum(axis=1, keepdims=True)).mean(axis=0)
    return dict(zip(by_all, shares(by_all).sum() * which, strict=True))


def shares_of(logs: np.ndarray) -> np.ndarray:
    """(K,) probability that each of some causes is there, one of them or none; ``logs`` : of the
    odds of each against none."""
    return np.exp(logs - logsumexp([0.0, *logs]))


def sizes_of(
    drawn: np.ndarray, cause: Cause, log_prior: float, named_from: float, rng: np.random.Generator
) -> tuple[Size, ...]:
    """Of a cause, from draws (D, k) [typical] if it is there."""
    needed = float(logit(named_from) - log_prior)  # logarithm of the Bayes factor that names it
    found = []
    for x, parameter in zip(drawn.T, cause.parameters, strict=True):
        value = float(x.mean())
        spread = np.hypot(parameter.known_to / parameter.typical, SCALE_ERROR * value)
        low, high = np.percentile(x + spread * rng.standard_normal(len(x)), [2.5, 97.5])
        limit = named_size(float(x.std()), needed)
        limit = limit if limit * parameter.typical < parameter.most else np.inf
        sizes = (float(one) * parameter.typical for one in (value, low, high, limit))
        found.append(Size(parameter, *sizes))
    return tuple(found)


# --- persons and sessions that deviate from their laboratory, and dates from which on it changed --


def deviations_of(
    lab: Laboratory,
    prior_odds: float,
    named_from: float,
    order: Sequence[int],
    rng: np.random.Generator,
) -> tuple[Verdict, ...]:
    """Each session judged by all others, at one prior odds for all sessions together.

    order : numbers of the sessions whose dates are known, the earliest first: of these a lasting
    change is asked too.
    """
    persons = lab.persons
    count = len(persons.pull)
    mass = Coordinate(STATED_MASS.name, "", STATED_MASS.parameter.name)
    directions = np.array([[float(one == mass)] for one in persons.coordinates])
    causes = (*lab.causes, Cause(STATED_MASS.name, "", (STATED_MASS.parameter,), directions))
    log_prior = log_prior_of(causes, prior_odds) - np.log(count + max(0, len(order) - 2))
    each = ((k, sums_of(persons, lab.scale, (k,))) for k in range(count if count > 1 else 0))
    alone = [(k,) for k in _likeliest(lab, causes, each)]
    lasting = [tuple(order[k:]) for k in _likeliest(lab, causes, _from_each_on(lab, order))]
    found: list[Verdict] = []
    for sessions in (*alone, *lasting):
        # with the scales of deviations from the others' laboratory and from their own
        others = np.setdiff1d(np.arange(count), sessions)
        parts = (others, sessions) if len(sessions) > 1 else (others,)
        scale = scales_of(persons, *parts, start=lab.scale)
        own = sums_of(persons, scale, sessions)
        posterior = lab.posterior(sums=sums_of(persons, scale, others) + own)
        logs = np.array([one.evidence(posterior, own)[0] for one in causes]) + log_prior
        shares = dict(enumerate(shares_of(logs).tolist()))
        if sum(shares.values()) < named_from:
            continue
        members = list(smallest(shares, named_from))
        said = ("named", "") if len(members) == 1 else ("ambiguous", f"{sessions[0] + 1}")
        for k in members:
            drawn = posterior.offset(own, causes[k].directions).drawn(_DRAWS, rng)
            sizes = sizes_of(drawn, causes[k], log_prior[k], named_from, rng)
            found.append(Verdict(causes[k], *said, shares[k], sizes, sessions))
    return tuple(found)


def _from_each_on(lab: Laboratory, order: Sequence[int]) -> Iterator[tuple[int, Sums]]:
    """Place in the order, and what all from there on show: at least two, and not everybody."""
    together = None
    for k in range(len(order) - 1, 0, -1):
        own = sums_of(lab.persons, lab.scale, (order[k],))
        together = own if together is None else together + own
        if k < len(order) - 1:
            yield k, together


def _likeliest(
    lab: Laboratory, causes: Sequence[Cause], asked: Iterable[tuple[int, Sums]]
) -> list[int]:
    """The sets of sessions that deviate most, with the scales of all: only of these the scales
    jointly with their deviation are fitted, which among many sessions are the same."""
    posterior = lab.posterior()
    odds = {k: max(one.evidence(posterior, own)[0] for one in causes) for k, own in asked}
    return sorted(sorted(odds, key=lambda k: odds[k])[-_JUDGED:])
