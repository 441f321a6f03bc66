"""What remains beside all causes: a cause is one only if it explains more than that.

Real recordings differ from the simulation in ways that go along with the movement and yet follow no
cause: shoes, clothes, skin. Turning signs does not show how large a score they bring, since they
are the same in every repetition; the best score that remains does.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bsip_cli.diagnosis.chance import group_of
from bsip_cli.diagnosis.explanation import Fit, fit_together
from bsip_cli.diagnosis.refitting import score_of, start_at
from bsip_cli.diagnosis.signatures import Signatures

Background = dict[tuple[int, ...], float]
"""By group of places (every trial alone, and the trials together) the best score that remains."""

_TRIES = 5  # causes that are refitted in a group


def background_of(signatures: Signatures, fit: Fit) -> Background:
    """Beside a fit, with a name or without.

    Refitted: signatures are those of small causes, and beside a long delay the signature of a short
    one seems to explain what no other delay does.
    """
    scored = signatures.scores(fit.residual[:, None], fit.tangent)
    scores, sizes = scored[0][:, 0], scored[1]
    best: Background = {}
    for k in _best_of_each(signatures, fit, scores):
        place = signatures.places[k]
        group = group_of(place.trials)
        if scores[k] > best.setdefault(group, 0.0):
            one = start_at(signatures.evidence, place, sizes[k])
            full = fit_together(signatures.evidence, (*fit.explanations, one))
            best[group] = max(best[group], score_of(fit, full, len(sizes[k])))
    return best


def _best_of_each(signatures: Signatures, fit: Fit, scores: np.ndarray) -> Iterator[int]:
    """In each group the best places of some causes, the best first."""
    seen: dict[tuple[int, ...], set] = {}
    new = np.array(new_places(signatures, fit))
    for k in new[np.argsort(-scores[new])]:
        place = signatures.places[k]
        causes = seen.setdefault(group_of(place.trials), set())
        cause = (place.candidate.effect, place.candidate.target)
        if cause not in causes and len(causes) < _TRIES:
            causes.add(cause)
            yield int(k)


def new_places(signatures: Signatures, fit: Fit) -> list[int]:
    """Places of what a fit does not hold yet: the rest of a cause is no other cause."""
    known = {(e.effect, e.target, t) for e in fit.explanations for t in e.place.trials}
    asked = ((k, p.candidate, p.trials) for k, p in enumerate(signatures.places))
    return [
        k for k, c, trials in asked if known.isdisjoint((c.effect, c.target, t) for t in trials)
    ]
