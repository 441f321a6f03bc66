"""The compiled kernel's geometry against Pinocchio, and derivatives against finite differences."""

import numpy as np
import pinocchio as pin
import pytest

from bsip_cli.dynamics.ground_wrench import pinocchio_model
from bsip_cli.motion.inverse_kinematics import (
    coordinate_covariance,
    model_markers,
    neutral,
    pose_columns,
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
def person():
    return tilted_person()


def test_forward_kinematics_equals_pinocchio(person):
    q = random_poses(person, 40, 1.0, seed=1)
    R, p = tree_of(person).forward(q)
    expected_R, expected_p = joint_frames(person, q)
    np.testing.assert_allclose(R, expected_R, rtol=0, atol=1e-12)
    np.testing.assert_allclose(p, expected_p, rtol=0, atol=1e-12)


def test_neutral_is_pinocchios(person):
    np.testing.assert_array_equal(neutral(person), pin.neutral(pinocchio_model(person)))


def test_parents_of_velocities_follow_the_tree(person):
    """Featherstone's lambda: within a joint the coordinate before, else the parent joint's last."""
    tree, model = tree_of(person), pinocchio_model(person)
    expected = []
    for j in range(1, model.njoints):
        parent = model.parents[j]
        last = -1 if parent == 0 else model.joints[parent].idx_v + model.joints[parent].nv - 1
        start = model.joints[j].idx_v
        expected += [last, *range(start, start + model.joints[j].nv - 1)]
    assert tree.arrays.v_parents.tolist() == expected


def test_model_markers_equal_pinocchios_placements(person):
    q = random_poses(person, 5, 0.8, seed=2)
    R, p = tree_of(person).forward(q)
    np.testing.assert_allclose(model_markers(person, R, p), markers_of(person, q), atol=1e-12)


def test_the_calibrated_pose_shows_the_static_markers():
    calibration = standing()
    places = standing_markers()
    measured = np.array([places[label] for label in calibration.person.markers])
    np.testing.assert_allclose(
        markers_of(calibration.person, calibration.q[None])[0], measured, atol=1e-12
    )


def test_subtrees_are_the_markers_that_move_with_a_joint(person):
    names, below = person.skeleton.segments, subtrees(person)
    moved = {person.markers[m] for m in np.flatnonzero(below[names.index("forearm_r")])}
    assert moved == {"RFA", "RWRR", "RWRU", "RHAND"}
    assert below[0].all()


def test_pose_columns_equal_finite_differences(person):
    model, tree = pinocchio_model(person), tree_of(person)
    q = random_poses(person, 3, 0.8, seed=3)
    R, p = tree.forward(q)
    columns = pose_columns(tree, R, p, model_markers(person, R, p), subtrees(person))
    h = 1e-5
    for k in range(tree.nv):
        step = h * np.eye(tree.nv)[k]
        ahead = markers_of(person, np.stack([pin.integrate(model, one, step) for one in q]))
        back = markers_of(person, np.stack([pin.integrate(model, one, -step) for one in q]))
        np.testing.assert_allclose(columns[..., k], (ahead - back) / (2 * h), atol=1e-8)


def test_coordinate_covariance_is_the_scatter_of_solved_poses():
    """Markers shaken by 0.1 mm: the linear covariance predicts the scatter of each coordinate."""
    from bsip_cli.motion.inverse_kinematics import solve_poses

    person = standing().person
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
