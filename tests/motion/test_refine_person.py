"""Scaling: how its parameters move markers, and a wrong geometry that it brings back."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from bsip_cli.dynamics.ground_wrench import pinocchio_model
from bsip_cli.motion.inverse_kinematics import posed, solve_poses, subtrees
from bsip_cli.motion.scaling import (
    ScalingOptions,
    TrialMarkers,
    _column,
    _parameters,
    _with,
    refine,
    refine_over_trials,
    varied_frames,
)
from tests.body.standing_person import (
    joint_frames,
    markers_of,
    random_poses,
    standing,
    tilted_person,
)

KINDS = ("length", "joint", "origin", "parent_tilt", "child_tilt", "shift", "marker")
LOOSE = ScalingOptions(
    joint_centre_sd_m=0.1,
    length_sd=0.5,
    marker_sd_m=0.1,
    hinge_sd_rad=0.5,
    symmetry_sd=0.5,
    mirror_sd_m=0.5,
    independent_frames=1000,
    iterations=25,
)


def test_every_kind_of_parameter_is_there():
    parameters = tuple(_parameters(tilted_person(), LOOSE))
    assert {parameter.kind for parameter in parameters} == set(KINDS)
    assert len(set(parameters)) == len(parameters)


@pytest.mark.parametrize("girdle", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_columns_equal_finite_differences(kind, girdle):
    person = tilted_person(girdle)
    parameters = tuple(_parameters(person, LOOSE))
    q = random_poses(person, 3, 0.7, seed=1)
    at, below = posed(person, q), subtrees(person)
    h = 1e-5
    checked = 0
    for k, parameter in enumerate(parameters):
        if parameter.kind != kind:
            continue
        step = h * np.eye(len(parameters))[k]
        ahead = markers_of(_with(person, parameters, step), q)
        back = markers_of(_with(person, parameters, -step), q)
        expected = (ahead - back) / (2 * h)
        found = _column(parameter, at, below)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6, err_msg=str(parameter))
        assert np.abs(expected).max() > 1e-3
        checked += 1
    assert checked > 2


def test_lengths_follow_the_geometry():
    """A longer thigh is longer in the table's length and from hip to knee alike."""
    person = tilted_person()
    parameters = tuple(_parameters(person, LOOSE))
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
    parameters = tuple(_parameters(person, LOOSE))
    clavicle, arm = (person.skeleton.index(name) for name in ("clavicle_l", "upper_arm_l"))
    assert not [p for p in parameters if p.kind == "length" and p.index == clavicle]
    x = np.array([0.02 * (p.kind == "joint" and p.index == arm) for p in parameters])
    moved = _with(person, parameters, x)
    np.testing.assert_allclose(moved.joint_in_parent_m[arm], person.joint_in_parent_m[arm] + 0.02)
    length = np.linalg.norm(moved.joint_in_parent_m[arm])
    assert moved.lengths_m[clavicle] == pytest.approx(length)


IK = {
    "marker_sd_m": 0.002,
    "robust_limit_m": 0.1,
    "posture_sd_rad": 100.0,
    "iterations": 50,
}
LIMBS = [f"{name}_{s}" for name in ("thigh", "shank", "upper_arm", "forearm") for s in "lr"]


def perturbed(person, seed, options=LOOSE):
    """Lengths off by 3 %, joint centres by 10 mm, hinges by 4 degrees, markers by 5 mm."""
    rng = np.random.default_rng(seed)
    size = {"length": 0.012, "parent_tilt": 0.07, "child_tilt": 0.07, "marker": 0.005}
    parameters = tuple(_parameters(person, options))
    return _with(
        person, parameters, np.array([rng.normal(0, size.get(p.kind, 0.01)) for p in parameters])
    )


@pytest.fixture(scope="module")
def refined():
    truth = standing().person
    q = random_poses(truth, 60, 0.45, seed=1)
    markers = markers_of(truth, q)
    first = perturbed(truth, seed=2)
    start = np.concatenate(
        [solve_poses(first, markers[k : k + 1], q[k], **IK).q for k in range(len(q))]
    )
    return truth, q, first, start, refine(first, markers, start, LOOSE, IK)


def test_the_residual_falls_to_almost_nothing(refined):
    *_, result = refined
    assert result.rms_before_m > 0.004
    assert result.poses.rms_m() < 2e-4


