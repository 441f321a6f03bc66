"""A laboratory from four simulated persons, each with a static trial and two short walks."""

from __future__ import annotations

import shutil

import pytest

from bsip_cli.artifacts import read_artifact

DELAY_S = 0.015  # what skin may be late by, beyond the limit
STAGES = ("ingest", "scale", "ik", "regress", "identify", "laboratory")


def rows_of(bsip, folder, *hidden):
    """The laboratory's table of people of whom the simulator writes C3D only."""
    people = ("--preset", "sample", "--participants", 4, "--task", "walking")
    study, more, out = folder / "study", folder / "more", folder / "out"
    bsip.done("simulate", study, *people, "--task", "static", *hidden)
    bsip.done("simulate", more, *people, "--run", 2, *hidden)
    for walk in more.glob("sub-*/*walking*"):
        shutil.copy(walk, study / walk.parent.name)
    for stage in STAGES:
        bsip.done(stage, study, "--out", out)
    return read_artifact(out / "group" / "group_laboratory.parquet", "laboratory")


@pytest.mark.long
def test_a_hidden_delay_is_in_its_interval(bsip, tmp_path):
    rows = rows_of(bsip, tmp_path, "--effect", "sync_offset", "--size", DELAY_S)
    delay = rows[rows["effect"] == "sync_offset"].iloc[0]
    assert delay["ci_low"] < DELAY_S < delay["ci_high"]
    assert delay["ci_low"] > 0.002
    assert delay["verdict"] in ("named", "ambiguous")
    assert (delay["persons"], delay["trials"]) == (4, 12)


@pytest.mark.long
def test_nothing_is_named_in_a_sound_laboratory(bsip, tmp_path):
    rows = rows_of(bsip, tmp_path)
    assert not rows["verdict"].isin(["named", "ambiguous"]).any()
    delay = rows[rows["effect"] == "sync_offset"].iloc[0]
    assert delay["ci_low"] < 0 < delay["ci_high"]
    assert 0.004 < delay["limit"] < 0.02
