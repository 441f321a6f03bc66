"""Loads, forces, turned cameras and a sliding marker, hidden by the simulator and found by the
command line, which sees no truth."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from tests.program import Program

pytestmark = pytest.mark.long
STAGES = ("ingest", "scale", "ik", "regress", "identify", "reconstruct", "diagnose")
TASKS = ("static", "sequence", "squat")
HIDDEN = [  # the number that is named, what it is within, and the person's seed
    ("implement", 0.3, "hand_r,distance=0.7", "mass", (0.24, 0.375), 701),
    ("camera_frame", 0.0175, "-", "angle", (0.014, 0.0219), 701),
    ("external_force", 40.0, "lower_torso", "force", (32.0, 50.0), 701),
    ("object_handled", 1.0, "hand_l", "mass", (0.8, 1.25), 701),
    ("marker_slide", 0.03, "LKNEL", "way", (0.024, 0.0375), 641),
    ("frame_rate", -0.08, "-", "rate_ratio", (0.90, 0.94), 701),
    ("frame_rate", 0.25, "-", "rate_ratio", (1.22, 1.28), 641),
]


def said(folder: Path, seed: int, *hidden: str) -> pd.DataFrame:
    """What is named or in a group, of one person."""
    tasks = [word for task in TASKS for word in ("--task", task)]
    options = ("--preset", "diagnosis", "--seed", str(seed), "--sequence-s", "20", *tasks)
    bsip = Program().done
    bsip("simulate", folder / "study", *options, *hidden)
    for stage in STAGES:
        bsip(stage, folder / "study", "--out", folder / "out")
    table = pd.read_parquet(folder / "out" / "sub-01" / "sub-01_diagnosis.parquet")
    return table[table["verdict"] != "rejected"]


@pytest.mark.parametrize(("effect", "size", "target", "parameter", "within", "seed"), HIDDEN)
def test_what_is_hidden_is_named_with_its_size(
    tmp_path, effect, size, target, parameter, within, seed
):
    hidden = ("--effect", effect, "--size", str(size), "--target", target)
    found = said(tmp_path, seed, *hidden)
    assert set(found["effect"]) == {effect} and set(found["verdict"]) == {"named"}
    assert set(found["target"]) == {"" if target == "-" else target.split(",")[0]}
    sizes = found.loc[found["parameter"] == parameter, "estimate"]
    assert len(sizes) and sizes.between(*within).all()


def test_nothing_hidden_is_nothing_named(tmp_path):
    assert set(said(tmp_path, 503)["effect"]) == {"none"}
