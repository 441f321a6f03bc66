"""Solved poses against an independent optimiser, and the kernel's geometry against Pinocchio."""

import numpy as np
import pinocchio as pin
import pytest
from scipy.optimize import least_squares

from bsip_cli.dynamics.ground_wrench import pinocchio_model
from bsip_cli.errors import BadDataError
from bsip_cli.motion.inverse_kinematics import (
    coordinate_covariance,
    first_pose,
    held_upright,
    neutral,
    place_base,
    posed,
    solve_poses,
    solve_trial,
    subtrees,
    tree_of,
)
from tests.body.standing_person import (
    away,
    joint_frames,
    markers_of,
    random_poses,
    standing,
    standing_markers,
    tilted_person,
)


@pytest.fixture(scope="module")
def tilted():
    return tilted_person()


@pytest.fixture(scope="module")
def person():
    return standing().person


def test_forward_kinematics_equals_pinocchio(tilted):
    q = random_poses(tilted, 40, 1.0, seed=1)
    at = posed(tilted, q)
    expected_R, expected_p = joint_frames(tilted, q)
    np.testing.assert_allclose(at.R, expected_R, rtol=0, atol=1e-12)
    np.testing.assert_allclose(at.p, expected_p, rtol=0, atol=1e-12)


def test_neutral_is_pinocchios(tilted):
    np.testing.assert_array_equal(neutral(tilted), pin.neutral(pinocchio_model(tilted)))


def test_parents_of_velocities_follow_the_tree(tilted):
    """Featherstone's lambda: within a joint the coordinate before, else the parent joint's last."""
    tree, model = tree_of(tilted), pinocchio_model(tilted)
    expected = []
    for j in range(1, model.njoints):
        parent = model.parents[j]
        last = -1 if parent == 0 else model.joints[parent].idx_v + model.joints[parent].nv - 1
        start = model.joints[j].idx_v
        expected += [last, *range(start, start + model.joints[j].nv - 1)]
    assert tree.v_parents.tolist() == expected


def test_model_markers_equal_pinocchios_placements(tilted):
    q = random_poses(tilted, 5, 0.8, seed=2)
    np.testing.assert_allclose(posed(tilted, q).markers_m, markers_of(tilted, q), atol=1e-12)


def test_the_calibrated_pose_shows_the_static_markers():
    calibration = standing()
    places = standing_markers()
    measured = np.array([places[label] for label in calibration.person.markers])
    np.testing.assert_allclose(
        markers_of(calibration.person, calibration.q[None])[0], measured, atol=1e-12
    )


def test_subtrees_are_the_markers_that_move_with_a_joint(tilted):
    names, below = tilted.skeleton.segments, subtrees(tilted)
    moved = {tilted.markers[m] for m in np.flatnonzero(below[names.index("forearm_r")])}
    assert moved == {"RFA", "RWRR", "RWRU", "RHAND"}
    assert below[0].all()


def test_pose_columns_equal_finite_differences(tilted):
    model, q = pinocchio_model(tilted), random_poses(tilted, 3, 0.8, seed=3)
    columns = posed(tilted, q).columns()
    h = 1e-5
    for k in range(model.nv):
        step = h * np.eye(model.nv)[k]
        ahead = markers_of(tilted, np.stack([pin.integrate(model, one, step) for one in q]))
        back = markers_of(tilted, np.stack([pin.integrate(model, one, -step) for one in q]))
        np.testing.assert_allclose(columns[..., k], (ahead - back) / (2 * h), atol=1e-8)


def test_coordinate_covariance_is_the_scatter_of_solved_poses(person):
    """Markers shaken by 0.1 mm: the linear covariance predicts the scatter of each coordinate."""
    rng = np.random.default_rng(4)
    still = markers_of(person, standing().q[None])
    shaken = still + rng.normal(0, 1e-4, (600, *still.shape[1:]))
    solved = solve_poses(
        person,
        shaken,
        standing().q,
        marker_sd_m=1e-4,
        robust_limit_m=1.0,
        posture_sd_rad=0.02,
        iterations=50,
    )
    errors = np.stack([away(person, standing().q, one) for one in solved.q])
    # The prior holds the angles by itself: only the markers' part of the covariance scatters.
    unit = coordinate_covariance(person, standing().q[None], 0.02 / 1e-4)[0] * 1e-4**2
    prior = np.zeros(40)
    prior[6:] = 0.02**-2
    scatter = unit - unit @ np.diag(prior) @ unit
    ratio = errors.std(axis=0) / np.sqrt(np.diag(scatter))
    assert np.all(np.abs(ratio - 1) < 0.15)


