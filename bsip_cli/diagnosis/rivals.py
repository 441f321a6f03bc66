"""Causes that the recordings cannot tell apart."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bsip_cli.diagnosis.held_out import standard_error
from bsip_cli.diagnosis.judging import Tried
from bsip_cli.diagnosis.pattern import UNEXPLAINED
from bsip_cli.diagnosis.together import Evidence

ALIKE = 0.9  # part of a signature that another explains


def rivals_of(evidence: Evidence, kept: Tried, tried: Sequence[Tried]) -> tuple[Tried, ...]:
    """What explains the same as the kept cause, or pays off as well on data it has not seen.

    Only causes that have a name: another regularity would not say more.
    """
    mine = set(kept.trials)
    others = (
        t
        for t in tried
        if t is not kept
        and t.is_good
        and t.explanation.effect.name != UNEXPLAINED
        and mine & set(t.trials)
    )
    return tuple(t for t in others if _is_rival(evidence, kept, t))


def _is_rival(evidence: Evidence, kept: Tried, other: Tried) -> bool:
    """What is another one in every trial is compared where it is, though a lasting cause may gain
    in more of them."""
    if _explained(evidence, kept, other) > ALIKE:
        return True
    lasts = kept.explanation.effect.lasts
    where = kept.gain.concerned | (other.gain.concerned & lasts)
    apart = (kept.gain.blocks - other.gain.blocks)[where]
    return float(apart.sum()) < standard_error(apart)


def _explained(evidence: Evidence, kept: Tried, other: Tried) -> float:
    """Part of the kept cause's signature that the other's takes up."""
    mine = kept.explanation.change(evidence)
    theirs = other.explanation.tangent(evidence)
    size = np.linalg.lstsq(theirs, mine, rcond=None)[0]
    return float(1 - ((mine - theirs @ size) ** 2).sum() / max(float((mine**2).sum()), 1e-12))
