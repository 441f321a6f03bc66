"""The shared faults of all who were recorded in one laboratory, as one small Gaussian model.

Each person's recordings tell something of the shared faults (``shared_faults``): of theta + d, with
theta the laboratory's sizes and d the person's own deviation, since nobody's body and skin are just
as the model has them. How large deviations are follows from the data, by kind of number (a random
effect, its variance by expectation and maximisation: Dempster 1977, J R Stat Soc B 39; Laird and
Ware 1982, Biometrics 38). What is told in motion and by who stands still are coordinates of their
own, E d what a person deviates in both. With J and h a person's precision and pull and T^2 the
variance of d, the person adds J - J E V E' J and h - J E V E' h to what is known of the
coordinates, V = (E' J E + T^-2)^-1. These are E theta, and for who stands still a difference more
in all persons alike, whose size follows from the data too: plates may be moved before they walk.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm

from bsip_cli.diagnosis.error_model import WEIGHT_OF_FAULTS
from bsip_cli.diagnosis.error_terms import SHARE
from bsip_cli.diagnosis.fault_model import SIZES
from bsip_cli.diagnosis.shared_faults import STATED_MASS, Coordinate, Information
from bsip_cli.effects.clocks import ClockDrift, SyncOffset
from bsip_cli.effects.effect import Parameter

_STEPS = 100  # of expectation and maximisation, at most
_STEADY = 0.01  # change of every scale


@dataclass(frozen=True, eq=False)
class Persons:
    """What M persons tell of C coordinates [typical sizes], which are K numbers in motion and, some
    of them, of who stands still too.

    precision (M, C, C), pull (M, C) : of each alone; 0 where nothing is told.
    numbers (C,) : which number a coordinate is; the first K are those in motion.
    usual (M, K) : standard deviation of the deviations before the data. groups (K,) : whose
    deviations have one scale; behind them as many groups of differences of who stands still.
    ordinary (K,) : what every laboratory has of a fault.
    alike (C, L) : root of the covariance of what persons' bodies do alike.
    """

    coordinates: tuple[Coordinate, ...]
    parameters: tuple[Parameter, ...]
    precision: np.ndarray
    pull: np.ndarray
    numbers: np.ndarray
    usual: np.ndarray
    groups: np.ndarray
    ordinary: np.ndarray
    alike: np.ndarray

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

    def told(self) -> np.ndarray:
        """(M, K) True where a person tells something of a number."""
        return (np.diagonal(self.precision, axis1=1, axis2=2) > 0) @ self.both > 0

    def only(self, numbers: Sequence[int]) -> Persons:
        """Some of them."""
        mine = list(numbers)
        precision, pull, usual = self.precision[mine], self.pull[mine], self.usual[mine]
        return replace(self, precision=precision, pull=pull, usual=usual)

    def differences(self, scale: np.ndarray) -> np.ndarray:
        """(C, S) root of the covariance of the differences of who stands still: usually as large as
        persons deviate, since a body's model errs otherwise in motion."""
        mine = self.standing
        sizes = self.usual[0, self.numbers[mine]] * scale[self.of_differences]
        return np.eye(len(self.coordinates))[:, mine] * sizes


@dataclass(frozen=True)
class Alike:
    """What the model of a body lacks of all persons alike passes for faults of the laboratory: of a
    plate, and, since soft tissue lags other early than late in a stance, of a clock's delay and
    rate.

    size : standard deviation [typical]. moments_s : mean and standard deviation of the moments that
    tell of the clock, from the start of a recording.
    """

    size: float
    moments_s: tuple[float, float]

    def root(
        self, coordinates: Sequence[Coordinate], known: Mapping[Coordinate, Parameter]
    ) -> np.ndarray:
        """(C, C) of the covariance [typical]. Nothing of it is in who stands still."""
        mean_s, sd_s = self.moments_s
        moving = [one.effect != STATED_MASS.name and not one.standing for one in coordinates]
        root = self.size * np.diag(np.array(moving, float))
        names = {one.effect: k for k, one in enumerate(coordinates) if moving[k]}
        if {SyncOffset.name, ClockDrift.name} <= names.keys():
            delay, rate = names[SyncOffset.name], names[ClockDrift.name]
            later = self.size * known[coordinates[delay]].typical / sd_s
            root[rate, rate] = later / known[coordinates[rate]].typical
            root[delay, rate] = -self.size * mean_s / sd_s
        return root