SD, LIMIT, POSTURE = 0.005, 0.025, 3.0
OPTIONS = {
    "marker_sd_m": SD,
    "robust_limit_m": LIMIT,
    "posture_sd_rad": POSTURE,
    "iterations": 60,
}
NO_PRIOR = OPTIONS | {"posture_sd_rad": 1e5}


def residual_vector(person, model, measured, q, limit):
    """Its squares are twice the cost: a marker's square grows like the logarithm far out."""
    apart = (measured - markers_of(person, q[None])[0])[np.isfinite(measured).all(axis=1)]
    weight = person.marker_weights[np.isfinite(measured).all(axis=1)] / SD**2
    d = np.linalg.norm(apart, axis=1)
    loss = np.where(d <= limit, d**2, limit**2 * (1 + 2 * np.log(np.maximum(d, limit) / limit)))
    shrunk = apart * np.sqrt(weight * loss / d**2)[:, None]
    turns = []
    for joint in range(2, model.njoints):
        at, size = model.joints[joint].idx_q, model.joints[joint].nq
        part = q[at : at + size]
        turns += [*pin.log3(pin.Quaternion(part).toRotationMatrix())] if size == 4 else [part[0]]
    return np.concatenate([shrunk.ravel(), np.array(turns) / POSTURE])


def optimum(person, model, measured, q, limit):
    def residuals(x):
        return residual_vector(person, model, measured, pin.integrate(model, q, x), limit)

    return least_squares(residuals, np.zeros(model.nv), xtol=1e-14, ftol=1e-14, gtol=1e-12)


def noisy_frames(person, q, sd, seed):
    rng = np.random.default_rng(seed)
    markers = markers_of(person, q)
    return markers + rng.normal(0, sd, markers.shape)


@pytest.mark.parametrize("case", ["all markers", "missing markers", "beyond the robust limit"])
def test_the_solved_pose_is_scipys_optimum(case):
    person = tilted_person()
    model = pinocchio_model(person)
    q = random_poses(person, 2, 0.4, seed=1)
    limit = 0.006 if case == "beyond the robust limit" else LIMIT
    markers = noisy_frames(person, q, 0.004, seed=2)
    if case == "missing markers":
        gone = np.random.default_rng(3).random(markers.shape[:2]) < 0.15
        markers[gone] = np.nan
    for k in range(2):
        options = OPTIONS | {"robust_limit_m": limit}
        mine = solve_poses(person, markers[k : k + 1], q[k], **options)
        assert mine.converged[0]
        cost = 0.5 * (residual_vector(person, model, markers[k], mine.q[0], limit) ** 2).sum()
        theirs = optimum(person, model, markers[k], q[k], limit)
        far = np.nanmax(mine.residual_m) > limit
        assert far == (case == "beyond the robust limit")
        assert cost == pytest.approx(theirs.cost, rel=1e-8)
        seen = np.isfinite(markers[k]).all(axis=1)
        assert np.array_equal(np.isfinite(mine.residual_m[0]), seen)


def test_noise_free_poses_come_back():
    person = tilted_person()
    q = random_poses(person, 20, 0.3, seed=4)
    markers = markers_of(person, q)
    for k in range(len(q)):
        start = place_base(person, markers[k], neutral(person))
        found = solve_poses(person, markers[k : k + 1], start, **NO_PRIOR)
        assert np.abs(away(person, q[k], found.q[0])).max() < 1e-7
        assert found.residual_m.max() < 1e-7


@pytest.mark.parametrize("degrees", [60.0, 120.0, 170.0])
@pytest.mark.parametrize("axis", [0, 2])
def test_raised_arms_are_found_from_the_neutral_pose(person, axis, degrees):
    model = pinocchio_model(person)
    turn = np.zeros(model.nv)
    for joint, sign in (("shoulder_l", -1.0), ("shoulder_r", 1.0)):
        sideways = sign if axis == 0 else 1.0
        turn[model.joints[model.getJointId(joint)].idx_v + axis] = sideways * np.deg2rad(degrees)
    q = pin.integrate(model, neutral(person), turn)
    markers = markers_of(person, q[None])
    start = place_base(person, markers[0], neutral(person))
    found = solve_poses(person, markers, start, **NO_PRIOR)
    same = joint_frames(person, found.q)[0] - joint_frames(person, q[None])[0]
    assert np.abs(same).max() < 1e-7


