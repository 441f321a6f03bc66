"""Find the causes one after the other: score all, refit the best, keep what pays off unseen."""

from __future__ import annotations

from collections import Counter
from collections.abc import Container, Iterator, Sequence
from dataclasses import replace
from itertools import islice, product

import numpy as np

from bsip_cli.diagnosis.background import new_places
from bsip_cli.diagnosis.chance import Chance, chance_of, flipped
from bsip_cli.diagnosis.explanation import Explanation, Fit, fit_together
from bsip_cli.diagnosis.foremost import foremost
from bsip_cli.diagnosis.judging import ALPHA, Tried, judged_by, stands_beside
from bsip_cli.diagnosis.likely_noise import likely_columns, with_likely_noise
from bsip_cli.diagnosis.pattern import UNEXPLAINED
from bsip_cli.diagnosis.refitting import Refitted, refitted, start_at
from bsip_cli.diagnosis.rivals import in_few_trials, rivals_of
from bsip_cli.diagnosis.rounds import Round, Selection
from bsip_cli.diagnosis.settling import settled, told_once
from bsip_cli.diagnosis.signatures import Signatures
from bsip_cli.diagnosis.together import Evidence
from bsip_cli.effects.effect import Effect

MOST = 3  # causes in one trial
TRIES = 10  # candidates that are refitted in a round
SHOWN = 3  # that are looked at even where nothing stands out
RIVALS_TRIED = 2  # in each trial of a lasting cause that few trials show
WORTH_A_TRY = 0.5  # of the best score
OVERSHADOWS = 2.0  # so many times the score


Scored = tuple[np.ndarray, list[np.ndarray]]
"""Of all places in one round: their scores (K, 1) and likeliest sizes."""


def select(
    signatures: Signatures, rng: np.random.Generator, first: Round | None = None
) -> Selection:
    """Forward selection of up to three causes in each trial; in a trial with one that can only
    be without a name nothing more can be told. ``first`` is known beforehand."""
    rounds = [first] if first is not None and first.kept is not None else []
    found: tuple[Explanation, ...] = tuple(r.kept.explanation for r in rounds if r.kept)
    while open_trials := _open_trials(signatures.evidence, rounds):
        before = fit_together(signatures.evidence, found)
        signatures, before = with_likely_noise(signatures, before)
        one = _round(signatures, before, open_trials, rng)
        rounds.append(one)
        if one.kept is None:
            break
        found = one.kept.fit.explanations
    return settled(signatures, *told_once(signatures, rounds, found), rng)


def _open_trials(evidence: Evidence, rounds: Sequence[Round]) -> set[int]:
    """Trials that may have another cause."""
    kept = [one.kept for one in rounds if one.kept is not None]
    causes = Counter(t for one in kept for t in one.trials)
    unknown = {t for one in kept if one.is_without_name for t in one.trials}
    return {t for t in range(len(evidence.trials)) if causes[t] < MOST} - unknown


def _round(
    signatures: Signatures, before: Fit, open_trials: set[int], rng: np.random.Generator
) -> Round:
    """Where the best is no cause, though chance hardly brings it, the other trials are asked."""
    evidence = signatures.evidence
    rough = _chance(signatures, before, rng)
    scored = signatures.scores(before.residual[:, None], before.tangent)
    tried = _tried(signatures, before, scored, open_trials, rough)
    tried += _elsewhere(signatures, before, scored, tried)
    tried += _apart(signatures, before, scored, tried)
    chance = _chance(signatures, max(tried, key=lambda t: t.score).fit if tried else before, rng)
    judged = [judged_by(evidence, before, *one, chance) for one in tried]
    while _kept(judged, before) is None and (in_vain := _in_vain(judged) & open_trials):
        open_trials = open_trials - in_vain
        more = _tried(signatures, before, scored, open_trials, rough)
        judged += [judged_by(evidence, before, *one, chance) for one in more]
    judged.sort(key=lambda t: -t.score)
    kept = _kept(judged, before)
    if kept is None:
        return Round(evidence, tuple(judged), None, chance)
    apart = in_few_trials(signatures, kept.explanation)
    named = replace(kept, rivals=rivals_of(evidence, kept, judged, apart))
    return Round(evidence, tuple(named if t is kept else t for t in judged), named, chance)


def _tried(
    signatures: Signatures, before: Fit, scored: Scored, open_trials: set[int], rough: Chance
) -> list[Refitted]:
    """The best candidates, refitted in full.

    A few of them whatever they are; more only where chance may be left behind.
    """
    scores, sizes = scored
    tried: list[Refitted] = []
    ranked = _best_of_each(signatures, scores[:, 0], sizes, open_trials, before)
    for asked, k in enumerate(ranked):
        place, score = signatures.places[k], scores[k, 0]
        best_yet = max((t.score for t in tried), default=0.0)
        hopeless = score < WORTH_A_TRY * max(best_yet, rough.limit(place.trials, ALPHA))
        if len(tried) >= TRIES or (hopeless and (len(tried) >= SHOWN or asked >= 2 * TRIES)):
            break
        one = refitted(signatures, before, place, sizes[k], open_trials)
        if one is not None:
            tried.append(one)
    return tried


