"""A candidate in full beside the causes found before it, in the trials that support it."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from bsip_cli.diagnosis.explanation import Explanation, Fit, fit_together, refined
from bsip_cli.diagnosis.signatures import Place, Signatures
from bsip_cli.diagnosis.together import Evidence
from bsip_cli.statistics.chi_square import minus_log_p

SUPPORT = 8.0  # squared white residual that a trial must save to share a cause
# Of what a cause explains in a trial: so much is lost where its size is a quarter off.
OTHER_SIZE = 0.0625
# Standard deviations of the stated mass, by which a cause takes the body away from it at most.
FURTHER = 3.0


class Refitted(NamedTuple):
    """A candidate in full, the fit with it, and its score."""

    explanation: Explanation
    fit: Fit
    score: float


def start_at(evidence: Evidence, place: Place, sizes: np.ndarray) -> Explanation:
    scene = evidence.trials[place.trials[0]].scene
    null = Explanation(place, place.candidate.values(scene, np.zeros(len(sizes))))
    return null.moved_freely(evidence, sizes)


def refitted(
    signatures: Signatures, before: Fit, place: Place, sizes: np.ndarray, open_trials: set[int]
) -> Refitted | None:
    """In full, beside the causes found before; nothing if it turns out impossible.

    What lasts is tried in all trials too, and given up in those that do not support it, or
    with another size.
    """
    evidence = signatures.evidence
    start = refined(evidence, start_at(evidence, place, sizes), before)
    known = {t for e in before.explanations if alike(e, start) for t in e.place.trials}
    everywhere = signatures.trials_of(place.candidate) & open_trials - known
    fits = [fit_together(evidence, (*before.explanations, start))]
    if place.candidate.effect.lasts and everywhere > set(place.trials):
        wider = replace(start, place=replace(place, trials=tuple(sorted(everywhere))))
        fits.append(fit_together(evidence, (*before.explanations, wider)))
    fit = min((_supported(evidence, before, one) for one in fits), key=lambda one: one.squares)
    found = fit.explanations[-1]
    if not found.is_possible(evidence) or found.is_negligible(evidence):
        return None
    if not found.agrees_with_markers(evidence) or needs_another_mass(evidence, before, fit):
        return None
    return Refitted(found, fit, score_of(before, fit, len(sizes)))


def needs_another_mass(evidence: Evidence, before: Fit, fit: Fit) -> bool:
    """Whether a cause is true only of somebody whom the scale shows to be someone else."""
    without, beside = (abs(evidence.beyond_stated(one.residual)) for one in (before, fit))
    return beside > without + FURTHER


def alike(one: Explanation, other: Explanation) -> bool:
    """Whether they are the same effect at the same place."""
    return (one.effect, one.target) == (other.effect, other.target)


def _supported(evidence: Evidence, before: Fit, fit: Fit) -> Fit:
    """The last cause in those of its trials only whose residual becomes smaller by it, and that
    agree on its size."""
    one = fit.explanations[-1]
    saved = before.residual**2 - fit.residual**2
    trials = tuple(t for t in one.place.trials if saved[evidence.rows(t)].sum() > SUPPORT)
    if trials == one.place.trials and len(trials) > 1:
        trials = agreeing(evidence, fit, saved)
    if not trials or trials == one.place.trials:
        return fit
    fewer = replace(one, place=replace(one.place, trials=trials))
    return _supported(evidence, before, fit_together(evidence, (*fit.explanations[:-1], fewer)))


def agreeing(evidence: Evidence, fit: Fit, saved: np.ndarray) -> tuple[int, ...]:
    """Trials of the last cause but the one, if any, that a size of its own fits far better, beyond
    what sizes are known to."""
    one = fit.explanations[-1]
    trials = one.place.trials
    mine = fit.columns(len(fit.explanations) - 1, evidence)
    known_to = one.known_to(evidence)
    shares = {}
    for t in trials:
        rows = evidence.rows(t)
        tangent, residual = fit.tangent[rows, mine], fit.residual[rows]
        own = np.linalg.lstsq(tangent, residual, rcond=None)[0]
        more = float(residual @ tangent @ own) - _saved_by_small(tangent * known_to, residual)
        whole = more + float(saved[rows].sum())
        shares[t] = more / max(whole, SUPPORT / OTHER_SIZE)
    odd = max(trials, key=lambda t: shares[t])
    return tuple(t for t in trials if t != odd or shares[t] < OTHER_SIZE)


def _saved_by_small(tangent: np.ndarray, residual: np.ndarray) -> float:
    """Squared residual that sizes of unit spread before the data save, less what they cost."""
    right = tangent.T @ residual
    return float(right @ np.linalg.solve(tangent.T @ tangent + np.eye(len(right)), right))


def score_of(before: Fit, after: Fit, free: int) -> float:
    """-log p of what the squared residual loses, by the chi-square of the free parameters."""
    return float(minus_log_p(before.squares - after.squares, free))