def test_lengths_come_back(refined):
    """To 2 mm only: a hinge's centre may slide along its axis, which no marker sees."""
    truth, _, first, _, result = refined
    at = [truth.skeleton.index(name) for name in LIMBS]
    before = np.abs(first.lengths_m - truth.lengths_m)[at]
    after = np.abs(result.person.lengths_m - truth.lengths_m)[at]
    assert before.max() > 0.02
    assert after.max() < 0.002
    assert after.mean() < 0.1 * before.mean()


def test_joint_centres_come_back_in_the_world(refined):
    """All but the pelvis' origin (a definition); of hinges the distance from the true axis."""
    truth, q, first, start, result = refined
    R, true = joint_frames(truth, q)
    hinge = [kind == "revolute" for kind in truth.skeleton.joint_types]
    axes = R @ truth.hinge_axes()[:, :, None]

    def errors(person, poses):
        apart = joint_frames(person, poses)[1] - true
        along = np.einsum("fni,fni->fn", apart, axes[..., 0])[..., None] * axes[..., 0]
        apart -= np.where(np.array(hinge)[:, None], along, 0.0)
        return np.linalg.norm(apart, axis=2).mean(axis=0)[1:]

    assert errors(first, start).min() > 0.002
    assert errors(first, start).mean() > 0.015
    assert errors(result.person, result.poses.q).max() < 1e-4


def test_hinges_come_back(refined):
    """The angle between the knee's axis and the true one, in the world."""
    truth, q, first, start, result = refined
    at = truth.skeleton.index("shank_l")

    def axes(person, poses):
        return joint_frames(person, poses)[0][:, at] @ person.hinge_axes()[at]

    true = axes(truth, q)
    before = np.arccos(np.einsum("fi,fi->f", axes(first, start), true).clip(-1, 1))
    after = np.arccos(np.einsum("fi,fi->f", axes(result.person, result.poses.q), true).clip(-1, 1))
    assert after.max() < min(0.01, before.max())


def test_a_true_geometry_stays():
    truth = standing().person
    q = random_poses(truth, 20, 0.4, seed=3)
    result = refine(truth, markers_of(truth, q), q, LOOSE, IK)
    np.testing.assert_allclose(result.person.lengths_m, truth.lengths_m, atol=1e-5)
    np.testing.assert_allclose(result.person.joint_in_parent_m, truth.joint_in_parent_m, atol=2e-5)


def test_left_and_right_are_tied_softly():
    """A leg that hangs still says little of its own length: it goes with the other one."""
    truth = standing().person
    q = random_poses(truth, 30, 0.4, seed=4)
    markers = markers_of(truth, q)
    skeleton = truth.skeleton
    for part in ("shank_l", "foot_l"):
        markers[:, truth.marker_segments == skeleton.index(part)] = np.nan
    parameters = tuple(_parameters(truth, LOOSE))
    x = np.zeros(len(parameters))
    for k, p in enumerate(parameters):
        if p.kind == "length" and skeleton.segments[p.index].startswith("shank"):
            x[k] = 0.03
    first = _with(truth, parameters, x)
    found = {}
    for tie in (0.5e-2, 10.0):
        options = replace(LOOSE, symmetry_sd=tie)
        found[tie] = refine(first, markers, q, options, IK).person.lengths_m - truth.lengths_m
    left, right = skeleton.index("shank_l"), skeleton.index("shank_r")
    assert abs(found[10.0][right]) < 0.001
    assert found[10.0][left] == pytest.approx(0.03, abs=1e-3)
    assert abs(found[0.5e-2][left]) < 0.002


def test_hips_mirror_each_other():
    """A hip whose leg shows no markers goes with the other one."""
    truth = standing().person
    q = random_poses(truth, 30, 0.4, seed=4)
    markers, skeleton = markers_of(truth, q), truth.skeleton
    for part in ("thigh_l", "shank_l", "foot_l"):
        markers[:, truth.marker_segments == skeleton.index(part)] = np.nan
    hips = [skeleton.index("thigh_l"), skeleton.index("thigh_r")]
    first = replace(truth, joint_in_parent_m=truth.joint_in_parent_m.copy())
    first.joint_in_parent_m[hips] += [[0.02, 0.02, -0.02], [0.02, 0.02, 0.02]]
    error = {}
    for tie in (1e-3, 10.0):
        found = refine(first, markers, q, replace(LOOSE, mirror_sd_m=tie), IK).person
        error[tie] = (found.joint_in_parent_m - truth.joint_in_parent_m)[hips]
    np.testing.assert_allclose(error[10.0][0], [0.02, 0.02, -0.02], atol=1e-4)
    np.testing.assert_allclose(error[1e-3][0], error[1e-3][1] * [1, 1, -1], atol=1e-4)
    assert np.linalg.norm(error[1e-3][0]) < 0.7 * np.linalg.norm(error[10.0][0])


