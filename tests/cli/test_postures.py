"""Postures that are held on the plates identify what squats alone leave open."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
import pytest
from scipy.stats import binom

pytestmark = pytest.mark.long

PEOPLE = 3
STAGES = ("ingest", "scale", "ik", "regress", "identify")
LIMBS = ("upper_arm", "forearm", "thigh", "shank")


@pytest.fixture(scope="module")
def study(bsip, tmp_path_factory) -> Path:
    """The simulator's forces are the rate of momentum of its bodies: none of bsip's equations."""
    folder = tmp_path_factory.mktemp("postures") / "study"
    tasks = [word for task in ("static", "squat", "postures") for word in ("--task", task)]
    bsip.done("simulate", folder, "--participants", PEOPLE, "--seed", 37501, *tasks)
    return folder


def limbs(bsip, study: Path, *tasks: str) -> pd.DataFrame:
    """Of every limb, identified from these tasks: error and standard deviation of the mass [kg]."""
    out, options = study.with_name("out"), study.with_name("roles.toml")
    options.write_text(f"[roles]\nsequence = {json.dumps(tasks)}\n")
    for stage in STAGES:
        bsip.done(stage, study, "--out", out, "--config", options)
    rows = []
    for number in range(1, PEOPLE + 1):
        sub = f"sub-{number:02d}"
        truth = json.loads((study / "truth" / f"{sub}_truth.json").read_text())["person"]
        table = pd.read_parquet(out / sub / f"{sub}_bsip.parquet")
        for row in table[table["method"] == "OM"].to_dict("records"):
            if row["segment"][:-2] in LIMBS:
                true = truth["segments"][row["segment"]]["mass_kg"]
                rows.append((sub, row["segment"], abs(row["mass_kg"] - true), row["mass_kg_sd"]))
    return pd.DataFrame(rows, columns=["person", "segment", "error", "sd"])


def test_postures_narrow_the_intervals_of_limbs_and_these_still_hold(bsip, study):
    squats = limbs(bsip, study, "squat")
    both = limbs(bsip, study, "squat", "postures")
    assert len(squats) == len(both) == 2 * len(LIMBS) * PEOPLE
    narrower = both["sd"] / squats["sd"]
    assert (narrower < 1.0).mean() > 0.9
    assert narrower.mean() < 0.9
    held = (both["error"] <= 1.96 * both["sd"]).sum()
    # Both sides of a limb err alike: half as many numbers as there are limbs, at 95 % each.
    assert held >= 2 * binom.ppf(0.01, len(both) // 2, 0.95)
