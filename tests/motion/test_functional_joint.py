"""Joints from movement: exact where two bodies turn about a line or a point, near it with noise."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bsip_cli.body.person import rigid_motion
from bsip_cli.motion.calibration import FunctionalJoint, functional_joint

CENTRE, AXIS = np.array([0.1, 0.2, 0.5]), np.array([0.1, 1.0, 0.2]) / np.sqrt(1.05)
THIGH = np.array([[0.1, 0.1, 0.9], [0.15, 0.2, 0.8], [0.05, 0.25, 0.7], [0.1, 0.3, 0.75]])
SHANK = np.array([[0.1, 0.1, 0.3], [0.15, 0.2, 0.2], [0.05, 0.25, 0.25]])


def hinge(n: int = 120, noise_m: float = 0.0, swing_rad: float = 0.8):
    """Both clusters carried about; the shank turns about the axis, (n, k, 3) each."""
    rng, t = np.random.default_rng(0), np.linspace(0, 6, n)
    carry = Rotation.from_rotvec(np.column_stack([0.3 * np.sin(t), 0.2 * t, 0.1 * np.cos(t)]))
    path = np.column_stack([t, np.sin(t), 0.1 * t])
    bend = Rotation.from_rotvec(np.outer(swing_rad * np.sin(1.7 * t), AXIS)).as_matrix()
    shank = CENTRE + np.einsum("nij,kj->nki", bend, SHANK - CENTRE)
    both = np.concatenate([np.broadcast_to(THIGH, (n, 4, 3)), shank], axis=1)
    moved = np.einsum("nij,nkj->nki", carry.as_matrix(), both) + path[:, None]
    moved += rng.normal(0, noise_m, moved.shape)
    return moved[:, :4], moved[:, 4:]


def joint_of(n: int = 120, noise_m: float = 0.0) -> tuple[FunctionalJoint, float]:
    """The joint that a hinge shows, and how far it lies beside the axis [m]."""
    joint = functional_joint(*hinge(n, noise_m), THIGH, SHANK)
    assert joint is not None
    beside = joint.point - CENTRE
    return joint, float(np.linalg.norm(beside - (beside @ AXIS) * AXIS))


def test_a_hinge_without_noise():
    joint, beside_m = joint_of()
    assert abs(joint.axis @ AXIS) == pytest.approx(1.0)
    assert beside_m < 1e-9 and joint.residual_m < 1e-9
    assert joint.turned_rad == pytest.approx(0.8, abs=0.01)


def test_the_point_of_the_axis_nearest_to_a_line_and_in_a_plane():
    (joint, _), (ahead, _, up) = joint_of(), np.eye(3)
    nearest = joint.nearest_to(CENTRE + 0.4 * up, CENTRE - 0.4 * up)
    np.testing.assert_allclose(nearest, CENTRE, atol=1e-9)
    inside = joint.in_plane(CENTRE, CENTRE + 0.3 * ahead, CENTRE + 0.3 * up)
    np.testing.assert_allclose(inside, CENTRE, atol=1e-9)


def test_noise_of_skin_leaves_millimetres():
    joint, beside_m = joint_of(400, noise_m=0.003)
    assert beside_m < 0.01
    assert np.rad2deg(np.arccos(abs(joint.axis @ AXIS))) < 5
    assert 0.001 < joint.residual_m < 0.02


def test_frames_with_lost_markers_are_left_out():
    thigh, shank = hinge(60)
    thigh[::3, 1] = np.nan
    joint = functional_joint(thigh, shank, THIGH, SHANK)
    assert joint is not None and joint.residual_m < 1e-9
    thigh[:, 1] = np.nan
    assert functional_joint(thigh, shank, THIGH, SHANK) is None


def test_rigid_motion_is_a_rotation():
    turn, shift = rigid_motion(SHANK, hinge(5)[1])
    np.testing.assert_allclose(np.linalg.det(turn), 1.0)
    np.testing.assert_allclose(
        np.einsum("nij,kj->nki", turn, SHANK) + shift[:, None], hinge(5)[1], atol=1e-12
    )
