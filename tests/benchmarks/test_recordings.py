"""The table of faults in real recordings: groups stand together, and silence is said."""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from benchmarks.recordings import fault_rows

COLUMNS = (
    "rank effect target parameter estimate ci_low ci_high p_value gain_percent verdict class_id"
)
FOUND = [
    (1, "plate_gain", "1 fz", "gain", 0.04, 0.03, 0.05, 1e-6, 12.0, "ambiguous", "A"),
    (2, "plate_zero", "1 mx", "offset", 5.0, 4.0, 6.0, 0.02, float("nan"), "named", ""),
    (3, "plate_zero", "1 fz", "offset", 20.0, 15.0, 25.0, 1e-6, 11.0, "ambiguous", "A"),
    (4, "sync_offset", "", "delay", 0.01, 0.01, 0.01, 0.9, 0.0, "rejected", ""),
]


def rows(folder: Path, found: list[tuple], said: list[str]) -> list[list[str]]:
    table = pd.DataFrame(found, columns=COLUMNS.split())
    table["trials"] = "sub-01_task-squats, sub-01_task-walking_run-2"
    table.to_parquet(folder / "sub-01_diagnosis.parquet")
    return [[*row.values()][1:] for row in fault_rows("here", folder, said)]


def test_causes_of_a_group_stand_together(tmp_path):
    gains = {"component": ["fx", "fz", "fz"], "gain_percent": [1.0, 2.0, 30.0]}
    pd.DataFrame(gains).to_parquet(tmp_path / "sub-01_gain.parquet")
    trials, of_all = "squats, walking_run-2", "fx +1, fz +30"
    assert rows(tmp_path, FOUND, []) == [
        ["`plate_gain` 1 fz", "gain 0.04 (0.03 to 0.05)", trials, "> 0.999", "12.0", of_all],
        ["or `plate_zero` 1 fz", "offset 20 (15 to 25)", trials, "> 0.999", "11.0", ""],
        ["`plate_zero` 1 mx", "offset 5 (4 to 6)", trials, "0.980", "", of_all],
    ]


def test_where_nothing_is_told_it_is_said_why(tmp_path):
    (row,) = fault_rows("here", tmp_path, ["diagnose: no forces"])
    assert row["cause"] == "not diagnosed: diagnose: no forces"
    nothing = [(1, "none", "", "", *[float("nan")] * 5, "named", "")]
    assert rows(tmp_path, nothing, [])[0][0] == "nothing wrong above the noise"
    said = ["diagnose: no movement can be diagnosed"]
    assert rows(tmp_path, nothing, said)[0][0].startswith("not diagnosed: no trial has motion")
