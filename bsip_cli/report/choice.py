"""Which parameters to use, in words."""

from __future__ import annotations

import numpy as np
import pandas as pd

from bsip_cli.report.words import count, listing, signed
from bsip_cli.statistics.choice import Difference, Differences
from bsip_cli.statistics.methods import OM, RM, RM_MASS

ALL = "all"  # movements
_DATA = {
    "whole_trials": "judged on {trials} that OM never saw",
    "held_out": "judged only on held-out seconds of the trials that identified OM, which share "
    "their constant errors: no other trial is there",
    "none": "no data are left to judge by, so the table's parameters stand",
}


def reason_of(differences: Differences, is_rare: bool, trials: int, data: str) -> str:
    """Why OM, RM+mass or RM."""
    said = [_DATA[data].format(trials=count(trials, "trial"))]
    if data != "none":
        om, over_rm_mass = differences[OM, RM], differences[OM, RM_MASS]
        said += [
            f"OM's error is {_change(om)} against {RM}, {_change(over_rm_mass)} against {RM_MASS}",
            f"{RM_MASS}'s {_change(differences[RM_MASS, RM])} against {RM}",
        ]
    if is_rare:
        said.append("OM is not used: a body like this is rarer than 1 in 100 people")
    return "; ".join(said)


def headline(choice: pd.DataFrame) -> str:
    """``Use RM+mass (in walking: RM)``."""
    first, each = choice.iloc[0], choice.iloc[1:]
    other = each[each["use"] != first["use"]]
    exceptions = [
        f"in {listing(sorted(other.loc[other['use'] == use, 'movement']))}: {use}"
        for use in sorted(other["use"].unique())
    ]
    return f"use {first['use']}" + (f" ({'; '.join(exceptions)})" if exceptions else "")


def _change(one: Difference) -> str:
    """``−36 % (−41 to −30)``: one standard error to either side."""
    change, *ends = (100 * (x - 1) for x in (one.ratio, *one.interval()))
    if not np.isfinite(ends).all():
        return f"{signed(change)} % (no interval: too few independent samples)"
    return f"{signed(change)} % ({signed(ends[0])} to {signed(ends[1])})"
