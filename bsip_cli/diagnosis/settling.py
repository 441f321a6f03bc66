"""What of the causes found is left in the end, when all of them are fitted together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bsip_cli.diagnosis.background import background_of
from bsip_cli.diagnosis.chance import group_of
from bsip_cli.diagnosis.explanation import Explanation, fit_together
from bsip_cli.diagnosis.fair_sizes import fairly_sized
from bsip_cli.diagnosis.intervals import has_size
from bsip_cli.diagnosis.joining import Kept, joined
from bsip_cli.diagnosis.judging import (
    DROWNED,
    IMPOSSIBLE,
    NEGLIGIBLE,
    SIZELESS,
    GivenUp,
    Tried,
)
from bsip_cli.diagnosis.likely_noise import noise_beside_fit
from bsip_cli.diagnosis.rounds import Round, Selection
from bsip_cli.diagnosis.signatures import Signatures


def told_once(
    signatures: Signatures, rounds: Sequence[Round], found: tuple[Explanation, ...]
) -> tuple[tuple[Round, ...], tuple[Explanation, ...]]:
    """What lasts, and was found by several rounds in trials of their own, in the first of them."""
    judged = (cause for _, cause in _kept(rounds))
    left = joined(signatures, list(zip(judged, found, strict=True)))
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
        fit = fairly_sized(signatures.evidence, fit)
    selection = Selection(signatures, rounds, fit, background_of(signatures, fit))
    lost = _weakest_drowned(selection) or _weakest_without_size(selection, rng)
    return settled(signatures, *_without(selection, *lost), rng) if lost else selection


def _kept(rounds: Sequence[Round]) -> list[tuple[Round, Tried]]:
    """Rounds that kept a cause, each with it, in the order of the fit."""
    return [(one, one.kept) for one in rounds if one.kept is not None]


def _weakest_drowned(selection: Selection) -> tuple[int, GivenUp] | None:
    """Place in the fit of the cause that explains least beside what remains, if that is more."""
    left = {
        place: selection.background.get(group_of(cause.trials), 0.0) / cause.score
        for place, (one, cause) in enumerate(_kept(selection.rounds))
        if one.chance is not None
    }
    weakest = max(left, key=left.__getitem__, default=None)
    return None if weakest is None or left[weakest] < 1 else (weakest, DROWNED)


def _weakest_without_size(
    selection: Selection, rng: np.random.Generator
) -> tuple[int, GivenUp] | None:
    """Place in the fit of the cause with the least score that has no size, or none that can be."""
    scores = [cause.score for _, cause in _kept(selection.rounds)]
    asked = ((place, _why_without_size(selection, place, rng)) for place in range(len(scores)))
    lost = [(place, why) for place, why in asked if why is not None]
    return min(lost, key=lambda one: scores[one[0]], default=None)


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
    selection: Selection, place: int, why: GivenUp
) -> tuple[tuple[Round, ...], tuple[Explanation, ...]]:
    """Rounds and causes without the one at a place of the fit: in its round it was only tried."""
    rounds, explanations = selection.rounds, selection.fit.explanations
    number = [n for n, one in enumerate(rounds) if one.kept is not None][place]
    one = rounds[number]
    tried = (
        replace(t, explanation=explanations[place], given_up=why) if t is one.kept else t
        for t in one.tried
    )
    only_tried = replace(one, tried=tuple(tried), kept=None)
    return (
        (*rounds[:number], only_tried, *rounds[number + 1 :]),
        (*explanations[:place], *explanations[place + 1 :]),
    )