NOTHING_ALIKE = Alike(0.0, (0.0, 1.0))


def persons_of(
    informations: Sequence[Information],
    mass_sd: Sequence[float],
    deviation: float,
    alike: Alike = NOTHING_ALIKE,
) -> Persons:
    """Lay out what was kept of each.

    mass_sd : (M,) standard deviation of each stated mass, part of it. deviation : usual standard
    deviation from person to person [typical].
    """
    known = {
        x: p for one in informations for x, p in zip(one.coordinates, one.parameters, strict=True)
    }
    known |= {replace(x, standing=False): p for x, p in known.items()}  # none may tell it in motion
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
        alike.root(coordinates, known),
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
    integrated out; ``log_factor``: of the evidence, that the deviations are of this size."""

    precision: np.ndarray
    pull: np.ndarray
    log_factor: float

    def with_(self, others: Sums) -> Sums:
        """And what some others tell."""
        return Sums(
            self.precision + others.precision,
            self.pull + others.pull,
            self.log_factor + others.log_factor,
        )


def sums_of(persons: Persons, scale: np.ndarray, who: Iterable[int] | None = None) -> Sums:
    """Of all persons or some; scale (G,) times what is usual: of their deviations."""
    mine = slice(None) if who is None else list(who)
    precision, pull = persons.precision[mine], persons.pull[mine]
    spread = persons.usual[mine] * scale[persons.groups]
    return _sums(precision, pull, spread, persons.both)


def _sums(precision: np.ndarray, pull: np.ndarray, spread: np.ndarray, both: np.ndarray) -> Sums:
    variance, volume = _deviations(precision, spread, both)
    across, against = precision @ both, pull @ both
    along = np.einsum("mij,mj->mi", variance, against)
    return Sums(
        (precision - across @ variance @ across.swapaxes(1, 2)).sum(axis=0),
        (pull - np.einsum("mij,mj->mi", across, along)).sum(axis=0),
        0.5 * float((against * along).sum()) - 0.5 * float(volume.sum()),
    )


def _deviations(
    precision: np.ndarray, spread: np.ndarray, both: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(M, K, K) covariance of each person's deviations (M, K) given the laboratory's sizes, and
    (M,) logarithm of how much less volume than before the data."""
    told = both.T @ precision @ both
    inner = spread[:, :, None] * told * spread[:, None] + np.eye(spread.shape[1])
    variance = spread[:, :, None] * np.linalg.inv(inner) * spread[:, None]
    return variance, np.linalg.slogdet(inner)[1]


@dataclass(frozen=True, eq=False)
class Offset:
    """What is told of k more numbers [typical]: precision (k, k) and pull (k,)."""

    precision: np.ndarray
    pull: np.ndarray

    def log_factors(self, sizes: np.ndarray, most: np.ndarray) -> np.ndarray:
        """(S,) logarithm of the Bayes factor that they are there, with these standard deviations
        before the data, and none of them is larger than ``most`` (k,)."""
        values, vectors = np.linalg.eigh(self.precision)
        values, along = np.maximum(values, 0.0), vectors.T @ self.pull
        added = values + 1 / sizes[:, None] ** 2
        gains = along**2 / added - np.log(added * sizes[:, None] ** 2)
        mean = (along / added) @ vectors.T
        spread = np.sqrt((1 / added) @ (vectors**2).T)
        after = _log_within(mean, spread, most).sum(axis=1)
        before = _log_within(np.zeros_like(mean), sizes[:, None], most).sum(axis=1)
        return np.asarray(0.5 * gains.sum(axis=1) + after - before)

    def of_size(self, size: float) -> tuple[np.ndarray, np.ndarray]:
        """Mean (k,) and covariance (k, k) if they are there."""
        covariance = np.linalg.inv(self.precision + np.eye(len(self.pull)) / size**2)
        return covariance @ self.pull, covariance


