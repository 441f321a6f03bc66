"""Diagnosis of real recordings; skipped where the recordings are not at hand."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from tests.program import Program
from tests.real.test_real_studies import DATA, make_study

pytestmark = [
    pytest.mark.real,
    pytest.mark.long,
    pytest.mark.skipif(
        not DATA.is_dir(), reason="the real recordings (../shared/data) are missing"
    ),
]
STAGES = ("ingest", "scale", "ik", "regress", "identify", "reconstruct", "diagnose")


bsip = Program().done


def diagnosis_of(study: Path, out: Path) -> pd.DataFrame:
    """What is named or in a class."""
    for stage in STAGES:
        bsip(stage, study, "--out", out)
    table = pd.read_parquet(out / "sub-01" / "sub-01_diagnosis.parquet")
    return table[table["verdict"] != "rejected"]


def identifying(out: Path) -> set[str]:
    """Trials that identified OM."""
    return set(pd.read_parquet(out / "sub-01" / "sub-01_used-blocks.parquet")["trial"])


def study_on_two_plates(folder: Path, **names: str) -> Path:
    """Trials of one person; in the files y is up and z sideways."""
    files = {
        f"sub-01_task-{task}.{ending}": f"opencap_subject4/{name}{suffix}.{ending}"
        for task, name in names.items()
        for ending, suffix in (("trc", ""), ("mot", "_grf"))
    }
    options = '[roles]\nsequence = ["squats"]\n'
    return make_study(folder, ["sub-01\tM\t62.6\t1.68"], options, files)


def test_an_offset_hidden_in_a_real_recording_is_found_with_its_size(tmp_path):
    """15 N sideways in squats."""
    study = study_on_two_plates(tmp_path / "study", static="static1", squats="squats1")
    hidden = ("--effect", "plate_zero", "--size", "15", "--target", "fz,plate=1")
    bsip("inject", study, tmp_path / "copy", *hidden, "--effect-tasks", "squats")
    found = diagnosis_of(tmp_path / "copy", tmp_path / "out").set_index(["effect", "target"])
    offset = found.loc[("plate_zero", "1 fy"), "estimate"].item()  # as likely on plate 2: a class
    assert abs(offset + 15) < 2.5
    # The plates read 4 % less than the stated mass in quiet standing.
    gain = found.loc[("plate_gain", "all fz"), "estimate"].item()
    assert abs(gain + 0.0406) < 0.003


def test_a_delay_hidden_in_real_recordings_is_named_with_its_size(tmp_path):
    """15 ms, where forces come 5 to 6 ms late by cross-correlation already."""
    names = {"static": "static1", "squats": "squats1", "sitstand": "STS1"}
    study = study_on_two_plates(tmp_path / "study", **names)
    hidden = ("--effect", "sync_offset", "--size", "0.015", "--target", "-")
    bsip("inject", study, tmp_path / "copy", *hidden)
    found = diagnosis_of(tmp_path / "copy", tmp_path / "out").set_index("effect")
    delay = found.loc[["sync_offset"]].iloc[0]
    assert (delay["verdict"], delay["parameter"]) == ("named", "delay")
    assert abs(delay["estimate"] - 0.0205) < 0.002


def test_a_mass_hidden_in_one_recording_is_not_told_of_the_other(tmp_path):
    """1 kg in squats, where plates read 2.6 kg less than stated in all trials."""
    names = {"static": "static1", "squats": "squats1", "sitstand": "STS1"}
    study = study_on_two_plates(tmp_path / "study", **names)
    hidden = ("--effect", "added_mass", "--size", "1", "--target", "forearm_r")
    bsip("inject", study, tmp_path / "copy", *hidden, "--effect-tasks", "squats")
    found = diagnosis_of(tmp_path / "copy", tmp_path / "out")
    assert "unmeasured_contact" not in set(found["effect"])
    assert identifying(tmp_path / "out") == {"sub-01_task-squats"}
    masses = found[(found["effect"] == "added_mass") & (found["parameter"] == "mass")]
    assert set(masses["trials"]) == {"sub-01_task-squats"}
    # One of four intervals begins at 1.02 kg.
    assert (masses["ci_low"] < 1.05).all() and (masses["ci_high"] > 0.95).all()


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
    assert identifying(tmp_path / "out") == set()


def test_a_golf_club_is_an_implement_in_both_hands(tmp_path):
    """A driver: about 0.3 kg, its centre 0.8 m from the hands, 0.24 kg m2 about them."""
    files = {f"sub-01_task-swing_run-{k}.c3d": f"golf_french/swing{k}.c3d" for k in (1, 3, 5)}
    files["sub-01_task-static.c3d"] = "golf_french/static.c3d"
    markers = DATA / "golf_french" / "marker_set_by_hand.toml"
    options = f'marker_set = "{markers}"\n[roles]\nsequence = ["swing"]\n'
    study = make_study(tmp_path / "study", ["sub-01\tM\tn/a\tn/a"], options, files)
    found = diagnosis_of(study, tmp_path / "out")
    club = found[found["effect"] == "implement"].set_index("parameter")
    assert set(club["target"]) == {"hand_l+hand_r"} and set(club["verdict"]) == {"named"}
    assert 0.2 < club.loc["mass", "estimate"] < 0.5
    assert 0.6 < club.loc["centre", "estimate"] < 1.0
    assert club.loc["inertia", "ci_low"] < 0.24 < club.loc["inertia", "ci_high"]
    faults = found[found["effect"].isin(["marker_shift", "marker_slide", "marker_swap"])]
    assert len(set(faults["target"])) <= 1
