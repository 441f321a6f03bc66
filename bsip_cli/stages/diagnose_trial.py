"""diagnose (trial): of what is wrong in a person's trials, what concerns this one."""

from __future__ import annotations

import numpy as np
import pandas as pd

from bsip_cli.artifacts import empty_table
from bsip_cli.stages.diagnosis_rows import nothing
from bsip_cli.unit import Unit


def run(unit: Unit) -> None:
    """Read the person's diagnosis; write the trial's own."""
    overall = unit.read("overall-diagnosis")
    assert unit.trial is not None
    stem = unit.trial.stem
    looked_at = unit.facts("overall-diagnosis").get("trials", [])
    if stem not in looked_at:
        unit.write("diagnosis", empty_table("diagnosis"))
        return
    concerned = [stem in trials.split(", ") for trials in overall["trials"]]
    rows = overall[np.array(concerned, dtype=bool) & (overall["effect"] != "none")]
    if (rows["verdict"] == "rejected").all():
        p_value = float(rows["p_value"].min()) if len(rows) else np.nan
        rows = pd.concat([pd.DataFrame([nothing(p_value, (stem,))]), rows], ignore_index=True)
        order = [1, *(rows["rank"][1:] + 1)]
        rows["rank"] = order
    rows["rank"] = rows["rank"].rank(method="dense").astype(int)
    unit.write("diagnosis", rows)
