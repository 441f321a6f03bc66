"""How small each cause might have been and still been seen in these very recordings."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bsip_cli.diagnosis.chance import group_of
from bsip_cli.diagnosis.explanation import NEGLIGIBLE
from bsip_cli.diagnosis.fair_sizes import known_to
from bsip_cli.diagnosis.judging import ALPHA, WORTH
from bsip_cli.diagnosis.pattern import UNEXPLAINED
from bsip_cli.diagnosis.rounds import Selection
from bsip_cli.diagnosis.signatures import Place
from bsip_cli.statistics.normal import Z95

_SURE = 1.645  # standard deviations: found in 95 of 100 recordings like these
_TOLD = (
    1e-5  # of what the likeliest combination of an effect's parameters is told: less is rounding
)
_ALONE = 1e-3  # part of a parameter, squared, that lies in what is not told


@dataclass(frozen=True)
class Limit:
    """Size of one parameter, the effect's others free, that would have been found; infinite where
    no possible one would."""

    place: Place
    parameter: str
    unit: str
    size: float


def limits_of(selection: Selection) -> Iterator[Limit]:
    """Per effect, target and parameter, in the trials together or alone; what is of the body cannot
    be in one trial alone. Of moments, frequencies and windows the median counts: half of them show
    the cause better."""
    signatures = selection.signatures
    fit = selection.fit
    chances = [one.chance for one in selection.rounds if one.chance is not None]
    last = chances[-1]
    scores = zip(signatures.places, signatures.information(fit.tangent), strict=True)
    found: dict[tuple, list[Limit]] = {}
    for place, information in scores:
        effect = place.candidate.effect
        elsewhere = signatures.trials_of(place.candidate) - set(place.trials)
        if effect.name == UNEXPLAINED or (effect.of_the_body and elsewhere):
            continue
        scene = signatures.evidence.trials[place.trials[0]].scene
        rows = sum(len(signatures.evidence.trials[t].residual) for t in place.trials)
        beyond = selection.background.get(group_of(place.trials), 0.0)
        beyond_scale = (Z95 + _SURE) * known_to(signatures.evidence, place)
        least = max(last.limit(place.trials, ALPHA), beyond, WORTH * rows / 2)
        for parameter, sd in zip(place.candidate.free(scene), _spreads(information), strict=True):
            needed = max(sd * (np.sqrt(2 * least) + _SURE), NEGLIGIBLE)
            named = max(beyond_scale, effect.least_named.get(parameter.name, 0.0))
            size = max(needed * parameter.typical, named)
            size = size if size < parameter.most else np.inf
            limit = Limit(place, parameter.name, parameter.unit, size)
            key = (effect.name, place.candidate.target, place.trials, parameter.name)
            found.setdefault(key, []).append(limit)
    for limits in found.values():
        yield sorted(limits, key=lambda one: one.size)[len(limits) // 2]


def _spreads(information: np.ndarray) -> np.ndarray:
    """(k,) standard deviations of an effect's sizes, infinite where the motion does not tell them:
    a hinge hides a shift along its axis."""
    squares, directions = np.linalg.eigh(information)
    told = squares > _TOLD * max(squares[-1], 1.0)
    spread = np.sqrt((directions[:, told] ** 2 / squares[told]).sum(axis=1))
    hidden = (directions[:, ~told] ** 2).sum(axis=1) > _ALONE
    return np.where(hidden, np.inf, spread)