def test_the_waist_is_tied_to_the_midline():
    truth = standing().person
    waist = truth.skeleton.index("upper_torso")
    aside = replace(truth, joint_in_parent_m=truth.joint_in_parent_m.copy())
    aside.joint_in_parent_m[waist, 2] += 0.03
    q = random_poses(truth, 30, 0.4, seed=4)
    found = {}
    for tie in (1e-5, 10.0):
        one = refine(truth, markers_of(aside, q), q, replace(LOOSE, mirror_sd_m=tie), IK).person
        found[tie] = one.joint_in_parent_m[waist, 2] - truth.joint_in_parent_m[waist, 2]
    assert found[10.0] > 0.02
    assert abs(found[1e-5]) < 0.003


def test_the_lengths_sd_tells_known_from_unknown():
    truth = standing().person
    q = random_poses(truth, 20, 0.4, seed=5)
    markers = markers_of(truth, q)
    skeleton = truth.skeleton
    markers[:, truth.marker_segments == skeleton.index("foot_l")] = np.nan
    markers[:, truth.marker_segments == skeleton.index("shank_l")] = np.nan
    loose = replace(LOOSE, symmetry_sd=10.0)
    sd = refine(truth, markers, q, loose, IK).length_sd_m
    prior = 0.5 * truth.lengths_m[skeleton.index("shank_l")]
    assert sd[skeleton.index("shank_l")] == pytest.approx(prior, rel=0.01)
    assert sd[skeleton.index("shank_r")] < 0.03 * prior
    assert np.isnan(sd[skeleton.index("head")])


def test_varied_frames_are_the_farthest_apart():
    truth = standing().person
    R = np.stack([np.eye(3)] * 15)[None].repeat(50, axis=0)
    turned = np.linspace(0, 1, 50)  # the head turns ever farther
    head = truth.skeleton.index("head")
    c, s = np.cos(turned), np.sin(turned)
    R[:, head, 0, 0], R[:, head, 0, 2], R[:, head, 2, 0], R[:, head, 2, 2] = c, s, -s, c
    assert varied_frames(R, 3).tolist()[::2] == [0, 49]
    assert varied_frames(R, 3)[1] in (24, 25)
    assert varied_frames(R, 99).tolist() == list(range(50))
    spin = np.linalg.qr(np.random.default_rng(0).normal(size=(50, 3, 3)))[0]
    spin *= np.linalg.det(spin)[:, None, None]
    assert varied_frames(spin[:, None] @ R, 3).tolist()[::2] == [0, 49]


def scaled(exchanged):
    """The standing person from four trials, in the last of which labels are exchanged."""
    calibration = standing()
    person, order = calibration.person, np.arange(len(calibration.person.markers))
    for pair in exchanged:
        at = [person.markers.index(label) for label in pair]
        order[at] = order[at[::-1]]
    standing_markers = TrialMarkers(np.zeros(1), markers_of(person, calibration.q[None]))
    trials, model = [], pinocchio_model(person)
    for seed in range(4):
        first, last = random_poses(person, 2, 0.4, seed)
        q = [pin.interpolate(model, first, last, part) for part in np.linspace(0, 1, 60)]
        trials.append(TrialMarkers(np.arange(60) / 100, markers_of(person, np.array(q))))
    trials[3] = replace(trials[3], markers_m=trials[3].markers_m[:, order])
    usual = replace(LOOSE, joint_centre_sd_m=0.015, length_sd=0.04, marker_sd_m=0.008)
    ik = IK | {"marker_sd_m": 0.005, "robust_limit_m": 0.025}
    return refine_over_trials(calibration, standing_markers, 0, trials, 40, usual, ik).person


@pytest.mark.parametrize("pairs", [["RASIS RPSIS", "LASIS LPSIS"], ["RELB LELB"], ["T10 XIPH"]])
def test_labels_exchanged_in_one_trial_do_not_scale_the_person(pairs):
    """A pelvis whose front is its back drew its places to the middle, and the hips with them."""
    found, right = scaled([pair.split() for pair in pairs]), scaled([])
    np.testing.assert_allclose(found.marker_positions_m, right.marker_positions_m, atol=1e-4)
    np.testing.assert_allclose(found.joint_positions_m(), right.joint_positions_m(), atol=1e-4)