def test_a_motion_is_followed_from_frame_to_frame_over_turns(person):
    """A spin of two turns with a wheeling arm: no frame may jump to another optimum."""
    model = pinocchio_model(person)
    t = np.linspace(0, 1, 120)
    v = np.zeros(model.nv)
    v[5] = 4 * np.pi  # about the body's Z
    v[model.joints[model.getJointId("shoulder_l")].idx_v + 2] = 2 * np.pi
    q = np.stack([pin.integrate(model, standing().q, v * s) for s in t])
    found = solve_poses(person, markers_of(person, q), standing().q, **NO_PRIOR)
    errors = [away(person, a, b) for a, b in zip(q, found.q, strict=True)]
    assert np.abs(errors).max() < 1e-7


@pytest.mark.parametrize("label", ["XIPH", "RASIS", "LKNEL", "RELB", "FHEAD"])
def test_a_wild_marker_hardly_moves_the_pose(person, label):
    """Its pull fades as 1 / distance: 0.025^2 / 0.3, some 2 mm, spread over the segment."""
    q = random_poses(person, 1, 0.2, seed=5)
    markers = np.repeat(markers_of(person, q), 2, axis=0)
    clean = solve_poses(person, markers, q[0], **OPTIONS).q[0]
    markers[1, person.markers.index(label)] += [0.18, -0.2, 0.13]  # 0.3 m
    bent = solve_poses(person, markers, q[0], **OPTIONS)
    assert bent.residual_m[1, person.markers.index(label)] == pytest.approx(0.3, abs=0.01)
    assert np.abs(away(person, clean, bent.q[1]))[:3].max() < 0.003
    moved = np.linalg.norm(markers_of(person, bent.q[1:])[0] - markers[0], axis=1)
    assert moved.max() < 0.006
    least = solve_poses(person, markers, q[0], **(OPTIONS | {"robust_limit_m": 10.0})).q[1]
    pulled = np.linalg.norm(markers_of(person, least[None])[0] - markers[0], axis=1)
    assert pulled.max() > 10 * moved.max()  # plain least squares would have bent the body


def test_the_posture_prior_holds_what_no_marker_decides(person):
    skeleton = person.skeleton
    q = random_poses(person, 1, 0.3, seed=6)
    markers = markers_of(person, q)
    hand = person.marker_segments == skeleton.index("hand_r")
    markers[:, hand] = np.nan
    found = solve_poses(person, markers, q[0], **OPTIONS)
    wrist = skeleton.q_starts[skeleton.index("hand_r")]
    np.testing.assert_allclose(found.q[0, wrist : wrist + 3], 0.0, atol=1e-5)
    sd = dict(zip(skeleton.v_names, found.coordinate_sd[0], strict=True))
    assert sd["wrist_r_rx"] == pytest.approx(POSTURE, rel=1e-6)
    assert sd["hip_r_rx"] < 0.1
    left = skeleton.q_starts[skeleton.index("hand_l")]
    np.testing.assert_allclose(
        np.abs(found.q[0, left : left + 4]), np.abs(q[0, left : left + 4]), atol=1e-3
    )


def test_a_prior_of_its_own_for_each_coordinate(person):
    skeleton = person.skeleton
    q = random_poses(person, 1, 0.3, seed=7)
    q[0, skeleton.q_starts[skeleton.index("shank_l")]] = -0.4
    sd = np.full(40, 1e5)
    knee = skeleton.v_names.index("knee_l_angle")
    sd[knee] = 1e-6
    found = solve_poses(person, markers_of(person, q), q[0], **(OPTIONS | {"posture_sd_rad": sd}))
    assert abs(found.q[0, skeleton.q_starts[skeleton.index("shank_l")]]) < 1e-6
    assert found.rms_m() > 1e-4


@pytest.mark.parametrize("visible", ["all", "without the pelvis"])
def test_place_base_lays_the_body_on_its_markers(person, visible):
    q = random_poses(person, 1, 0.5, seed=8)[0]
    markers = markers_of(person, q[None])[0]
    if visible != "all":
        markers[person.marker_segments == 0] = np.nan
    elsewhere = q.copy()
    elsewhere[:7] = neutral(person)[:7]
    placed = place_base(person, markers, elsewhere)
    assert np.abs(away(person, q, placed)).max() < 1e-10


def test_rms_counts_only_markers_that_are_there(person):
    markers = noisy_frames(person, standing().q[None], 0.003, seed=9)
    markers[0, :5] = np.nan
    poses = solve_poses(person, markers, standing().q, **OPTIONS)
    apart = (markers - markers_of(person, poses.q))[0, 5:]
    expected = np.sqrt((apart**2).sum(axis=1).mean())
    assert poses.frame_rms_m()[0] == pytest.approx(expected, rel=1e-10)
    assert poses.rms_m() == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("frames", [0, 3])
