"""Which of several good causes comes first."""

from __future__ import annotations

from bsip_cli.diagnosis.explanation import Explanation, Fit
from bsip_cli.diagnosis.judging import Tried
from bsip_cli.diagnosis.pattern import UNEXPLAINED
from bsip_cli.diagnosis.refitting import alike

# A cause from the catalogue is named though a regularity without a name explains a bit more.
NAMED_AT = 0.95
AGAIN = 1.25  # how much more an effect counts that another trial shows already


def foremost(good: list[Tried], before: Fit) -> Tried:
    """What explains most, if possible with a name; what recurs in several trials counts
    together."""

    def weight(one: Tried) -> float:
        return _with_recurrence(one, good, before)

    named = [one for one in good if one.explanation.effect.name != UNEXPLAINED]
    best = max(good, key=weight)
    if not named:
        return best
    first = max(named, key=weight)
    return first if weight(first) >= NAMED_AT * weight(best) else best


def _with_recurrence(one: Tried, good: list[Tried], before: Fit) -> float:
    """Its score; with it the best of the same effect in every other trial where it differs.

    What was found in another trial already is the likeliest cause here.
    """
    weight = one.score
    if not one.explanation.effect.lasts and len(one.trials) == 1:
        weight += _recurring(one, good)
    return AGAIN * weight if _is_shown_elsewhere(one.explanation, before) else weight


def _recurring(one: Tried, good: list[Tried]) -> float:
    best: dict[int, float] = {}
    for other in good:
        if other.explanation.effect is one.explanation.effect:
            for trial in set(other.trials) - set(one.trials):
                best[trial] = max(best.get(trial, 0.0), other.score)
    return sum(best.values())


def _is_shown_elsewhere(one: Explanation, before: Fit) -> bool:
    """What lasts is the same cause at the same place only."""
    known = (
        e
        for e in before.explanations
        if (alike(e, one) if one.effect.lasts else e.effect is one.effect)
    )
    return any(set(e.place.trials).isdisjoint(one.place.trials) for e in known)
