"""The accuracy benchmark: its recordings are what they claim, its measures count right."""

import numpy as np
import pandas as pd
import pytest

from benchmarks import accuracy
from bsip_cli.body.inertia import Inertia
from bsip_cli.simulate.options import Richness
from bsip_cli.simulate.people import draw_person

SHIFT_M = np.array([0.003, 0.0, 0.004])
TRUE = Inertia(2.0, np.array([0.0, -0.1, 0.02]), np.diag([0.03, 0.012, 0.022]))


def test_only_one_arm_moves():
    rng = np.random.default_rng(3)
    plan = accuracy.one_arm_plan(draw_person(rng, Richness()), rng)
    moved = {
        name: np.rad2deg(np.ptp(angle, axis=0).max()) for name, angle in plan.angles_rad.items()
    }
    assert moved["shoulder_r"] > 15
    assert moved["elbow_r"] > 8
    assert max(size for name, size in moved.items() if name not in ("shoulder_r", "elbow_r")) < 3


def test_errors_of_a_segment():
    turn = np.array([[0.0, -1.0, 0.0], [0.6, 0.0, -0.8], [0.8, 0.0, 0.6]])
    found = Inertia(2.5, TRUE.com_m + SHIFT_M, 1.1 * turn @ TRUE.tensor_kgm2 @ turn.T)
    wrong = accuracy.errors(found.readable(), TRUE.readable())
    assert wrong["mass"] == pytest.approx(0.5)
    assert wrong["centre"] == pytest.approx(5.0)
    assert wrong["inertias"] == pytest.approx(10.0)  # principal: however the axes turn
    assert wrong["physical"] == 1.0
    impossible = Inertia(2.5, TRUE.com_m, np.diag([0.03, 0.01, 0.05]))
    assert accuracy.errors(impossible.readable(), TRUE.readable())["physical"] == 0.0


def test_intervals_are_counted_per_group():
    true = TRUE.readable()
    found = true + np.array([0.0, 1.9, 2.0, 0.0, *[3.0] * 3, *[1.0] * 3])
    held = accuracy.inside(found, np.ones(10), true)
    assert held["masses"] == 1.0
    assert held["centres of mass"] == pytest.approx(2 / 3)
    assert held["tensors"] == 0.5
    assert held["all"] == 0.6


def test_ratios_are_taken_per_task():
    """A task with large errors does not outweigh the others."""
    size = {"RM": 2.0, "RM+mass": 1.5, "consistent": 1.0, accuracy.TRUTH: 0.5}
    size |= dict.fromkeys(accuracy.ESTIMATORS[1:], 1.0)
    forces = pd.DataFrame(
        [
            {"task": task, "component": component, "method": method, "rmse": scale * value}
            for task, scale in (("squat", 1.0), ("running", 100.0))
            for component in accuracy.COMPONENTS
            for method, value in size.items()
        ]
    )
    forces.loc[(forces["task"] == "squat") & (forces["method"] == "consistent"), "rmse"] = 0.25
    line = accuracy.floor_table(forces).splitlines()
    assert line[2].split("|")[2].strip() == "1.00"  # the geometric mean of 0.5 and 2
    assert line[3].split("|")[2].strip() == "2.00"
    rows = accuracy.force_table(forces).splitlines()
    assert rows[2].rstrip(" |").endswith("1.00 | 4.00")


@pytest.mark.long
def test_one_person(tmp_path):
    study, out = tmp_path / "study", tmp_path / "out"
    accuracy.write_study(study, 1, seed=5)
    own = accuracy.identify(study, out, accuracy.ONE_ARM)
    found = accuracy.named(accuracy.segment_errors(study, out))
    assert len(found) == 15 * (2 + len(accuracy.ESTIMATORS))
    assert found.loc[found["method"] == "consistent", "physical"].all()
    assert accuracy.LITTLE in accuracy.notes(out)
    forces = accuracy.named(accuracy.force_errors(study, out, [own], ["squat", "throwing"]))
    for table in (accuracy.segment_table, accuracy.coverage_table):
        assert "nan" not in table(found)
    for table in (accuracy.force_table, accuracy.floor_table):
        assert "nan" not in table(forces)
    squat = forces[(forces["task"] == "squat") & (forces["component"] == "fz")]
    rmse = squat.set_index("method")["rmse"]
    assert rmse[accuracy.TRUTH] < rmse["RM"]
    assert not list(out.glob("sub-*/*_fit.parquet"))  # the truth is no method of the study