def test_no_marker_at_all_is_bad_data(person, frames):
    markers = np.full((frames, len(person.markers), 3), np.nan)
    with pytest.raises(BadDataError, match="no marker"):
        solve_poses(person, markers, standing().q, **OPTIONS)


def test_poses_are_found_without_a_neighbour_and_go_on_after_a_gap(person):
    """From the neutral pose alone about one in six of these ends in a wrong optimum."""
    for q in random_poses(person, 30, spread_rad=0.7, seed=5):
        markers = np.repeat(markers_of(person, q[None]), 14, axis=0)
        start = first_pose(person, markers[0], **OPTIONS)
        alone = solve_poses(person, markers[:1], start, **OPTIONS)
        assert np.nanmax(alone.residual_m) < 1e-3
        markers[1:13] = np.nan
        poses = solve_poses(person, markers, q, **OPTIONS)
        assert np.nanmax(poses.residual_m) < 1e-3
        np.testing.assert_allclose(poses.q[13], poses.q[0], atol=2e-3)


def test_a_trial_is_solved_from_its_best_seen_frame_to_both_ends(person):
    q = random_poses(person, 1, spread_rad=0.3, seed=6)
    markers = np.repeat(markers_of(person, q), 9, axis=0)
    markers[:4, 5] = np.nan
    poses = solve_trial(person, markers, **OPTIONS)
    assert len(poses.q) == 9
    assert np.isnan(poses.residual_m[:4, 5]).all()
    np.testing.assert_allclose(poses.q[0], poses.q[8], atol=2e-3)


def test_a_person_who_walks_in_and_out_is_solved_between(person):
    """Whole intervals without any marker at both ends."""
    markers = np.repeat(markers_of(person, standing().q[None]), 12, axis=0)
    markers[:4] = markers[9:] = np.nan
    poses = solve_trial(person, markers, **OPTIONS)
    assert np.nanmax(poses.residual_m) < 1e-4
    assert np.isnan(poses.residual_m[[0, 11]]).all()
    assert (poses.coordinate_sd[[0, 11]].max(axis=1) > 1.0).all()
    assert np.isfinite(poses.q).all()


def leaning(person, leans_rad, about):
    """Poses of one who tilts as a whole about a level axis of the world."""
    turns = [pin.exp3(lean * np.array(about)) for lean in leans_rad]
    q = np.tile(neutral(person), (len(leans_rad), 1))
    upright = np.column_stack([(1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)])
    q[:, 3:7] = [pin.Quaternion(turn @ upright).coeffs() for turn in turns]
    return q


@pytest.mark.parametrize("about", [(0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.6, -0.8, 0.0)])
def test_an_unmarked_head_stays_upright_on_a_leaning_trunk(person, about):
    head, q = person.skeleton.index("head"), leaning(person, np.radians(range(86)), about)
    turned = posed(person, held_upright(person, q))
    np.testing.assert_allclose(
        turned.R[:, head, :, 1], np.tile([0.0, 0.0, 1.0], (86, 1)), atol=1e-6
    )
    others = [i for i in range(len(person.skeleton.segments)) if i != head]
    np.testing.assert_allclose(turned.R[:, others], posed(person, q).R[:, others], atol=1e-12)
    neck = np.einsum("fji,fjk->fik", turned.R[:, head - 1], turned.R[:, head])
    assert abs(pin.log3(neck[40])[1]) < 0.02  # it does not turn about its own axis


def test_a_head_upside_down_hangs_and_passes_through_without_a_leap(person):
    q = leaning(person, np.linspace(0.0, 2.0 * np.pi, 721), (0.0, 1.0, 0.0))
    q = np.concatenate([np.tile(q[:1], (800, 1)), q])  # and stands most of the time
    head = person.skeleton.index("head")
    R = posed(person, held_upright(person, q)).R[:, head]
    assert np.linalg.norm(np.diff(R[:, :, 1], axis=0), axis=1).max() < np.radians(1.1)
    assert R[800 + 360, 2, 1] < -0.99  # on the hands


def test_the_head_of_one_who_lies_stays_in_line(person):
    q = leaning(person, np.radians(np.linspace(75.0, 95.0, 50)), (0.0, 1.0, 0.0))
    np.testing.assert_array_equal(held_upright(person, q), q)
