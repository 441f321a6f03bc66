"""The shared faults of all who were recorded in one laboratory, as one small Gaussian model.

Each person's recordings show something of the shared faults (``shared_faults``): of theta + d, with
theta the laboratory's sizes and d the person's own deviation, since nobody's body and skin are just
as the model has them. How large deviations are follows from the data, by kind of number (a random
effect, its variance by expectation and maximisation: Dempster 1977, J R Stat Soc B 39; Laird and
Ware 1982, Biometrics 38). What is shown in motion and in quiet stance are coordinates of their
own, E d what a person deviates in both. With J and h a person's precision and pull and T^2 the
variance of d, the person adds J - J E V E' J and h - J E V E' h to what is known of the
coordinates, V = (E' J E + T^-2)^-1. These are E theta, and for who stands still a difference more
in all persons alike, whose size follows from the data too: plates may be moved before they walk.

What a body's model gets wrong in motion it may get wrong in every body. No scatter of persons shows
it: a share of the variance of what one person shows counts as the same in all (an intraclass
correlation: Kish 1965, Survey Sampling, 5.4), in every direction of the coordinates.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from operator import add

import numpy as np
from scipy.special import log_ndtr

from bsip_cli.diagnosis.error_model import WEIGHT_OF_FAULTS
from bsip_cli.diagnosis.error_terms import SHARE
from bsip_cli.diagnosis.fault_model import SIZES
from bsip_cli.diagnosis.fault_scores import log_factors
from bsip_cli.diagnosis.shared_faults import STATED_MASS, Coordinate, Information
from bsip_cli.effects.effect import Parameter
from bsip_cli.effects.plates import ClockDrift, SyncOffset

_STEPS = 100  # of expectation and maximisation, at most
_STEADY = 0.01  # change of every scale
_BLOCK = 32  # persons
_UNDETERMINED = 1e-10  # of the precision of what is determined best


@dataclass(frozen=True, eq=False)
class Persons:
    """What M persons show of C coordinates [typical sizes], which are K numbers in motion and, some
    of them, of who stands still too.

    precision (M, C, C), pull (M, C) : of each alone; 0 where nothing is shown.
    numbers (C,) : which number a coordinate is; the first K are those in motion.
    usual (M, K) : standard deviation of the deviations before the data. groups (K,) : whose
    deviations have one scale; behind them as many groups of differences of who stands still.
    ordinary (K,) : what every laboratory has of a fault. alike : share of the variance of what one
    shows in motion that is the same in all. moments_s : mean and standard deviation of those that
    show the clock, from the start of a recording.
    """

    coordinates: tuple[Coordinate, ...]
    parameters: tuple[Parameter, ...]
    precision: np.ndarray
    pull: np.ndarray
    numbers: np.ndarray
    usual: np.ndarray
    groups: np.ndarray
    ordinary: np.ndarray
    alike: float
    moments_s: tuple[float, float]

    @property
    def moving(self) -> tuple[Coordinate, ...]:
        """Those of motion, which are the numbers."""
        return self.coordinates[: len(self.groups)]

    @property
    def both(self) -> np.ndarray:
        """(C, K) what makes coordinates of the numbers."""
        return np.eye(len(self.groups))[self.numbers]

    @property
    def standing(self) -> np.ndarray:
        """Coordinates that may differ from their number, being of who stands still."""
        return np.flatnonzero([one.standing for one in self.coordinates])

    @property
    def count(self) -> int:
        """Of scales."""
        return 2 * (int(self.groups.max()) + 1)

    @property
    def of_differences(self) -> np.ndarray:
        """(S,) scale of each difference of who stands still."""
        return self.count // 2 + self.groups[self.numbers[self.standing]]

    def blocks(self, who: Iterable[int] | None = None) -> Iterator[tuple[np.ndarray, ...]]:
        """precision, pull and usual of all or some, a few at a time: but for what is kept of each
        person, no memory grows with their number."""
        mine = np.arange(len(self.pull)) if who is None else np.array([*who])
        for k in range(0, len(mine), _BLOCK):
            some = mine[k : k + _BLOCK]
            yield self.precision[some], self.pull[some], self.usual[some]

    def differences(self, scale: np.ndarray) -> np.ndarray:
        """(C, S) root of the covariance of the differences of who stands still: usually as large as
        persons deviate, since a body's model errs otherwise in motion."""
        mine = self.standing
        sizes = self.usual[0, self.numbers[mine]] * scale[self.of_differences]
        return np.eye(len(self.coordinates))[:, mine] * sizes


