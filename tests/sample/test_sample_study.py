"""The shipped sample study through the command line, judged by the truth that no stage reads."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tests.program import Program

pytestmark = pytest.mark.long

SAMPLE = Path(__file__).parents[2] / "sample_data"
COMPONENTS = ("fx", "fy", "fz", "mx", "my", "mz", "cop_ap", "cop_ml")


@pytest.fixture(scope="module")
def out(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("sample") / "out"
    Program().done("run", SAMPLE, "--out", folder, "--jobs", 2)
    return folder


def held_out_errors(out: Path) -> pd.DataFrame:
    """Mean RMSE over the validating movements: rows participant and component, columns method."""
    tables = []
    for path in sorted(out.glob("sub-*/*_fit.parquet")):
        if "task-static" in path.name or "task-sequence" in path.name:
            continue
        table = pd.read_parquet(path)
        assert (table["data"] == "held_out").all()
        tables.append(table.assign(participant=path.parent.name))
    joined = pd.concat(tables)
    return joined.pivot_table(index=["participant", "component"], columns="method", values="rmse")


def truth(name: str) -> dict:
    return json.loads((SAMPLE / "truth" / f"{name}_truth.json").read_text())["person"]


def test_om_beats_rm_on_unseen_movements_in_every_component(out):
    errors = held_out_errors(out).groupby("component").mean()
    for component in COMPONENTS:
        others = errors.loc[component, ["RM", "RM+mass"]]
        assert errors.loc[component, "OM"] < others.min(), component


def test_om_halves_the_error_of_the_cop_in_the_identification_sequence(out):
    for path in out.glob("sub-*/*task-sequence*_fit.parquet"):
        rmse = pd.read_parquet(path).pivot(index="component", columns="method", values="rmse")
        assert rmse.loc["cop_ap", "OM"] < 0.6 * rmse.loc["cop_ap", "RM"]
        assert rmse.loc["cop_ml", "OM"] < 0.6 * rmse.loc["cop_ml", "RM"]


def test_the_pose_fits_the_markers_and_their_noise_is_recognised(out):
    from bsip_cli.artifacts import read_header

    for path in out.glob("sub-*/*task-sequence*_kinematics.parquet"):
        facts = read_header(path)["provenance"]["facts"]
        assert facts["marker_rms_m"] < 0.004
        assert 0.0002 < facts["marker_noise_m"] < 0.0004  # simulated with 0.3 mm


def test_skeleton_lengths_come_near_the_truth(out):
    for path in out.glob("sub-*/sub-*_skeleton.parquet"):
        lengths = pd.read_parquet(path).set_index("segment")["length_m"]
        true = truth(path.parent.name)["segment_lengths_m"]
        for segment in ("thigh_l", "thigh_r", "shank_l", "shank_r", "forearm_l", "forearm_r"):
            assert abs(lengths[segment] - true[segment]) < 0.025, (path.parent.name, segment)


def test_stated_uncertainty_of_the_masses_covers_the_truth(out):
    inside = []
    for path in out.glob("sub-*/sub-*_bsip.parquet"):
        rows = pd.read_parquet(path)
        rows = rows[rows["method"] == "OM"].set_index("segment")
        segments = truth(path.parent.name)["segments"]
        true = np.array([segments[name]["mass_kg"] for name in rows.index])
        inside += list(np.abs(rows["mass_kg"] - true) < 1.96 * rows["mass_kg_sd"])
    assert np.mean(inside) > 0.85


def test_every_segment_has_a_mass_and_they_sum_to_the_person(out):
    for path in out.glob("sub-*/sub-*_bsip.parquet"):
        rows = pd.read_parquet(path)
        sums = rows.groupby("method")["mass_kg"].sum()
        stated = pd.read_csv(SAMPLE / "participants.tsv", sep="\t").set_index("participant_id")
        mass = stated.loc[path.parent.name, "mass_kg"]
        assert abs(sums["RM"] - mass) < 1e-9
        assert abs(sums[["RM+mass", "OM"]] - mass).max() < 0.5
        assert (rows["mass_kg"] > 0).all()
        shares = rows[[name for name in rows.columns if name.endswith("_data_share")]]
        assert ((shares >= 0) & (shares <= 1)).all().all()


def test_valid_windows_follow_the_true_contacts(out):
    """Frames in which a foot stands beside the plate are never compared."""
    for path in sorted(out.glob("sub-*/*task-steps*_wrench.parquet")):
        wrench = pd.read_parquet(path)
        record = json.loads((SAMPLE / "truth" / f"{path.parent.name}_truth.json").read_text())
        trial = record["trials"][path.name.replace("_wrench.parquet", "")]
        beside = [window for window in trial["contacts"] if not window["on_plate"]]
        assert beside
        for window in beside:
            inner = wrench["time_s"].between(window["start_s"] + 0.05, window["end_s"] - 0.05)
            assert not wrench.loc[inner, "valid"].any()


def test_the_balls_that_nobody_tells_of_are_found(out):
    """In 11 of 12 throws, of which two seconds or less can be used; nothing else is named.

    When a ball leaves the hand in the air no plate feels it, so such times are left out of the
    count; intervals of some others are too narrow (6 or 7 hundredths of a second off, or in a gap).
    """
    found = []
    for path in sorted(out.glob("sub-*/sub-??_diagnosis.parquet")):
        rows = pd.read_parquet(path)
        told = rows[(rows["verdict"] != "rejected") & (rows["effect"] != "none")]
        if not len(told):
            continue
        assert set(zip(told["effect"], told["target"], strict=True)) == {
            ("released_object", "hand_r")
        }, path.parent.name
        record = json.loads((SAMPLE / "truth" / f"{path.parent.name}_truth.json").read_text())
        for name, ball in (("mass", "mass_kg"), ("release_time", "release_s")):
            for row in told[told["parameter"] == name].itertuples():
                trial = record["trials"][row.trials]
                true = trial["ball"][ball]
                if name == "release_time" and any(a < true < b for a, b in trial["flights_s"]):
                    continue
                found.append((row.trials, name, row.ci_low <= true <= row.ci_high))
    masses = {(trial, inside) for trial, name, inside in found if name == "mass"}
    assert len(masses) >= 11 and all(inside for _, inside in masses)
    assert sum(inside for *_, inside in found) >= 0.8 * len(found)
