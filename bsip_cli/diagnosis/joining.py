"""One cause told once: what lasts may be found in some trials first and in others later."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

from bsip_cli.diagnosis.explanation import Explanation, fit_together
from bsip_cli.diagnosis.held_out import Gain
from bsip_cli.diagnosis.judging import Tried
from bsip_cli.diagnosis.refitting import agreeing, alike
from bsip_cli.diagnosis.rivals import in_few_trials
from bsip_cli.diagnosis.signatures import Signatures
from bsip_cli.diagnosis.together import Evidence

Kept = tuple[Tried, Explanation]
"""A cause as it was judged, and as it was fitted last."""


def joined(signatures: Signatures, kept: Sequence[Kept]) -> list[Kept | None]:
    """None for the later one of two that are the same and agree on their size; the former is then
    in the trials of both."""
    left: list[Kept | None] = list(kept)
    for first, later in combinations(range(len(kept)), 2):
        one, other = left[first], left[later]
        if one is None or other is None or not _may_be_one(one[1], other[1]):
            continue
        both = _in_all(one[1], other[1])
        rest = [k[1] for n, k in enumerate(left) if k is not None and n not in (first, later)]
        if _agree(signatures.evidence, rest, both):
            rivals = _rivals(one[0], other[0], in_few_trials(signatures, both))
            left[first], left[later] = (_of_both(one[0], other[0], both, rivals), both), None
    return left


def _may_be_one(one: Explanation, other: Explanation) -> bool:
    return one.effect.lasts and alike(one, other)


def _in_all(one: Explanation, other: Explanation) -> Explanation:
    trials = tuple(sorted({*one.place.trials, *other.place.trials}))
    return replace(one, place=replace(one.place, trials=trials))


def _agree(evidence: Evidence, rest: Sequence[Explanation], both: Explanation) -> bool:
    """Whether no trial wants a size of its own, beside all other causes."""
    before = fit_together(evidence, tuple(rest))
    fit = fit_together(evidence, (*rest, both))
    saved = before.residual**2 - fit.residual**2
    return agreeing(evidence, fit, saved) == both.place.trials


def _rivals(one: Tried, other: Tried, apart: bool) -> tuple[Tried, ...]:
    """Those of both: what either tells from it is told. apart : or those of each, if both have
    some."""
    if apart and one.rivals and other.rivals:
        return (*one.rivals, *other.rivals)
    return tuple(r for r in one.rivals if any(_same(r, s) for s in other.rivals))


def _of_both(one: Tried, other: Tried, both: Explanation, rivals: tuple[Tried, ...]) -> Tried:
    gain = Gain(
        one.gain.blocks + other.gain.blocks,
        one.gain.concerned | other.gain.concerned,
        one.gain.before + other.gain.before,
    )
    return replace(
        one,
        explanation=both,
        score=one.score + other.score,
        p_value=min(one.p_value, other.p_value),
        gain=gain,
        rivals=rivals,
    )


def _same(one: Tried, other: Tried) -> bool:
    return alike(one.explanation, other.explanation)