def _log_within(mean: np.ndarray, spread: np.ndarray, most: np.ndarray) -> np.ndarray:
    """Logarithm of the probability of numbers within +-most, the sign being that of the mean."""
    far = np.abs(mean)
    inside, below = norm.logcdf((most - far) / spread), norm.logcdf((-most - far) / spread)
    return np.asarray(inside + np.log1p(-np.exp(below - inside)))


@dataclass(frozen=True, eq=False)
class Posterior:
    """Of sizes: mean (C,), covariance (C, C), and the logarithm of the evidence; squares (K,) that
    are expected of the coefficients of what they were before the data."""

    mean: np.ndarray
    covariance: np.ndarray
    log_evidence: float
    squares: np.ndarray

    def offset(self, sums: Sums, directions: np.ndarray) -> Offset:
        """What is told of sizes along ``directions`` (C, k) that some persons have on top of this.

        sums : of these persons, who are among those that this rests on.
        """
        along = sums.precision @ directions
        precision = directions.T @ along - along.T @ self.covariance @ along
        return Offset(precision, directions.T @ sums.pull - along.T @ self.mean)


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
    moving = persons.coordinates[: len(persons.groups)]
    is_mass = [one.effect == STATED_MASS.name for one in moving]
    sizes = np.where(is_mass, persons.ordinary, SIZES[1])
    return np.hstack([persons.both * sizes, persons.differences(scale)])


def scales_of(*parts: Persons) -> np.ndarray:
    """(G,) of the deviations and of who stands still, of the largest evidence beside any faults of
    the laboratory; of other sizes in each part of its persons."""
    first = parts[0]
    counts, scale = np.zeros(first.count), np.ones(first.count)
    np.add.at(counts, first.groups, sum(one.told().sum(axis=0) for one in parts))
    np.add.at(counts, first.of_differences, len(parts))
    for _ in range(_STEPS):
        before, sums = scale, np.zeros(len(scale))
        for one in parts:
            squares, differences = squares_of(one, scale)
            np.add.at(sums, first.groups, (squares * one.told()).sum(axis=0))
            np.add.at(sums, first.of_differences, differences)
        scale = np.sqrt((WEIGHT_OF_FAULTS + sums) / (WEIGHT_OF_FAULTS + counts))
        if np.abs(scale / before - 1).max() < _STEADY:
            break
    return scale


def squares_of(persons: Persons, scale: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(M, K) and (S,) expected squares of the deviations and of the differences of who stands
    still, times what is usual."""
    found, both = posterior_of(sums_of(persons, scale), anything(persons, scale)), persons.both
    variance, _ = _deviations(persons.precision, persons.usual * scale[persons.groups], both)
    taken = variance @ both.T @ persons.precision
    mean = np.einsum("mij,mj->mi", variance, persons.pull @ both) - taken @ found.mean
    square = mean**2 + np.diagonal(variance, axis1=1, axis2=2)
    square += np.einsum("mij,jk,mik->mi", taken, found.covariance, taken, optimize=True)
    differences = scale[persons.of_differences] ** 2 * found.squares[len(persons.groups) :]
    return square / persons.usual**2, differences


def log_prior_of_scales(scale: np.ndarray) -> float:
    """Logarithm of their density before the data, less a constant."""
    return -0.5 * WEIGHT_OF_FAULTS * float((2 * np.log(scale) + 1 / scale**2 - 1).sum())


@dataclass(frozen=True, eq=False)
class Pooled:
    """All that a laboratory's persons tell, to be kept: nothing of it grows with their number.

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
        return posterior_of(Sums(self.precision, self.pull, 0.0), self.root)

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
