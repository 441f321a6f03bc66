"""What of the causes found is left in the end, when all of them are fitted together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bsip_cli.diagnosis.background import background_of
from bsip_cli.diagnosis.chance import group_of
from bsip_cli.diagnosis.explanation import Explanation, fit_together
from bsip_cli.diagnosis.intervals import has_size
from bsip_cli.diagnosis.joining import Kept, joined
from bsip_cli.diagnosis.judging import DROWNED, IMPOSSIBLE, NEGLIGIBLE, SIZELESS, GivenUp
from bsip_cli.diagnosis.likely_noise import noise_beside_fit
from bsip_cli.diagnosis.rounds import Round, Selection
from bsip_cli.diagnosis.signatures import Signatures
from bsip_cli.diagnosis.together import Evidence


def told_once(
    evidence: Evidence, rounds: Sequence[Round], found: tuple[Explanation, ...]
) -> tuple[tuple[Round, ...], tuple[Explanation, ...]]:
    """What lasts, and was found by several rounds in trials of their own, in the first of them."""
    judged = (one.kept for one in rounds if one.kept is not None)
    left = joined(evidence, list(zip(judged, found, strict=True)))
    causes = iter(left)
    told = tuple(one if one.kept is None else _with(one, next(causes)) for one in rounds)
    return told, tuple(one[1] for one in left if one is not None)


def _with(one: Round, cause: Kept | None) -> Round:
    """A round that kept something else, or nothing any more."""
    now = None if cause is None else cause[0]
    tried = (t if t is not one.kept else now for t in one.tried)
    return replace(one, tried=tuple(t for t in tried if t is not None), kept=now)


def settled(
    signatures: Signatures,
    rounds: tuple[Round, ...],
    found: tuple[Explanation, ...],
    rng: np.random.Generator,
) -> Selection:
    """All causes fitted together, without those that are none beside the others: the weakest of
    them goes first, and what is left is fitted anew."""
    fit = fit_together(signatures.evidence, found)
    if found:
        signatures, fit = noise_beside_fit(signatures, fit)
    selection = Selection(signatures, rounds, fit, background_of(signatures, fit))
    lost = _weakest_drowned(selection) or _weakest_without_size(selection, rng)
    return settled(signatures, *_without(selection, *lost), rng) if lost else selection


def _weakest_drowned(selection: Selection) -> tuple[int, GivenUp] | None:
    """The round whose cause explains least beside what remains, if that is more."""
    left = {
        number: selection.background.get(group_of(one.kept.trials), 0.0) / one.kept.score
        for number, one in enumerate(selection.rounds)
        if one.kept is not None and one.chance is not None
    }
    weakest = max(left, key=left.__getitem__, default=None)
    return None if weakest is None or left[weakest] < 1 else (weakest, DROWNED)


def _weakest_without_size(
    selection: Selection, rng: np.random.Generator
) -> tuple[int, GivenUp] | None:
    """The round whose cause has no size, or none that can be, and the least score."""
    lost = []
    kept = ((n, one.kept) for n, one in enumerate(selection.rounds) if one.kept is not None)
    for place, (number, cause) in enumerate(kept):
        why = _why_without_size(selection, place, rng)
        if why is not None:
            lost.append((cause.score, number, why))
    if not lost:
        return None
    _, number, why = min(lost, key=lambda one: one[0])
    return number, why


def _why_without_size(selection: Selection, place: int, rng: np.random.Generator) -> GivenUp | None:
    """Why the cause at a place of the fit has no size; None if it has one."""
    evidence, fit = selection.signatures.evidence, selection.fit
    one = fit.explanations[place]
    if one.is_negligible(evidence):
        return NEGLIGIBLE
    if not one.is_possible(evidence):
        return IMPOSSIBLE
    return None if has_size(evidence, fit, place, rng) else SIZELESS


def _without(
    selection: Selection, given_up: int, why: GivenUp
) -> tuple[tuple[Round, ...], tuple[Explanation, ...]]:
    """Rounds and causes without what one of them kept: there it was only tried."""
    rounds, left = [], []
    causes = iter(selection.fit.explanations)
    for number, one in enumerate(selection.rounds):
        cause = None if one.kept is None else next(causes)
        if number != given_up:
            rounds.append(one)
            left += [] if cause is None else [cause]
            continue
        tried = (
            replace(t, explanation=cause or t.explanation, given_up=why) if t is one.kept else t
            for t in one.tried
        )
        rounds.append(replace(one, tried=tuple(tried), kept=None))
    return tuple(rounds), tuple(left)