def persons_of(
    informations: Sequence[Information],
    mass_sd: Sequence[float],
    deviation: float,
    alike: float,
    moments_s: tuple[float, float],
) -> Persons:
    """Lay out what was kept of each.

    mass_sd : (M,) standard deviation of each stated mass, part of it. deviation : usual standard
    deviation from person to person [typical]. alike, moments_s : as in ``Persons``.
    """
    known = {
        x: p for one in informations for x, p in zip(one.coordinates, one.parameters, strict=True)
    }
    known |= {replace(x, standing=False): p for x, p in known.items()}  # none may show it in motion
    coordinates = tuple(sorted(known, key=lambda one: (one.standing, one)))
    moving = [one for one in coordinates if not one.standing]
    is_mass = np.array([one.effect == STATED_MASS.name for one in moving])
    masses = np.array(mass_sd) / STATED_MASS.parameter.typical
    kinds = [(one.effect, *one.target.split(" ")[1:], one.parameter) for one in moving]
    groups = {kind: k for k, kind in enumerate(dict.fromkeys(kinds))}
    return Persons(
        coordinates,
        tuple(known[one] for one in coordinates),
        *_laid(coordinates, informations),
        np.array([moving.index(replace(one, standing=False)) for one in coordinates]),
        np.where(is_mass, masses[:, None], deviation),
        np.array([groups[kind] for kind in kinds]),
        np.where(is_mass, np.median(masses), SHARE),  # one scale weighs all: it may err too
        alike,
        moments_s,
    )


def _laid(
    coordinates: Sequence[Coordinate], informations: Sequence[Information]
) -> tuple[np.ndarray, np.ndarray]:
    """(M, C, C) precision and (M, C) pull of each person, among all coordinates."""
    count = len(coordinates)
    precision = np.zeros((len(informations), count, count))
    pull = np.zeros((len(informations), count))
    for k, one in enumerate(informations):
        at = [coordinates.index(x) for x in one.coordinates]
        precision[k][np.ix_(at, at)], pull[k, at] = one.precision, one.pull
    return precision, pull


