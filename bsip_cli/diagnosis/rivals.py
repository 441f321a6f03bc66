"""Causes that the recordings cannot tell apart."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bsip_cli.diagnosis.explanation import Explanation
from bsip_cli.diagnosis.held_out import standard_error
from bsip_cli.diagnosis.judging import Tried
from bsip_cli.diagnosis.pattern import UNEXPLAINED
from bsip_cli.diagnosis.refitting import alike
from bsip_cli.diagnosis.signatures import Signatures
from bsip_cli.diagnosis.together import Evidence

ALIKE = 0.9  # part of a signature that another explains
FEW = 0.5  # of the trials in which a fault of the lab could be


def rivals_of(
    evidence: Evidence, kept: Tried, tried: Sequence[Tried], apart: bool = False
) -> tuple[Tried, ...]:
    """What explains the same as the kept cause, or pays off as well on data it has not seen.

    apart : so does what is like it in one of its trials each, if every one of them has such.
    """
    others = _others(kept, tried)
    rivals = [t for t in others if _is_rival(evidence, kept, t)]
    known = [t.explanation for t in rivals]
    more = _rivals_apart(evidence, kept, others) if apart else ()
    rivals += (t for t in more if not any(alike(t.explanation, one) for one in known))
    return tuple(rivals)


def _rivals_apart(evidence: Evidence, kept: Tried, others: Sequence[Tried]) -> tuple[Tried, ...]:
    alone = (o for o in others if len(o.trials) == 1)
    found = tuple(o for o in alone if _is_like_in(evidence, kept, o, *o.trials))
    return found if {t for o in found for t in o.trials} == set(kept.trials) else ()


def in_few_trials(signatures: Signatures, one: Explanation) -> bool:
    """Whether a fault of the lab is said of several trials, but of half of those at most in which
    it could be: then a cause of its own in each of them is as likely."""
    trials = one.place.trials
    possible = signatures.trials_of(one.place.candidate)
    return one.effect.of_the_lab and 1 < len(trials) <= FEW * len(possible)


def _others(kept: Tried, tried: Sequence[Tried]) -> list[Tried]:
    """Good causes of the same trials that have a name: a regularity would not say more."""
    return [
        t
        for t in tried
        if t is not kept
        and t.is_good
        and t.explanation.effect.name != UNEXPLAINED
        and not set(kept.trials).isdisjoint(t.trials)
    ]


def _is_rival(evidence: Evidence, kept: Tried, other: Tried) -> bool:
    """What is another one in every trial is compared where it is, though a lasting cause may gain
    in more of them."""
    lasts = kept.explanation.effect.lasts
    where = kept.gain.concerned | (other.gain.concerned & lasts)
    return _is_like(evidence, kept, other, slice(None), where)


def _is_like_in(evidence: Evidence, kept: Tried, other: Tried, trial: int) -> bool:
    return _is_like(evidence, kept, other, evidence.rows(trial), other.gain.concerned)


def _is_like(evidence: Evidence, kept: Tried, other: Tried, rows: slice, where: np.ndarray) -> bool:
    """Whether the other takes up the kept cause in some rows, or gains as much in some blocks."""
    if _explained(evidence, kept, other, rows) > ALIKE:
        return True
    apart = (kept.gain.blocks - other.gain.blocks)[where]
    return float(apart.sum()) < standard_error(apart)


def _explained(evidence: Evidence, kept: Tried, other: Tried, rows: slice) -> float:
    """Part of the kept cause's signature that the other's takes up."""
    mine = kept.explanation.change(evidence)[rows]
    theirs = other.explanation.tangent(evidence)[rows]
    size = np.linalg.lstsq(theirs, mine, rcond=None)[0]
    return float(1 - ((mine - theirs @ size) ** 2).sum() / max(float((mine**2).sum()), 1e-12))
