"""What remains beside all causes: a cause is one only if it explains more than that.

Real recordings differ from the simulation in ways that go along with the movement and yet follow no
cause: shoes, clothes, skin. Turning signs does not show how large a score they bring, since they
are the same in every repetition; the best score that remains does.
"""

from __future__ import annotations

from bsip_cli.diagnosis.chance import group_of
from bsip_cli.diagnosis.explanation import Fit
from bsip_cli.diagnosis.signatures import Signatures

Background = dict[tuple[int, ...], float]
"""By group of places (every trial alone, and the trials together) the best score that remains."""


def background_of(signatures: Signatures, fit: Fit) -> Background:
    """Beside a fit, whether it is possible or not, with a name or without."""
    scores, _ = signatures.scores(fit.residual[:, None], fit.tangent)
    best: Background = {}
    for k in new_places(signatures, fit):
        group = group_of(signatures.places[k].trials)
        best[group] = max(best.get(group, 0.0), float(scores[k, 0]))
    return best


def new_places(signatures: Signatures, fit: Fit) -> list[int]:
    """Places of what a fit does not hold yet: the rest of a cause is no other cause."""
    known = {(e.effect, e.target, t) for e in fit.explanations for t in e.place.trials}
    asked = ((k, p.candidate, p.trials) for k, p in enumerate(signatures.places))
    return [
        k for k, c, trials in asked if known.isdisjoint((c.effect, c.target, t) for t in trials)
    ]