def _elsewhere(
    signatures: Signatures, before: Fit, scored: Scored, tried: Sequence[Refitted]
) -> Iterator[Refitted]:
    """What betters a lasting cause in one of its trials, in the others of them too: a clock that
    jumps in every trial, at another moment each, passes for one that drifts in all."""
    if not tried:
        return
    leader, fit, _ = max(tried, key=lambda one: one.score)
    shared = leader.place.trials if leader.effect.lasts else ()
    alone = [
        (one.effect, t, own)
        for one, own, _ in tried
        if not one.effect.lasts
        for t in one.place.trials
    ]
    evidence = signatures.evidence
    better = dict.fromkeys(
        effect
        for effect, t, own in alone
        if t in shared and _squares_in(evidence, own, t) < _squares_in(evidence, fit, t)
    )
    known = {(effect, t) for effect, t, _ in alone}
    for effect, t in product(better, shared):
        if (effect, t) not in known:
            yield from _alone(signatures, before, scored, t, (effect,), 1)


def _apart(
    signatures: Signatures, before: Fit, scored: Scored, tried: Sequence[Refitted]
) -> Iterator[Refitted]:
    """What else a fault of the lab that few trials show may be in each of them: what is worn in two
    of them, at two places, passes for one plate that reads too much."""
    known = {_key(one.explanation) for one in tried}
    catalogue = {p.candidate.effect for p in signatures.places}
    named = {effect for effect in catalogue if effect.name != UNEXPLAINED}
    asked = {
        (one.effect, t)
        for one, _, _ in tried
        if in_few_trials(signatures, one)
        for t in one.place.trials
    }
    for effect, t in sorted(asked, key=lambda pair: (pair[1], pair[0].name)):
        for other in _alone(signatures, before, scored, t, named - {effect}, RIVALS_TRIED):
            if _key(other.explanation) not in known:
                known.add(_key(other.explanation))
                yield other


def _key(one: Explanation) -> tuple[Effect, str, tuple[int, ...]]:
    return one.effect, one.target, one.place.trials


def _alone(
    signatures: Signatures,
    before: Fit,
    scored: Scored,
    trial: int,
    effects: Container[Effect],
    most: int,
) -> Iterator[Refitted]:
    """The best candidates of some effects in one trial, refitted in full."""
    scores, sizes = scored
    ranked = _best_of_each(signatures, scores[:, 0], sizes, {trial}, before)
    mine = (k for k in ranked if signatures.places[k].candidate.effect in effects)
    for k in islice(mine, most):
        one = refitted(signatures, before, signatures.places[k], sizes[k], {trial})
        if one is not None:
            yield one


def _squares_in(evidence: Evidence, fit: Fit, trial: int) -> float:
    return float((fit.residual[evidence.rows(trial)] ** 2).sum())


def _chance(signatures: Signatures, best: Fit, rng: np.random.Generator) -> Chance:
    """What chance makes of what remains beside the best candidate, and all that is likely."""
    known = np.column_stack([best.tangent, likely_columns(signatures, best)])
    left = best.residual - known @ np.linalg.lstsq(known, best.residual, rcond=None)[0]
    scores, _ = signatures.scores(flipped(signatures.evidence, left, rng), known)
    new = new_places(signatures, best)
    return chance_of(scores[new], [signatures.places[k] for k in new])


def _in_vain(judged: list[Tried]) -> set[int]:
    """Trials, each alone, of what chance hardly ever brings and yet is no cause."""
    rare = [one.trials for one in judged if one.p_value <= ALPHA]
    return {t for trials in rare if len(trials) == 1 for t in trials}


def _kept(judged: list[Tried], before: Fit) -> Tried | None:
    """The cause that explains most. What explains less than a slight thing without a name, or than
    what is no cause by far, would be the wrong name, unless most of that is its own."""
    good = [one for one in judged if one.is_good]
    while good:
        first = foremost(good, before)
        if first.is_slight:
            others = (one for one in good if one is not first)
            good = [one for one in others if stands_beside(one, first, before)]
        elif _is_overshadowed(first, judged, before):
            good = [one for one in good if one is not first]
        else:
            return first
    return None


def _is_overshadowed(one: Tried, judged: list[Tried], before: Fit) -> bool:
    """Whether it goes along with what explains far more of one of its trials, hardly ever brought
    by chance, and yet no cause."""
    return any(
        other.p_value <= ALPHA
        and not other.is_good
        and other.score > OVERSHADOWS * one.score
        and not set(one.trials).isdisjoint(other.trials)
        and not stands_beside(one, other, before)
        for other in judged
    )


def _best_of_each(
    signatures: Signatures,
    scores: np.ndarray,
    sizes: list[np.ndarray],
    open_trials: set[int],
    before: Fit,
) -> Iterator[int]:
    """The best possible place of every effect and target, the best first; none that is known.

    An effect that does not last is another one in every trial.
    """
    seen = set()
    new = np.array(new_places(signatures, before))
    for k in new[np.argsort(-scores[new])]:
        place = signatures.places[k]
        if not open_trials.issuperset(place.trials):
            continue
        effect, target = place.candidate.effect, place.candidate.target
        key = (effect, target, () if effect.lasts else place.trials)
        if key in seen:
            continue
        start = start_at(signatures.evidence, place, sizes[k])
        if not start.is_possible(signatures.evidence):
            continue
        seen.add(key)
        yield int(k)
