"""The extended model of a simulated study whose forces come late, and of one without a cause."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from bsip_cli.artifacts import write_artifact
from bsip_cli.commands.show import shown
from bsip_cli.effects.loads import AddedMass
from bsip_cli.pipeline import STAGES
from bsip_cli.simulate.options import Asked, StudyOptions
from bsip_cli.simulate.study import simulate_study
from bsip_cli.stages.frames import parameters_of, person_of
from bsip_cli.stages.trial_scene import cause_record, scene_of
from bsip_cli.statistics.methods import MEASURED, METHODS
from tests.small_study import Run, small

pytestmark = pytest.mark.long

NULL = small(static=1.0, sequence=10.0, squat=6.0)
LATE = replace(NULL, effects=(Asked("sync_offset", 0.02),))
SEQUENCE, SQUAT, STATIC = (
    f"sub-01_task-{name}" for name in ("sequence_run-1", "squat_run-1", "static")
)
UNITS = 1 + 3 + 1
EXTEND = [stage.label for stage in STAGES if stage.name == "extend"]


def run_of(options: StudyOptions, folder: Path) -> Run:
    run = Run.within(folder)
    simulate_study(run.study, options)
    run.done("run")
    return run


@pytest.fixture(scope="module")
def late_run(tmp_path_factory) -> Run:
    return run_of(LATE, tmp_path_factory.mktemp("late"))


@pytest.fixture(scope="module")
def null_run(tmp_path_factory) -> Run:
    return run_of(NULL, tmp_path_factory.mktemp("null"))


@pytest.fixture
def run(late_run, tmp_path) -> Run:
    return late_run.copied_to(tmp_path)


def content(run: Run) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in run.out.rglob("*.parquet")}


def extended(frame: pd.DataFrame) -> list[str]:
    return [name for name in dict.fromkeys(frame["method"]) if name.startswith("OM+")]


# --- what is gained -----------------------------------------------------------------------------


def test_the_extended_model_stands_beside_om(late_run):
    methods = extended(late_run.read("extended-bsip"))
    assert methods[0] == "OM+sync_offset"
    for stem in (SEQUENCE, SQUAT, STATIC):  # all were recorded with the same clocks
        for kind in ("fit", "reconstruction"):
            table = late_run.read(kind, stem)
            assert extended(table) == methods
            assert {"RM", "OM"} < set(table["method"])
        rows = late_run.read("reconstruction", stem)
        assert rows["method"].value_counts().nunique() == 1


def test_held_out_error_is_smaller_for_sure(late_run):
    gain = late_run.read("gain", SQUAT).set_index("component")
    assert set(gain.index) == set(late_run.read("fit", SQUAT)["component"])
    for component in ("fz", "grf_vertical", "mx", "my"):
        row = gain.loc[component]
        assert 0 < row["ci_low"] < row["gain_percent"] < row["ci_high"]
        assert row["rmse_after"] < row["rmse_before"]
    assert gain["data"].str.startswith("held_out: ").all()
    own = late_run.read("gain", SEQUENCE)
    assert own["data"].str.startswith("identification: ").all()
    whole = late_run.read("overall-gain").set_index("component")
    assert whole.loc["fz", "ci_low"] > 0
    assert whole["data"].eq(f"identification: {SEQUENCE}; held_out: {SQUAT}, {STATIC}").all()
    fit = late_run.read("fit", SQUAT).set_index(["method", "component"])["rmse"]
    after = gain["method"].iloc[0]
    for component, row in gain.iterrows():
        assert row["rmse_before"] == pytest.approx(fit["OM", component])
        assert row["rmse_after"] == pytest.approx(fit[after, component])


def test_forces_are_moved_back_in_time(late_run):
    """To what the measured force is some frames later."""
    corrected = late_run.read("corrected-wrench", SQUAT)
    measured = late_run.read("wrench", SQUAT)
    kept = corrected["valid"].to_numpy()
    moved = (corrected["fz_N"] - measured["fz_N"])[kept]
    rate = measured["fz_N"].diff()[kept] * 50.0
    slope = float((moved * rate).sum() / (rate**2).sum())
    assert 0.005 < slope < 0.03
    assert not late_run.read("corrected-wrench", STATIC).empty


def test_what_the_delay_had_done_to_the_body(late_run):
    bsip = late_run.read("bsip").query("method == 'OM'").set_index("segment")
    again = late_run.read("extended-bsip")
    first = again[again["method"] == "OM+sync_offset"].set_index("segment")
    change = late_run.read("bsip-change").query("method == 'OM+sync_offset'")
    change = change.set_index("segment")
    difference = first["mass_kg"] - bsip["mass_kg"]
    assert change["mass_change_kg"].to_dict() == pytest.approx(difference.to_dict())
    assert difference.abs().max() > 0
    named = change.index[change["largest"].str.contains("mass and|^mass")]
    assert list(named) == [difference.abs().idxmax()]
    assert late_run.read("extended-skeleton").empty


# --- what runs again ----------------------------------------------------------------------------


def test_second_run_does_nothing_and_a_forced_one_the_same(run):
    before = content(run)
    answer = run.call("run")
    assert " done" not in answer.summary
    answer = run.call("extend")
    assert answer.summary.startswith(f"bsip extend: {UNITS} up to date;")
    answer = run.call("extend", "--force")
    assert answer.summary.startswith(f"bsip extend: {UNITS} done;")
    assert content(run) == before


def test_reconstruct_stays_fresh_and_is_noticed(run):
    before = content(run)
    assert run.perform("reconstruct (trial)", SQUAT).state == "fresh"
    header = run.provenance("fit", SQUAT)
    assert (header["made_by"]["stage"], header["amended_by"]["stage"]) == ("reconstruct", "extend")
    run.done("reconstruct", "--force")
    assert extended(run.read("fit", SQUAT)) == []
    answer = run.call("extend")
    assert answer.summary.startswith("bsip extend: 3 done, 2 up to date;")
    assert content(run) == before


def test_without_what_it_amends_it_waits(run):
    run.path("fit", SQUAT).unlink()
    outcome = run.perform("extend (trial)", SQUAT)
    assert outcome.state == "waiting"
    assert "run `bsip reconstruct` first" in outcome.sentences[0]


# --- other causes -------------------------------------------------------------------------------


def diagnose_instead(run: Run, *causes: dict, heavier_by: float = 0.0) -> None:
    """As if the diagnosis had named these, of a body heavier than stated."""
    notes = run.provenance("overall-diagnosis")
    notes["facts"] |= {"causes": list(causes), "heavier_by": heavier_by}
    path = run.path("overall-diagnosis")
    write_artifact(path, "overall-diagnosis", run.read("overall-diagnosis"), notes)
    states = [run.perform(EXTEND[0]).state]
    states += [run.perform(EXTEND[1], stem).state for stem in (SEQUENCE, SQUAT, STATIC)]
    states += [run.perform(EXTEND[2]).state]
    assert states == ["done"] * UNITS


def cause(effect: str, target: str, values: list[float], *trials: str) -> dict:
    return cause_record(effect, target, trials, np.array(values))


def test_a_cause_of_one_held_out_trial_leaves_the_parameters(run):
    diagnose_instead(run, cause("plate_zero", "1 fz", [300.0], SQUAT))
    om = run.read("bsip").query("method == 'OM'").drop(columns="method")
    again = run.read("extended-bsip").drop(columns="method")
    pd.testing.assert_frame_equal(again, om.reset_index(drop=True))
    assert (run.read("bsip-change")["largest"] == "").all()
    assert extended(run.read("fit", SQUAT)) == ["OM+plate_zero"]
    assert extended(run.read("fit", SEQUENCE)) == []
    gain = run.read("gain", SQUAT).set_index("component")
    assert gain.loc["fz", "gain_percent"] < -100  # nobody had added 300 N
    assert run.read("gain", SEQUENCE).empty
    corrected, measured = run.read("corrected-wrench", SQUAT), run.read("wrench", SQUAT)
    assert (measured["fz_N"] - corrected["fz_N"]).to_numpy() == pytest.approx(300.0)


def test_a_mass_sits_where_the_diagnosis_found_it(run):
    """Its place is told from the segment's centre in RM, not from where OM has put that."""
    mass_kg, target = 5.0, "upper_torso"
    diagnose_instead(run, cause("added_mass", target, [mass_kg, 0.0, 0.0, 0.0], SQUAT))
    table = run.read("reconstruction", SQUAT)
    om, extended_om = (
        table[table["method"] == name].set_index("time_s") for name in ("OM", "OM+added_mass")
    )
    unit = run.unit(EXTEND[1], SQUAT)
    person = person_of(unit)
    methods, phi = parameters_of(unit.read("bsip"), person)
    change = {
        method: AddedMass().change(
            scene_of(unit, person, phi[:, methods.index(method)]),
            target,
            np.array([mass_kg, 0.0, 0.0, 0.0]),
        )
        for method in ("RM", "OM")
    }
    kept = om["valid"].to_numpy()
    moment = (extended_om["my_Nm"] - om["my_Nm"]).to_numpy()[kept].mean()
    expected, other = (change[method][kept, 4].mean() for method in ("RM", "OM"))
    assert abs(expected - other) > 0.15
    assert moment == pytest.approx(expected, abs=0.05)


