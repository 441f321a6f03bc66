"""The causes that the diagnosis of a person named, as science takes them."""

from __future__ import annotations

import numpy as np

from bsip_cli.diagnosis.cause import Blocks, Cause
from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.running.unit import Unit

_NAMED = ("named", "ambiguous")


def causes_of(unit: Unit) -> tuple[Cause, ...]:
    """In the order of rank; what is unexplained is no cause that a model could be extended by."""
    found = unit.facts("overall-diagnosis").get("causes", [])
    return tuple(
        Cause(
            EFFECTS[one["effect"]],
            one["target"],
            tuple(one["trials"]),
            np.array(one["values"]),
            np.array(one["folds"]),
        )
        for one in found
        if one["effect"] in EFFECTS and one["verdict"] in _NAMED
    )


def body_beside(unit: Unit, phi: np.ndarray) -> np.ndarray:
    """(10 n,) the body beside which the causes were sized: RM's (10 n,), made as heavy as the
    plates read where the diagnosis believes them instead of the stated mass."""
    return phi * (1 + unit.facts("overall-diagnosis")["heavier_by"])


def blocks_of(unit: Unit, stem: str) -> Blocks:
    """How the diagnosis cut a trial that it looked at."""
    facts = unit.facts("overall-diagnosis")
    return Blocks(**facts["blocks"][stem], block_s=facts["block_s"], folds=facts["folds"])
