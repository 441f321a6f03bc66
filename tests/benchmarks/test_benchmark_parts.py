"""The pure parts of the benchmarks: a bench of the wrong thing is worse than none."""

import sys
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from benchmarks import (
    derivatives,
    inverse_kinematics,
    measure,
    moving_person,
    normal_equations,
    participant,
)


@pytest.fixture(scope="module")
def person():
    return moving_person.sample_person()


def test_markdown_table():
    table = measure.markdown(["a", "b"], [[1, "x"]])
    assert table.splitlines() == ["| a | b |", "| --- | --- |", "| 1 | x |"]


def test_interleaved_takes_turns_and_medians():
    turns = []

    def contestant(name, values):
        def run():
            turns.append(name)
            return values[len(turns) // 2 % len(values)]

        return run

    found = measure.interleaved({"A": contestant("A", [1]), "B": contestant("B", [3])}, 3)
    assert turns == list("ABABAB")
    assert found == {"A": 1, "B": 3}


def test_a_childs_memory_is_its_own():
    """Not that of this process, which a forked child starts with."""
    ballast = np.ones(40_000_000)
    used = measure.run_child([sys.executable, "-S", "-c", "print('x')"])
    assert used.stdout == "x"
    assert used.peak_mb < 50 < ballast.nbytes / 1e6


def test_a_failing_child_is_named():
    with pytest.raises(RuntimeError, match="ended with 3"):
        measure.run_child([sys.executable, "-c", "raise SystemExit(3)"])
    measure.run_child([sys.executable, "-c", "raise SystemExit(3)"], allowed=3)


def test_the_movement_is_smooth_and_whole_body(person):
    q, v, a = moving_person.movement(person, 50, 100.0)
    assert q.shape == (50, 51)
    assert v.shape == a.shape == (50, 40)
    assert np.abs(np.diff(q, axis=0)).max() < 0.05
    np.testing.assert_allclose(np.gradient(v, 0.01, axis=0)[1:-1], a[1:-1], atol=0.05)


def test_opensim_model_has_the_tree(person):
    joints = {"ball": {"FreeJoint", "BallJoint", "PinJoint"}, "custom": {"CustomJoint", "PinJoint"}}
    for family in inverse_kinematics.JOINTS:
        model = ET.fromstring(inverse_kinematics.opensim_model(person, family))
        assert len(model.findall(".//Body")) == 15
        assert len(model.findall(".//Coordinate")) == 40
        assert len(model.findall(".//Marker")) == len(person.markers) == 38
        assert {joint.tag for joint in model.find(".//JointSet/objects")} == joints[family]


def test_trc_is_turned_to_y_up():
    places = np.array([[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]])
    text = inverse_kinematics.trc_text(("A", "B"), places, 50.0)
    row = [float(cell) for cell in text.splitlines()[-1].split("\t")]
    assert row == [1, 0, 1, 3, -2, 4, 6, -5]


def test_optimum_column_finds_the_frame_that_is_worse():
    theirs = np.full(10, 0.007)
    ours = theirs.copy()
    ours[3] *= 1.002
    assert inverse_kinematics.optimum_column(ours, theirs)[-1] == "1 of 10"


def test_pinocchios_loop_ends_where_the_kernel_ends(person):
    q, _, _ = moving_person.movement(person, 3, 100.0)
    markers = moving_person.noisy_markers(person, q, 0.005)
    looped = inverse_kinematics.pinocchio_loop(person, markers, q[0])
    ours = inverse_kinematics.solve_poses(
        person, markers, q[0], **inverse_kinematics.SAME_PROBLEM
    ).frame_rms_m()
    np.testing.assert_allclose(inverse_kinematics.rms_of(person, looped, markers), ours, rtol=1e-6)
    assert inverse_kinematics.forward_difference(person, 5) < 1e-10


def test_the_true_acceleration_is_the_curves():
    true = derivatives.truth(6.4, 1000.0, 2, 1, seed=1, bias=0.93)
    found = np.diff(true.value, 2, axis=0) * 1e6
    np.testing.assert_allclose(found, true.second[1:-1], atol=0.01)
    assert 0.15 < true.burst.mean() < 0.25


@pytest.mark.parametrize("method", derivatives.SINGLE.values(), ids=derivatives.SINGLE)
def test_every_method_follows_a_slow_curve(method):
    true = derivatives.truth(6.4, 100.0, 1, 0, seed=2, bias=0.93)
    wrong = derivatives.errors(method, true, 1e-5, 100.0, seed=3)[2, 0]
    assert wrong < 0.05**2


def test_equations_of_a_repeated_minute():
    one = normal_equations.recording(120.0)
    assert len(one.q) == 12_000
    np.testing.assert_array_equal(one.q[:6000], one.q[6000:])


def test_stages_of_a_participant():
    names = participant.stage_names()
    assert names[0] == "ingest"
    assert len(names) == len(set(names))
    table = participant.table([("ik", 1.0, 0.5, 100.0), ("identify", 2.0, 0.5, 300.0)])
    assert "| all | 3.00 | 1.00 | 300 |" in table
