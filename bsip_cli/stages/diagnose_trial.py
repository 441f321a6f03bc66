"""diagnose (trial): of what is wrong in a person's trials, what concerns this one."""

from __future__ import annotations

import numpy as np
import pandas as pd

from bsip_cli.artifacts import empty_table
from bsip_cli.running.unit import Unit
from bsip_cli.stages.diagnosis_rows import nothing, rows_of


def run(unit: Unit) -> None:
    """Read the person's diagnosis and error budget; write this trial's part of them."""
    assert unit.trial is not None
    _write_diagnosis(unit)
    budget = unit.read("overall-error-budget")
    unit.write("error-budget", budget[budget["trial"] == unit.trial.stem])


def _write_diagnosis(unit: Unit) -> None:
    overall = unit.read("overall-diagnosis")
    assert unit.trial is not None
    stem = unit.trial.stem
    looked_at = unit.facts("overall-diagnosis").get("trials", [])
    if stem not in looked_at:
        unit.write("diagnosis", empty_table("diagnosis"))
        return
    concerned = np.array([stem in trials.split(", ") for trials in overall["trials"]], dtype=bool)
    classes = set(overall["class_id"][concerned]) - {""}  # rivals of other trials belong to them
    concerned |= overall["class_id"].isin(classes).to_numpy()
    rows = overall[concerned & (overall["effect"] != "none").to_numpy()]
    if (rows["verdict"] == "rejected").all():
        p_value = float(rows["p_value"].min()) if len(rows) else np.nan
        none = rows_of((nothing(p_value, (stem,)),), (stem,))
        rows = pd.concat([none, rows], ignore_index=True)
        order = [1, *(rows["rank"][1:] + 1)]
        rows["rank"] = order
    rows["rank"] = rows["rank"].rank(method="dense").astype(int)
    unit.write("diagnosis", rows)
