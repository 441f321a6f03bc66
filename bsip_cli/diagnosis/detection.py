"""How small each cause might have been and still been seen in these very recordings."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bsip_cli.diagnosis.explanation import NEGLIGIBLE
from bsip_cli.diagnosis.pattern import UNEXPLAINED
from bsip_cli.diagnosis.selection import ALPHA, WORTH, Selection
from bsip_cli.diagnosis.signatures import Place

_SURE = 1.645  # standard deviations: found in 95 of 100 recordings like these


@dataclass(frozen=True)
class Limit:
    """Size of one parameter, the effect's others free, that would have been found."""

    place: Place
    parameter: str
    unit: str
    size: float


def limits_of(selection: Selection) -> Iterator[Limit]:
    """Per effect, target and parameter, in the trials together or alone."""
    signatures = selection.signatures
    fit = selection.fit
    chances = [one.chance for one in selection.rounds if one.chance is not None]
    if not chances:
        return
    last = chances[-1]
    scores = zip(signatures.places, signatures.information(fit.tangent), strict=True)
    found: dict[tuple, Limit] = {}
    for place, information in scores:
        effect = place.candidate.effect
        if effect.name == UNEXPLAINED:
            continue
        scene = signatures.evidence.trials[place.trials[0]].scene
        spread = np.sqrt(np.maximum(np.diag(np.linalg.pinv(information, hermitian=True)), 0.0))
        rows = sum(len(signatures.evidence.trials[t].residual) for t in place.trials)
        least = max(last.limit(place.trials, ALPHA), WORTH * rows / 2)
        for parameter, sd in zip(place.candidate.free(scene), spread, strict=True):
            needed = max(sd * (np.sqrt(2 * least) + _SURE), NEGLIGIBLE)
            size = max(needed * parameter.typical, effect.least_named.get(parameter.name, 0.0))
            limit = Limit(place, parameter.name, parameter.unit, size)
            key = (effect.name, place.candidate.target, place.trials, parameter.name)
            # Of the moments, frequencies and windows, the one where it shows best.
            if key not in found or limit.size < found[key].size:
                found[key] = limit
    yield from found.values()
