"""Joints from movement: of two bodies that turn about a line or a point, and of legs in gait."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bsip_cli.body.markersets import load_marker_set
from bsip_cli.body.person import rigid_motion
from bsip_cli.body.skeleton import load_skeleton
from bsip_cli.errors import BadDataError
from bsip_cli.motion.calibration import (
    FunctionalJoint,
    calibrate,
    functional_joint,
    functional_landmarks,
)
from bsip_cli.recordings.labels import match_labels
from bsip_cli.recordings.read import read_recording
from tests.body.standing_person import HEIGHT_M, standing_markers

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


DATA = Path(__file__).parents[2].parent / "shared" / "data"
LANDMARKS_OF_JOINTS = ("knee_lateral", "knee_medial", "malleolus_lateral", "malleolus_medial")
NAMED = {f"{name}_{side}" for name in LANDMARKS_OF_JOINTS for side in "lr"}


def found_in(file: str, marker_set_name: str, frame: int) -> tuple[Mapping, tuple, Mapping]:
    """What movement shows in a recording, in one of its frames; how; where all landmarks are."""
    recording, marker_set = read_recording(DATA / file), load_marker_set(marker_set_name)
    match = match_labels(recording.labels, marker_set.wanted())
    trial = {label: recording.markers_m[:, k] for label, k in match.index.items()}
    still = {label: track[frame] for label, track in trial.items()}
    known = {m.landmark: still[m.label] for m in marker_set.markers if m.label in still}
    without = {name: place for name, place in known.items() if name not in NAMED}
    return *functional_landmarks(marker_set, without, still, [trial], "M"), known


@pytest.mark.real
@pytest.mark.skipif(not DATA.is_dir(), reason="the real recordings (../shared/data) are missing")
def test_gait_shows_the_joints_that_markers_show():
    found, notes, known = found_in("ezc3d_rehazenter_qualisys/Qualisys.c3d", "van_sint_jan", 100)
    assert set(found) == NAMED
    for side in "lr":
        for joint in ("knee", "malleolus"):
            names = [f"{joint}_{part}_{side}" for part in ("lateral", "medial")]
            own = np.mean([found[name] for name in names], axis=0)
            marked = np.mean([known[name] for name in names], axis=0)
            assert np.linalg.norm(own - marked) < 0.025, (joint, side)
        lateral = found[f"knee_lateral_{side}"] - found[f"knee_medial_{side}"]
        marked = known[f"knee_lateral_{side}"] - known[f"knee_medial_{side}"]
        cosine = lateral @ marked / np.linalg.norm(lateral) / np.linalg.norm(marked)
        assert np.rad2deg(np.arccos(cosine)) < 15
    assert any("the left knee has no marker: centre from its movement" in n for n in notes)


def test_markers_go_before_movement():
    still = standing_markers()
    marker_set = load_marker_set("hansen2017")
    known = {m.landmark: still[m.label] for m in marker_set.markers if m.landmark}
    assert functional_landmarks(marker_set, known, still, [], "M") == ({}, ())


def test_without_clusters_or_movement_the_landmarks_stay_missing():
    still = {k: v for k, v in standing_markers().items() if k[1:4] not in ("KNE", "MAL")}
    trials = [{label: np.tile(place, (50, 1)) for label, place in still.items()}]
    skeleton, marker_set = load_skeleton("hansen2017"), load_marker_set("hansen2017")
    with pytest.raises(BadDataError, match="knee_lateral_l, knee_lateral_r, malleolus_lateral_l"):
        calibrate(skeleton, marker_set, still, "M", HEIGHT_M, trials)
