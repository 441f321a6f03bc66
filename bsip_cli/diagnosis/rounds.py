"""What the search for causes has found: round by round, and in the end."""

from __future__ import annotations

from dataclasses import dataclass

from bsip_cli.diagnosis.background import Background
from bsip_cli.diagnosis.chance import Chance
from bsip_cli.diagnosis.explanation import Fit
from bsip_cli.diagnosis.judging import Tried
from bsip_cli.diagnosis.signatures import Signatures
from bsip_cli.diagnosis.together import Evidence


@dataclass(frozen=True)
class Round:
    """One step: candidates in the order of what they explain, and the one that was kept."""

    evidence: Evidence
    tried: tuple[Tried, ...]
    kept: Tried | None
    chance: Chance | None  # None where the evidence is not the wrench's


@dataclass(frozen=True)
class Selection:
    """All rounds, and everything kept fitted together, in the coordinates of the last noise.

    background : what remains beside it.
    """

    signatures: Signatures
    rounds: tuple[Round, ...]
    fit: Fit
    background: Background