@dataclass(frozen=True, eq=False)
class Sums:
    """Precision (C, C) and pull (C,) of the laboratory's sizes by all persons, whose deviations are
    integrated out, or of some numbers more; ``log_factor``: of the evidence, that the deviations
    are of this size."""

    precision: np.ndarray
    pull: np.ndarray
    log_factor: float = 0.0

    def __add__(self, others: Sums) -> Sums:
        """And what some others show."""
        return Sums(
            self.precision + others.precision,
            self.pull + others.pull,
            self.log_factor + others.log_factor,
        )

    def log_factors(self, sizes: np.ndarray, most: np.ndarray) -> np.ndarray:
        """(S,) logarithm of the Bayes factor that they are there, with these standard deviations
        before the data, and none of them is larger than ``most`` (k,)."""
        values, vectors = np.linalg.eigh(self.precision)
        values, along = np.maximum(values, 0.0), vectors.T @ self.pull
        added = values + 1 / sizes[:, None] ** 2
        mean = (along / added) @ vectors.T
        spread = np.sqrt((1 / added) @ (vectors**2).T)
        after = _log_within(mean, spread, most).sum(axis=1)
        before = _log_within(np.zeros_like(mean), sizes[:, None], most).sum(axis=1)
        return log_factors(values, along, sizes) + after - before

    @property
    def covariance(self) -> np.ndarray:
        """(k, k) if they are there."""
        return np.linalg.inv(self.precision + np.eye(len(self.pull)) / SIZES[1] ** 2)

    def drawn(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """(count, k) of them, if they are there."""
        covariance = self.covariance
        mean = covariance @ self.pull
        return rng.multivariate_normal(mean, covariance, count, check_valid="ignore")


def _log_within(mean: np.ndarray, spread: np.ndarray, most: np.ndarray) -> np.ndarray:
    """Logarithm of the probability of numbers within +-most, the sign being that of the mean."""
    far = np.abs(mean)
    inside, below = log_ndtr((most - far) / spread), log_ndtr((-most - far) / spread)
    return np.asarray(inside + np.log1p(-np.exp(below - inside)))


def sums_of(persons: Persons, scale: np.ndarray, who: Iterable[int] | None = None) -> Sums:
    """Of all persons or some; scale (G,) times what is usual: of their deviations."""
    spread, both = scale[persons.groups], persons.both
    blocks = persons.blocks(who)
    return reduce(add, (_sums(j, h, usual * spread, both) for j, h, usual in blocks))


def resampled(
    persons: Persons, scale: np.ndarray, count: int, rng: np.random.Generator
) -> list[Sums]:
    """So many times as many persons, drawn from all with replacement (no ``log_factor``)."""
    everybody = len(persons.pull)
    weights = rng.multinomial(everybody, np.full(everybody, 1 / everybody), size=count)
    precision = np.zeros((count, *persons.precision.shape[1:]))
    pull = np.zeros((count, persons.pull.shape[1]))
    spread = scale[persons.groups]
    for first, (j, h, usual) in zip(range(0, everybody, _BLOCK), persons.blocks(), strict=True):
        mine = weights[:, first : first + _BLOCK]
        each, pulls, _ = _shown(j, h, usual * spread, persons.both)
        precision += np.tensordot(mine, each, 1)
        pull += mine @ pulls
    return [Sums(*one) for one in zip(precision, pull, strict=True)]


def _sums(precision: np.ndarray, pull: np.ndarray, spread: np.ndarray, both: np.ndarray) -> Sums:
    each, pulls, logs = _shown(precision, pull, spread, both)
    return Sums(each.sum(axis=0), pulls.sum(axis=0), float(logs.sum()))


def _shown(
    precision: np.ndarray, pull: np.ndarray, spread: np.ndarray, both: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(M, C, C) precision and (M, C) pull of the laboratory's sizes by each person, and (M,) their
    logarithms of the evidence; spread (M, K) : of the deviations."""
    variance, volume = _deviations(precision, spread, both)
    across, against = precision @ both, pull @ both
    along = np.einsum("mij,mj->mi", variance, against)
    return (
        precision - across @ variance @ across.swapaxes(1, 2),
        pull - np.einsum("mij,mj->mi", across, along),
        0.5 * ((against * along).sum(axis=1) - volume),
    )


def _deviations(
    precision: np.ndarray, spread: np.ndarray, both: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(M, K, K) covariance of each person's deviations (M, K) given the laboratory's sizes, and
    (M,) logarithm of how much less volume than before the data."""
    known = both.T @ precision @ both
    inner = spread[:, :, None] * known * spread[:, None] + np.eye(spread.shape[1])
    variance = spread[:, :, None] * np.linalg.inv(inner) * spread[:, None]
    return variance, np.linalg.slogdet(inner)[1]


@dataclass(frozen=True, eq=False)
class Posterior:
    """Of sizes: mean (C,), covariance (C, C), and the logarithm of the evidence; squares (K,) that
    are expected of the coefficients of what they were before the data."""

    mean: np.ndarray
    covariance: np.ndarray
    log_evidence: float
    squares: np.ndarray

    def offset(self, sums: Sums, directions: np.ndarray) -> Sums:
        """What is known of sizes along ``directions`` (C, k) that some persons have on top of this.

        sums : of these persons, who are among those that this rests on.
        """
        along = sums.precision @ directions
        precision = directions.T @ along - along.T @ self.covariance @ along
        return Sums(precision, directions.T @ sums.pull - along.T @ self.mean)


def posterior_of(sums: Sums, root: np.ndarray) -> Posterior:
    """With covariance ``root`` (C, K) root' before the data."""
    inner = root.T @ sums.precision @ root + np.eye(root.shape[1])
    against = root.T @ sums.pull
    inverse = np.linalg.inv(inner)
    along = inverse @ against
    log = 0.5 * float(against @ along) - 0.5 * float(np.linalg.slogdet(inner)[1]) + sums.log_factor
    squares = along**2 + np.diag(inverse)
    return Posterior(root @ along, root @ inverse @ root.T, log, squares)


def anything(persons: Persons, scale: np.ndarray) -> np.ndarray:
    """(C, K + S) root of the covariance if every fault may be there, and large."""
    is_mass = [one.effect == STATED_MASS.name for one in persons.moving]
    sizes = np.where(is_mass, persons.ordinary, SIZES[1])
    return np.hstack([persons.both * sizes, persons.differences(scale)])


def scales_of(
    persons: Persons, *parts: Iterable[int], start: np.ndarray | None = None
) -> np.ndarray:
    """(G,) of the deviations and of who stands still, of the largest evidence given any faults of
    the laboratory; of other sizes in each part of its persons. start (G,) : near to it."""
    everybody = [list(one) for one in parts] or [list(range(len(persons.pull)))]
    scale = np.ones(persons.count) if start is None else start
    for _ in range(_STEPS):
        found = [_squares(persons, scale, one) for one in everybody]
        squares, counts = np.sum(found, axis=0)
        before, scale = scale, np.sqrt((WEIGHT_OF_FAULTS + squares) / (WEIGHT_OF_FAULTS + counts))
        if np.abs(scale / before - 1).max() < _STEADY:
            break
    return scale


def _squares(persons: Persons, scale: np.ndarray, who: Sequence[int]) -> np.ndarray:
    """(2, G) expected squares, times what is usual, of the deviations and of the differences of who
    stands still, and how many these are."""
    found, both = posterior_of(sums_of(persons, scale, who), anything(persons, scale)), persons.both
    total, groups = np.zeros((2, persons.count)), persons.groups
    for precision, pull, usual in persons.blocks(who):
        variance, _ = _deviations(precision, usual * scale[groups], both)
        taken = variance @ both.T @ precision
        mean = np.einsum("mij,mj->mi", variance, pull @ both) - taken @ found.mean
        square = mean**2 + np.diagonal(variance, axis1=1, axis2=2)
        square += (taken @ found.covariance * taken).sum(axis=2)
        shown = (np.diagonal(precision, axis1=1, axis2=2) > 0) @ both > 0
        np.add.at(total[0], groups, (square / usual**2 * shown).sum(axis=0))
        np.add.at(total[1], groups, shown.sum(axis=0))
    differences = scale[persons.of_differences] ** 2 * found.squares[len(groups) :]
    np.add.at(total[0], persons.of_differences, differences)
    np.add.at(total[1], persons.of_differences, 1)
    return total


def alike_in(persons: Persons) -> np.ndarray:
    """(C, L) root of the covariance of what is the same in all persons in motion: a share of what
    one of them has, whose deviation is as usual. Their scatter shows nothing of it."""
    counts = (np.diagonal(persons.precision, axis1=1, axis2=2) > 0).sum(axis=0)
    moving = [
        k
        for k, one in enumerate(persons.coordinates)
        if counts[k] and not one.standing and one.effect != STATED_MASS.name
    ]
    one_of = np.sqrt(np.outer(counts, counts))[np.ix_(moving, moving)]
    everybody = sums_of(persons, np.ones(persons.count)).precision[np.ix_(moving, moving)]
    values, vectors = np.linalg.eigh(everybody / one_of)
    shown = values > _UNDETERMINED * values.max(initial=0.0)
    root = np.zeros((len(persons.coordinates), int(shown.sum())))
    root[moving] = vectors[:, shown] / np.sqrt(values[shown])
    return np.sqrt(persons.alike) * np.column_stack([root, _growing_lag(persons)])


def _growing_lag(persons: Persons) -> np.ndarray:
    """(C,) a delay that is no delay in the mean, but early and late in a recording as different as
    persons are: soft tissue lags, and clocks whose rates differ do as much."""
    lag = np.zeros(len(persons.coordinates))
    at = {one.effect: k for k, one in enumerate(persons.moving)}
    if {SyncOffset.name, ClockDrift.name} <= at.keys():
        delay, rate = at[SyncOffset.name], at[ClockDrift.name]
        mean_s, sd_s = persons.moments_s
        size = float(np.median(persons.usual[:, delay]))
        typical_s, typical = (persons.parameters[k].typical for k in (delay, rate))
        lag[rate], lag[delay] = size * typical_s / sd_s / typical, -size * mean_s / sd_s
    return lag


@dataclass(frozen=True, eq=False)
class Pooled:
    """All that a laboratory's persons show, to be kept: nothing of it grows with their number.

    precision (C, C), pull (C,) : of the sizes, as in ``Sums``. spread (C,) : standard deviation of
    a person's deviations, of each number. root (C, L) : of the covariance of the sizes before the
    data, the faults that were found among them.
    """

    coordinates: tuple[Coordinate, ...]
    precision: np.ndarray
    pull: np.ndarray
    spread: np.ndarray
    root: np.ndarray

    def posterior(self) -> Posterior:
        """By all persons."""
        return posterior_of(Sums(self.precision, self.pull), self.root)

    def without(self, own: Sequence[Information]) -> Pooled:
        """By all others: what a person's sessions have added is taken away."""
        precision, pull = _laid(self.coordinates, own)
        moving = [one for one in self.coordinates if not one.standing]
        numbers = [moving.index(replace(one, standing=False)) for one in self.coordinates]
        spread = np.tile(self.spread[: len(moving)], (len(own), 1))
        added = _sums(precision, pull, spread, np.eye(len(moving))[numbers])
        return replace(
            self, precision=self.precision - added.precision, pull=self.pull - added.pull
        )
