"""How small each fault might have been and still been named in these very recordings."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.special import logit

from bsip_cli.diagnosis.fault_model import SIZES, Session
from bsip_cli.diagnosis.fault_scores import Library, Place
from bsip_cli.diagnosis.fault_search import Found
from bsip_cli.diagnosis.pattern import UNEXPLAINED

_SURE = 1.645  # standard deviations: found in 95 of 100 recordings like these
_UNTOLD = 1e-3  # part of a parameter, squared, that lies in what the motion does not tell
_TOLD = 1e-5  # of what the likeliest combination of parameters is told: less is rounding


@dataclass(frozen=True)
class Limit:
    """Size of one parameter, the effect's others free, that would have been named; infinite where
    no possible one would."""

    place: Place
    parameter: str
    unit: str
    size: float


def limits_of(
    session: Session, library: Library, found: Found, named_from: float
) -> Iterator[Limit]:
    """Per effect, target and parameter, in the trials together or alone; what is of the body cannot
    be in one trial alone. Of moments, frequencies and windows the median counts: half of them show
    the fault better.
    """
    scores = found.scores
    limits: dict[tuple, list[Limit]] = {}
    kinds: dict[tuple, float] = {}
    for place, prior in zip(library.places, library.log_prior, strict=True):
        kinds[place.kind] = np.logaddexp(kinds.get(place.kind, -np.inf), prior)
    for place, information in zip(library.places, scores.information, strict=True):
        effect = place.candidate.effect
        if effect.name == UNEXPLAINED:
            continue
        inflation = float(scores.inflation[list(place.trials)].mean())
        spreads = np.sqrt(inflation) * _spreads(information)
        needed = float(logit(named_from)) - kinds[place.kind]
        scene = session.trials[place.trials[0]].scene
        for parameter, sd in zip(place.candidate.free(scene), spreads, strict=True):
            size = named_size(sd, needed) * parameter.typical
            size = max(size, effect.least_named.get(parameter.name, 0.0))
            size = size if size < parameter.most else np.inf
            key = (place.kind, parameter.name)
            limits.setdefault(key, []).append(Limit(place, parameter.name, parameter.unit, size))
    for mine in limits.values():
        yield sorted(mine, key=lambda one: one.size)[len(mine) // 2]


def named_size(sd: float, needed: float) -> float:
    """Size that is named in 95 of 100 recordings, in the unit of its standard deviation [typical].

    Evidence of a size x whose standard deviation is s is x^2 / (2 s^2), less what spreading over
    two decades costs, and must outweigh the prior odds (``needed``, a logarithm).
    """
    cost = np.log(np.hypot(1.0, SIZES[1] / sd)) if np.isfinite(sd) else 0.0
    return float(sd * (np.sqrt(2 * (needed + cost)) + _SURE))


def _spreads(information: np.ndarray) -> np.ndarray:
    """(k,) standard deviations of an effect's sizes [typical], infinite where the motion does not
    tell them: a hinge hides a shift along its axis."""
    squares, directions = np.linalg.eigh(information)
    told = squares > _TOLD * max(squares[-1], 1.0)
    spread = np.sqrt((directions[:, told] ** 2 / squares[told]).sum(axis=1))
    hidden = (directions[:, ~told] ** 2).sum(axis=1) > _UNTOLD
    return np.where(hidden, np.inf, spread)