def test_a_cause_is_taken_off_the_body_that_the_diagnosis_believed_in(run):
    """A lab that tilts pulls at one as heavy as the plates read, not as stated."""
    changes = []
    for heavier_by in (0.0, 0.1):
        tilted = cause("gravity_tilt", "", [0.0, 0.02], SQUAT)
        diagnose_instead(run, tilted, heavier_by=heavier_by)
        table = run.read("reconstruction", SQUAT)
        table = table[table["valid"]].groupby("method")["fx_N"].mean()
        changes.append(table["OM+gravity_tilt"] - table["OM"])
    assert abs(changes[0]) > 5
    assert changes[1] / changes[0] == pytest.approx(1.1, rel=1e-3)


def test_om_is_extended_by_the_estimator_that_made_it(run):
    before = run.read("extended-bsip")
    configured = run.study / "study.toml"
    configured.write_text(
        configured.read_text() + '\n[identify]\nestimators = ["hansen2017", "consistent"]\n'
    )
    assert run.perform(EXTEND[0]).state == "done"
    pd.testing.assert_frame_equal(run.read("extended-bsip"), before)


def test_nothing_of_an_earlier_diagnosis_is_told(run):
    told = "\n".join(shown(run.out, full=True))
    assert "What it does to the forces" in told
    run.rewrite("overall-diagnosis", run.read("overall-diagnosis").assign(p_value=2e-4))
    told = "\n".join(shown(run.out, full=True))
    assert "What it does to the forces" not in told and "run `bsip extend`" in told


