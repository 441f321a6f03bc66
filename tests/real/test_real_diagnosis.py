"""Diagnosis of real recordings; skipped where the recordings are not at hand."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest
from test_real_studies import DATA, make_study

pytestmark = [
    pytest.mark.real,
    pytest.mark.slow,
    pytest.mark.skipif(
        not DATA.is_dir(), reason="the real recordings (../shared/data) are missing"
    ),
]
STAGES = ("ingest", "scale", "ik", "regress", "identify", "reconstruct", "diagnose")


def bsip(*arguments: str | Path) -> subprocess.CompletedProcess:
    command = [sys.executable, "-m", "bsip_cli", *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done


def diagnosis_of(study: Path, out: Path) -> pd.DataFrame:
    """What is named or in a class."""
    for stage in STAGES:
        bsip(stage, study, "--out", out)
    table = pd.read_parquet(out / "sub-01" / "sub-01_diagnosis.parquet")
    return table[table["verdict"] != "rejected"]


def test_an_offset_hidden_in_a_real_recording_is_found_with_its_size(tmp_path):
    """15 N sideways in squats on two plates; in the file, whose y is up, sideways is z."""
    files = {
        f"sub-01_task-{task}.{ending}": f"opencap_subject4/{name}{suffix}.{ending}"
        for task, name in (("static", "static1"), ("squats", "squats1"))
        for ending, suffix in (("trc", ""), ("mot", "_grf"))
    }
    options = '[roles]\nsequence = ["squats"]\n'
    study = make_study(tmp_path / "study", ["sub-01\tM\t62.6\t1.68"], options, files)
    hidden = ("--effect", "plate_zero", "--size", "15", "--target", "fz,plate=1")
    bsip("inject", study, tmp_path / "copy", *hidden, "--effect-tasks", "squats")
    found = diagnosis_of(tmp_path / "copy", tmp_path / "out").set_index(["effect", "target"])
    offset = found.loc[("plate_zero", "1 fy"), "estimate"].item()  # as likely on plate 2: a class
    assert abs(offset + 15) < 2.5
    # The plates read 4 % less than the stated mass in quiet standing.
    gain = found.loc[("plate_gain", "all fz"), "estimate"].item()
    assert abs(gain + 0.0406) < 0.003


def test_hands_on_a_rail_are_the_missing_kilograms(tmp_path):
    files = {
        "sub-01_task-static.c3d": "biobuddy_ech/anat_pose_ECH.c3d",
        "sub-01_task-righthip.c3d": "biobuddy_ech/right_hip.c3d",
        "sub-01_task-rightknee.c3d": "biobuddy_ech/right_knee.c3d",
    }
    study = make_study(tmp_path / "study", ["sub-01\tM\tn/a\tn/a"], "", files)
    found = diagnosis_of(study, tmp_path / "out")
    assert set(zip(found["effect"], found["target"], strict=True)) == {
        ("unmeasured_contact", "hand_l+hand_r")
    }
    borne = found[found["parameter"] == "force_z"].set_index("trials")["estimate"]
    assert abs(borne["sub-01_task-righthip"] - 52) < 3
    assert abs(borne["sub-01_task-rightknee"] - 46) < 3
