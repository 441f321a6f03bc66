"""The linear response of the fit against poses that are fitted again."""

from __future__ import annotations

import numpy as np
import pytest

from bsip_cli.motion.inverse_kinematics import posed, solve_poses
from bsip_cli.motion.marker_fit import marker_fit
from tests.body.standing_person import markers_of, random_poses
from tests.marker_evidence.swinging_markers import MARKERS, PERSON, SCALES, fitted


@pytest.mark.parametrize("label", ["RKNEL", "LASIS", "RELB", "LHAND", "T10"])
def test_residuals_follow_a_moved_marker_as_the_response_says(label):
    q = random_poses(PERSON, 1, 0.2, seed=3)
    markers, m = markers_of(PERSON, q), MARKERS.index(label)
    turn = posed(PERSON, q).turns()[0, m]
    move = np.array([0.001, -0.002, 0.001])
    moved = markers.copy()
    moved[0, m] += turn @ move
    options = {"posture_sd_rad": 3.0, "iterations": 50, **SCALES}
    before, after = (
        marker_fit(PERSON, x, solve_poses(PERSON, x, q[0], **options).q, np.zeros(1), **SCALES)
        for x in (markers, moved)
    )
    change = after.residual_m[0] - before.residual_m[0]
    assert np.abs(change - before.response[:, :, m] @ move).max() < 5e-5


def test_residuals_are_those_of_the_fit():
    q = random_poses(PERSON, 3, 0.2, seed=4)
    markers = markers_of(PERSON, q) + np.random.default_rng(4).normal(
        0, 0.003, (3, len(MARKERS), 3)
    )
    markers[1, 5] = np.nan
    poses = solve_poses(PERSON, markers, q[0], posture_sd_rad=3.0, iterations=50, **SCALES)
    fit = marker_fit(PERSON, markers, poses.q, np.arange(3) / 50, **SCALES)
    assert np.allclose(fit.distance_m(), poses.residual_m, atol=1e-9, equal_nan=True)


def test_the_source_of_a_field_is_named_with_its_size():
    fit = fitted(markers_of(PERSON, random_poses(PERSON, 2, 0.2, seed=5)), np.arange(2) / 50)
    m, move = MARKERS.index("RKNEL"), np.array([0.0, 0.010, 0.012])
    field = fit.response[:, :, m] @ move
    assert np.linalg.norm(field[m]) < 0.8 * np.linalg.norm(move)  # the pose takes its part
    everyone = list(range(len(MARKERS)))
    found, vector, _ = fit.source_of(field, np.full(len(MARKERS), 5e-4), everyone)
    assert found == m
    assert np.linalg.norm(vector - move) < 0.002
