"""Persons and sessions that deviate from their laboratory, and dates from which on it changed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
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
    that cannot be told apart; empty for one alone.
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
    alone = [(k,) for k in range(count)] if count > 1 else []
    since = [tuple(order[k:]) for k in range(1, len(order) - 1)]
    likeliest = (*_likeliest(lab, causes, alone), *_likeliest(lab, causes, since))
    judged = [(sessions, *_by_the_others(lab, sessions)) for sessions in likeliest]
    for sessions, total, own in judged:
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


def _likeliest(
    lab: Laboratory, causes: Sequence[Cause], asked: Sequence[tuple[int, ...]]
) -> list[tuple[int, ...]]:
    """The sets of sessions that deviate most, with the scales of all: only of these the scales
    beside their deviation are fitted, which among many sessions are the same."""
    posterior, odds = lab.posterior(), []
    for sessions in asked:
        own = sums_of(lab.persons, lab.scale, sessions)
        offsets = [posterior.offset(own, one.directions) for one in causes]
        odds.append(_log_odds(offsets, causes).max())
    return [asked[k] for k in sorted(np.argsort(odds)[-_JUDGED:].tolist())]


def _by_the_others(lab: Laboratory, sessions: tuple[int, ...]) -> tuple[Sums, Sums]:
    """What all tell and what some sessions tell, with the scales of deviations from the others'
    laboratory and from their own."""
    others = lab.persons.only([k for k in range(len(lab.persons.pull)) if k not in sessions])
    mine = lab.persons.only(sessions)
    scale = scales_of(others, mine) if len(sessions) > 1 else scales_of(others)
    own = sums_of(mine, scale)
    return sums_of(others, scale).with_(own), own


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
