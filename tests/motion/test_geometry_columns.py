"""How each parameter of the geometry moves markers, against finite differences."""

import numpy as np
import pytest

from bsip_cli.motion.inverse_kinematics import model_markers, subtrees, tree_of
from bsip_cli.motion.scaling import ScalingOptions, _column, _parameters, _with
from tests.body.standing_person import markers_of, random_poses, tilted_person

KINDS = ("length", "joint", "origin", "parent_tilt", "child_tilt", "shift", "marker")
OPTIONS = ScalingOptions(
    joint_centre_sd_m=0.015,
    length_sd=0.04,
    marker_sd_m=0.008,
    hinge_sd_rad=0.1,
    symmetry_sd=0.02,
    independent_frames=30,
    iterations=12,
)


def test_every_kind_of_parameter_is_there():
    parameters = tuple(_parameters(tilted_person(), OPTIONS))
    assert {parameter.kind for parameter in parameters} == set(KINDS)
    assert len(set(parameters)) == len(parameters)


@pytest.mark.parametrize("girdle", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_columns_equal_finite_differences(kind, girdle):
    person = tilted_person(girdle)
    parameters = tuple(_parameters(person, OPTIONS))
    q = random_poses(person, 3, 0.7, seed=1)
    R, p = tree_of(person).forward(q)
    model, below = model_markers(person, R, p), subtrees(person)
    h = 1e-5
    checked = 0
    for k, parameter in enumerate(parameters):
        if parameter.kind != kind:
            continue
        step = h * np.eye(len(parameters))[k]
        ahead = markers_of(_with(person, parameters, step), q)
        back = markers_of(_with(person, parameters, -step), q)
        expected = (ahead - back) / (2 * h)
        found = _column(parameter, person, R, p, model, below)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6, err_msg=str(parameter))
        assert np.abs(expected).max() > 1e-3
        checked += 1
    assert checked > 2


def test_lengths_follow_the_geometry():
    """A longer thigh is longer in the table's length and from hip to knee alike."""
    person = tilted_person()
    parameters = tuple(_parameters(person, OPTIONS))
    thigh = person.skeleton.index("thigh_l")
    x = np.array([0.02 * (p.kind == "length" and p.index == thigh) for p in parameters])
    longer = _with(person, parameters, x)
    assert longer.lengths_m[thigh] == pytest.approx(person.lengths_m[thigh] + 0.02)
    shank = person.skeleton.index("shank_l")
    hip_to_knee = [np.linalg.norm(one.joint_in_parent_m[shank]) for one in (person, longer)]
    assert hip_to_knee[1] - hip_to_knee[0] == pytest.approx(0.02, abs=1e-9)


def test_a_clavicle_is_as_long_as_its_joints_are_apart():
    """Its shoulder lies anywhere: it moves along three axes, and no table is scaled."""
    person = tilted_person(girdle=True)
    parameters = tuple(_parameters(person, OPTIONS))
    clavicle, arm = (person.skeleton.index(name) for name in ("clavicle_l", "upper_arm_l"))
    assert not [p for p in parameters if p.kind == "length" and p.index == clavicle]
    x = np.array([0.02 * (p.kind == "joint" and p.index == arm) for p in parameters])
    moved = _with(person, parameters, x)
    np.testing.assert_allclose(moved.joint_in_parent_m[arm], person.joint_in_parent_m[arm] + 0.02)
    length = np.linalg.norm(moved.joint_in_parent_m[arm])
    assert moved.lengths_m[clavicle] == pytest.approx(length)