def test_causes_are_added_in_their_order(run):
    first = cause("missing_joint", "upper_torso", [0.2, 0.1, 0.3], SEQUENCE, SQUAT)
    diagnose_instead(run, first, cause("plate_gain", "1 fx", [0.01], SQUAT))
    both = ["OM+missing_joint", "OM+missing_joint+plate_gain"]
    assert extended(run.read("extended-bsip")) == both
    assert extended(run.read("fit", SEQUENCE)) == both[:1]
    assert extended(run.read("fit", SQUAT)) == both
    below, above = run.read("extended-skeleton").to_dict("records")
    assert above["parent"] == below["segment"] == "upper_torso_below"
    assert below["mass_share"] + above["mass_share"] == pytest.approx(1.0)
    assert [above[f"{axis}_share"] for axis in ("flexion", "lateral", "axial")] == [0.2, 0.1, 0.3]
    assert below["flexion_share"] == pytest.approx(0.8)


def test_what_is_unexplained_extends_nothing(run):
    diagnose_instead(run, cause("unexplained", "z by x", [1.0], SQUAT))
    assert run.read("extended-bsip").empty
    assert extended(run.read("fit", SQUAT)) == []


# --- nothing wrong ------------------------------------------------------------------------------


def test_without_a_cause_nothing_is_added(null_run):
    for kind in ("extended-bsip", "bsip-change", "extended-skeleton", "overall-gain"):
        assert null_run.read(kind).empty
    for stem in (SEQUENCE, SQUAT, STATIC):
        assert null_run.read("gain", stem).empty
        assert set(null_run.read("fit", stem)["method"]) == set(METHODS)
        assert set(null_run.read("reconstruction", stem)["method"]) == {MEASURED, *METHODS}
