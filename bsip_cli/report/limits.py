"""How small a cause might have been and still been seen in these recordings, in words."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

import pandas as pd

from bsip_cli.report.candidates import candidates_of, causes_of
from bsip_cli.report.effect_words import size_words

_EXAMPLES = (  # effects whose limits are told in the sentence
    ("sync_offset", "", "a delay between forces and markers"),
    ("plate_translation", "", "a plate shifted"),
    ("plate_gain", "fz", "a vertical gain wrong"),
    ("added_mass", "hand_l", "a mass on the left hand"),
    ("added_mass", "upper_torso", "a mass on the upper torso"),
)
OF_THE_WEIGHT = "W"  # group of what quiet standing tells
_BY = ("plate_translation", "plate_gain")  # shifted *by* less than, but a delay *under*


@dataclass(frozen=True)
class Limit:
    """Smallest size of a cause that these recordings would have shown; infinite where they show it
    at no size."""

    effect: str
    target: str
    parameter: str
    unit: str
    size: float
    trials: int

    def in_words(self) -> str:
        return size_words(self.parameter, self.unit, self.size)


def limits_of(
    detection: pd.DataFrame, diagnosis: pd.DataFrame, alone: bool = False
) -> tuple[Limit, ...]:
    """Of each cause and place the limit with most recordings together, of what only single ones can
    show that in each; with ``alone`` all of single recordings. Found causes have none."""
    causes = causes_of(candidates_of(diagnosis))
    found = {(one.effect, one.target) for cause in causes for one in cause}
    rows = detection.assign(together=detection["trials"].str.count(",") + 1)
    most = rows.groupby(["effect", "target", "parameter"])["together"].transform("max")
    rows = rows[rows["together"] == (1 if alone else most)]
    return tuple(
        Limit(
            r["effect"],
            r["target"],
            r["parameter"],
            r["unit"],
            float(r["limit"]),
            int(r["together"]),
        )
        for r in rows.to_dict("records")
        if (r["effect"], r["target"]) not in found
    )


def limits_sentence(limits: Sequence[Limit]) -> str:
    """``A delay ... under 2.5 ms or ... might have gone unseen.``: of plates, axes and recordings
    the worst one; empty without examples."""
    parts = []
    for effect, ends, words in _EXAMPLES:
        of_it = [
            x
            for x in limits
            if x.effect == effect
            and x.target.endswith(ends)
            and x.parameter in ("delay", "x", "y", "gain", "mass")
        ]
        if of_it:
            worst = max(of_it, key=lambda x: x.size)
            parts.append(f"{words} {_under(worst)}")
    if not parts:
        return ""
    text = " or ".join(filter(None, [", ".join(parts[:-1]), parts[-1]]))
    return f"{text[0].upper()}{text[1:]} might have gone unseen in these recordings."


def _under(limit: Limit) -> str:
    by = limit.effect in _BY
    if not isfinite(limit.size):
        return "by any amount" if by else "of any size"
    return f"{'by less than' if by else 'under'} {limit.in_words()}"


def looked_at(detection: pd.DataFrame, diagnosis: pd.DataFrame) -> tuple[str, ...]:
    """Stems of the recordings that were diagnosed, those of which something was told before the
    search too."""
    told = diagnosis.loc[diagnosis["class_id"] != OF_THE_WEIGHT, "trials"]
    return tuple(sorted({s for t in (*detection["trials"], *told) for s in str(t).split(", ")}))
