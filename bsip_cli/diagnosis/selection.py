"""Find the causes one after the other: score all, refit the best, keep what pays off unseen."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from bsip_cli.diagnosis.chance import flipped, p_value
from bsip_cli.diagnosis.explanation import Explanation, Fit, fit_together, refined
from bsip_cli.diagnosis.held_out import Gain, gain_of
from bsip_cli.diagnosis.patterns import UNEXPLAINED
from bsip_cli.diagnosis.signatures import Place, Signatures
from bsip_cli.diagnosis.together import Evidence

MOST = 3  # causes in one trial
TRIES = 10  # candidates that are refitted in a round
WORTH_A_TRY = 0.5  # of the best score
ALPHA = 0.05
# A cause from the catalogue is named though a regularity without a name explains so much more.
NAMED_AT = 0.8
AGAIN = 2.0  # how much more an effect counts that another trial shows already


@dataclass(frozen=True)
class Tried:
    """A candidate that was refitted in full, beside the causes found before it."""

    explanation: Explanation
    score: float
    p_value: float
    gain: Gain
    fit: Fit

    @property
    def is_good(self) -> bool:
        """Rarer by chance than ALPHA, and better on what it has not seen."""
        return self.p_value <= ALPHA and self.gain.is_real()


@dataclass(frozen=True)
class Round:
    """One step: candidates in the order of what they explain, and the one that was kept."""

    tried: tuple[Tried, ...]
    kept: Tried | None
    limit: float


@dataclass(frozen=True)
class Selection:
    """All rounds, and everything kept fitted together."""

    rounds: tuple[Round, ...]
    fit: Fit


def select(signatures: Signatures, rng: np.random.Generator) -> Selection:
    """Forward selection of up to three causes in each trial; after one without a name nothing
    can be told."""
    fit = fit_together(signatures.evidence, ())
    rounds: list[Round] = []
    while open_trials := _open_trials(signatures.evidence, fit):
        one = _round(signatures, fit, open_trials, rng)
        rounds.append(one)
        if one.kept is None:
            break
        fit = one.kept.fit
        if one.kept.explanation.effect.name == UNEXPLAINED:
            break
    return Selection(tuple(rounds), fit)


def _open_trials(evidence: Evidence, fit: Fit) -> set[int]:
    """Trials that may have another cause."""
    causes = Counter(t for one in fit.explanations for t in one.place.trials)
    return {t for t in range(len(evidence.trials)) if causes[t] < MOST}


def _round(
    signatures: Signatures, before: Fit, open_trials: set[int], rng: np.random.Generator
) -> Round:
    scores, sizes = signatures.scores(before.residual[:, None], before.tangent)
    tried: list[tuple[Explanation, Fit, float]] = []
    for k in _best_of_each(signatures, scores[:, 0], sizes, open_trials):
        if len(tried) >= TRIES or (tried and scores[k, 0] < WORTH_A_TRY * tried[0][2]):
            break
        one = _refitted(signatures.evidence, before, signatures.places[k], sizes[k])
        if one is not None:
            tried.append(one)
    if not tried:
        return Round((), None, np.inf)
    best = max(tried, key=lambda t: t[2])
    courses = flipped(signatures.evidence, best[1].residual, rng)
    chance = signatures.scores(courses, best[1].tangent)[0].max(axis=0)
    judged = [_judged(signatures.evidence, before, *one, chance) for one in tried]
    judged.sort(key=lambda t: -t.score)
    return Round(tuple(judged), _kept(judged, before), float(np.quantile(chance, 1 - ALPHA)))


def _kept(judged: list[Tried], before: Fit) -> Tried | None:
    """The cause that explains most; those that recur in several trials count together."""
    good = [one for one in judged if one.is_good]
    if not good:
        return None
    weights = _with_recurrence(good, before)
    named = [one for one in good if one.explanation.effect.name != UNEXPLAINED]
    best = max(good, key=lambda one: weights[id(one)])
    if not named:
        return best
    first = max(named, key=lambda one: weights[id(one)])
    return first if weights[id(first)] >= NAMED_AT * weights[id(best)] else best


def _with_recurrence(good: list[Tried], before: Fit) -> dict[int, float]:
    """Score of each; with it the best of the same effect in every other trial where it differs.

    What was found in another trial already is the likeliest cause here.
    """
    known = {one.effect for one in before.explanations}
    weights = {}
    for one in good:
        place = one.explanation.place
        weights[id(one)] = one.score
        if one.explanation.effect.lasts or len(place.trials) > 1:
            continue
        alike = [t for t in good if t.explanation.effect is one.explanation.effect]
        best: dict[int, float] = {}
        for other in alike:
            for trial in set(other.explanation.place.trials) - set(place.trials):
                best[trial] = max(best.get(trial, 0.0), other.score)
        weights[id(one)] += sum(best.values())
        if one.explanation.effect in known:
            weights[id(one)] *= AGAIN
    return weights


def _best_of_each(
    signatures: Signatures, scores: np.ndarray, sizes: list[np.ndarray], open_trials: set[int]
) -> Iterator[int]:
    """The best possible place of every effect and target, the best first.

    An effect that does not last is another one in every trial.
    """
    seen = set()
    for k in np.argsort(-scores):
        place = signatures.places[k]
        if not open_trials.issuperset(place.trials):
            continue
        effect = place.candidate.effect
        key = (effect, place.candidate.target, () if effect.lasts else place.trials)
        if key in seen:
            continue
        start = _start(signatures.evidence, place, sizes[k])
        if not start.is_possible(signatures.evidence):
            continue
        seen.add(key)
        yield int(k)


def _start(evidence: Evidence, place: Place, sizes: np.ndarray) -> Explanation:
    scene = evidence.trials[place.trials[0]].scene
    null = Explanation(place, place.candidate.values(scene, np.zeros(len(sizes))))
    return null.moved_freely(evidence, sizes)


def _refitted(
    evidence: Evidence, before: Fit, place: Place, sizes: np.ndarray
) -> tuple[Explanation, Fit, float] | None:
    """In full, beside the causes found before; nothing if it turns out impossible."""
    start = refined(evidence, _start(evidence, place, sizes), before)
    fit = fit_together(evidence, (*before.explanations, start))
    found = fit.explanations[-1]
    if not found.is_possible(evidence) or found.is_negligible(evidence):
        return None
    if not found.agrees_with_markers(evidence):
        return None
    return found, fit, _score(before, fit, len(sizes))


def _judged(
    evidence: Evidence,
    before: Fit,
    found: Explanation,
    fit: Fit,
    score: float,
    chance: np.ndarray,
) -> Tried:
    gain = gain_of(evidence, found.place.trials, before.residual, fit.residual, fit.tangent)
    return Tried(found, score, p_value(score, chance), gain, fit)


def _score(before: Fit, after: Fit, free: int) -> float:
    """-log p of what the squared residual loses, by the chi-square of the free parameters."""
    lost = float((before.residual**2).sum() - (after.residual**2).sum())
    return float(-chi2.logsf(max(lost, 0.0), free))
