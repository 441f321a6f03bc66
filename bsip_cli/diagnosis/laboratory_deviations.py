"""Persons and sessions that deviate from their laboratory, and dates from which on it changed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp

from bsip_cli.diagnosis.fault_model import SIZES
from bsip_cli.diagnosis.laboratory import Offset, Sums, scales_of, sums_of
from bsip_cli.diagnosis.laboratory_search import (
    BEFORE,
    Cause,
    Laboratory,
    Size,
    log_prior_of,
    needed_of,
    sizes_of,
    smallest,
)
from bsip_cli.diagnosis.shared_faults import STATED_MASS, Coordinate

_DRAWS = 4000
_JUDGED = 10  # sessions that are judged with scales of their own


@dataclass(frozen=True, eq=False)
class Deviation:
    """A cause that some sessions have on top of what their laboratory has.

    sessions : their numbers among the laboratory's; one, or all from one on. class_id : of causes
    that cannot be distinguished; empty for one alone.
    """

    sessions: tuple[int, ...]
    cause: Cause
    said: str
    class_id: str
    probability: float
    sizes: tuple[Size, ...]


def deviations_of(
    lab: Laboratory,
    prior_odds: float,
    named_from: float,
    order: Sequence[int],
    rng: np.random.Generator,
) -> tuple[Deviation, ...]:
    """Each session judged by all others, at one prior odds for all sessions together.

    order : numbers of the sessions whose dates are known, the earliest first: of these a lasting
    change is asked too.
    """
    persons = lab.persons
    count = len(persons.pull)
    causes = (*lab.causes, *_stated_mass(lab))
    log_prior = log_prior_of(causes, prior_odds) - np.log(count + max(0, len(order) - 2))
    found: list[Deviation] = []
    alone = _likeliest(lab, causes, _each(lab) if count > 1 else ())
    since = _likeliest(lab, causes, _from_each_on(lab, order))
    likeliest = [(k,) for k in alone] + [tuple(order[k:]) for k in since]
    for sessions in likeliest:
        total, own = _by_the_others(lab, sessions)
        posterior = lab.posterior(sums=total)
        offsets = [posterior.offset(own, one.directions) for one in causes]
        logs = _log_odds(offsets, causes) + log_prior
        there = float(np.exp(logsumexp(logs) - np.logaddexp(0.0, logsumexp(logs))))
        if there < named_from:
            continue
        shares = dict(enumerate(np.exp(logs - np.logaddexp(0.0, logsumexp(logs))).tolist()))
        members = list(smallest(shares, named_from))
        for k in members:
            sizes = _sizes(offsets[k], causes[k], needed_of(log_prior[k], named_from), rng)
            said = "named" if len(members) == 1 else "ambiguous"
            class_id = "" if len(members) == 1 else f"{sessions[0] + 1}"
            found.append(Deviation(sessions, causes[k], said, class_id, shares[k], sizes))
    return tuple(found)


def _stated_mass(lab: Laboratory) -> Iterator[Cause]:
    coordinates = lab.persons.coordinates
    mine = Coordinate(STATED_MASS.name, "", STATED_MASS.parameter.name)
    directions = np.array([[float(one == mine)] for one in coordinates])
    yield Cause(STATED_MASS.name, "", (STATED_MASS.parameter,), directions)


def _each(lab: Laboratory) -> Iterator[tuple[int, Sums]]:
    for k in range(len(lab.persons.pull)):
        yield k, sums_of(lab.persons, lab.scale, (k,))


def _from_each_on(lab: Laboratory, order: Sequence[int]) -> Iterator[tuple[int, Sums]]:
    """Place in the order, and what all from there on show: at least two, and not everybody."""
    together = None
    for k in range(len(order) - 1, 0, -1):
        own = sums_of(lab.persons, lab.scale, (order[k],))
        together = own if together is None else together.with_(own)
        if k < len(order) - 1:
            yield k, together


def _likeliest(
    lab: Laboratory, causes: Sequence[Cause], asked: Iterable[tuple[int, Sums]]
) -> list[int]:
    """The sets of sessions that deviate most, with the scales of all: only of these the scales
    jointly with their deviation are fitted, which among many sessions are the same."""
    posterior = lab.posterior()
    odds = {}
    for k, own in asked:
        offsets = [posterior.offset(own, one.directions) for one in causes]
        odds[k] = _log_odds(offsets, causes).max()
    return sorted(sorted(odds, key=lambda k: odds[k])[-_JUDGED:])


def _by_the_others(lab: Laboratory, sessions: tuple[int, ...]) -> tuple[Sums, Sums]:
    """What all show and what some sessions show, with the scales of deviations from the others'
    laboratory and from their own."""
    persons = lab.persons
    others = np.setdiff1d(np.arange(len(persons.pull)), sessions)
    parts = (others, sessions) if len(sessions) > 1 else (others,)
    scale = scales_of(persons, *parts, start=lab.scale)
    own = sums_of(persons, scale, sessions)
    return sums_of(persons, scale, others).with_(own), own


def _log_odds(offsets: Sequence[Offset], causes: Sequence[Cause]) -> np.ndarray:
    pairs = zip(offsets, causes, strict=True)
    logs = np.array([logsumexp(one.log_factors(BEFORE, cause.most)) for one, cause in pairs])
    return logs - np.log(len(BEFORE))


def _sizes(
    offset: Offset, cause: Cause, needed: float, rng: np.random.Generator
) -> tuple[Size, ...]:
    mean, covariance = offset.of_size(SIZES[1])
    drawn = rng.multivariate_normal(mean, covariance, _DRAWS, check_valid="ignore")
    return sizes_of(drawn, cause.parameters, needed, rng)
