"""Linear answers of wrench and pose to small errors, against the exact ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin

from bsip_cli.dynamics.ground_wrench import pinocchio_model
from bsip_cli.effects.markers import during, step
from bsip_cli.effects.scene import without_fast
from bsip_cli.motion.inverse_kinematics import (
    PoseResponse,
    marker_trust,
    posed,
    solve_trial,
)
from tests.body.standing_person import away, markers_of, standing
from tests.effects.moving_scene import derivatives, moving, rms, scene_of

PERSON = standing().person


def response_at(q: np.ndarray, trust: np.ndarray | float = 1.0) -> PoseResponse:
    weights = np.tile(PERSON.marker_weights, (len(q), 1))
    return PoseResponse(PERSON, q, trust * weights)


def some_errors(k: int = 1) -> np.ndarray:
    """(N, nv, k) slow courses of all coordinates, 1 mm or 1 mrad."""
    times, rng = moving().times_s, np.random.default_rng(5)
    pace, phase = rng.uniform(0.5, 2.0, (2, len(PERSON.skeleton.v_names), k))
    return 1e-3 * np.sin(2 * np.pi * pace * times[:, None, None] + 7 * phase)


def test_the_wrench_of_a_slightly_other_motion():
    scene = scene_of(moving().q, *derivatives(moving().q))
    errors, model = some_errors()[..., 0], pinocchio_model(PERSON)
    moved = np.stack([pin.integrate(model, q, d) for q, d in zip(scene.q, errors, strict=True)])
    exact = scene_of(moved, *derivatives(moved)).predicted - scene.predicted
    linear = scene.response.of(errors[..., None])[..., 0]
    assert (rms(linear - exact) < 0.02 * rms(exact)).all()


def test_one_course_serves_every_onset():
    scene, errors = moving(), some_errors(2)
    course = step(scene.times_s, 2.5)
    at_once = scene.response.of(course[0][:, None, None] * errors)
    by_parts = during(course, scene.response.parts(errors))
    assert np.abs(by_parts - at_once).max() < 0.06 * np.abs(at_once).max()


def test_some_markers_are_all_markers_without_error():
    q, chosen = moving().q[::50], [3, 20]
    errors = np.zeros((len(q), len(PERSON.markers), 3, 2))
    errors[:, chosen] = 1e-3 * np.random.default_rng(6).normal(size=(len(q), 2, 3, 2))
    response = response_at(q)
    np.testing.assert_allclose(response.of(errors[:, chosen], chosen), response_at(q).of(errors))
    np.testing.assert_allclose(response.left(errors[:, chosen], chosen), response.left(errors))


def test_a_marker_beyond_the_limit_pulls_as_little_as_in_the_robust_fit():
    limit, m = 0.025, PERSON.markers.index("RKNEL")
    q = moving().q[::40]
    markers = markers_of(PERSON, q)
    markers[:, m] += [0.03, 0.05, 0.0]
    solved = solve_trial(
        PERSON,
        markers,
        marker_sd_m=0.005,
        robust_limit_m=limit,
        posture_sd_rad=5.0,
        iterations=60,
    ).q
    exact = np.stack([away(PERSON, a, b) for a, b in zip(q, solved, strict=True)])
    residual = posed(PERSON, solved).residuals(markers)
    trust = marker_trust(residual, limit)
    assert trust[:, m].mean() < 0.6
    errors = np.tile([0.03, 0.05, 0.0], (len(q), 1))[:, None, :, None]
    linear = response_at(solved, trust).of(errors, [m])[..., 0]
    trusting = response_at(solved).of(errors, [m])[..., 0]
    off = np.sqrt(((linear - exact) ** 2).mean())
    assert off < 0.15 * np.sqrt((exact**2).mean())
    assert np.sqrt(((trusting - exact) ** 2).mean()) > 4 * off


def test_a_missing_marker_pulls_nothing():
    scene = moving()
    residual = np.zeros((*scene.markers_m.shape,))
    residual[:, 7] = np.nan
    blind = replace(scene, residual_m=residual, robust_limit_m=0.025)
    errors = np.ones((len(scene.q), 1, 3, 1))
    assert not blind.pose_response.of(errors, [7]).any()
    assert np.isfinite(blind.markers_m).all()


def test_a_frame_without_markers_stays_where_it_is():
    q = moving().q[::100]
    trust = np.ones((len(q), len(PERSON.markers)))
    trust[2] = 0.0
    moved = response_at(q, trust).of(np.full((*trust.shape, 3, 1), 0.01))
    assert np.abs(moved[2]).max() == 0.0
    assert np.abs(moved[1]).max() > 0.005


# --- a trial at a lower rate shows what is slow as it is, and nothing of what is fast -------------


def swinging(frequency_hz: float) -> np.ndarray:
    times = moving().times_s
    return np.sin(2 * np.pi * frequency_hz * times)[:, None] * np.ones(6)


def test_what_is_slow_stays():
    slow = swinging(6.0)
    np.testing.assert_allclose(without_fast(slow, 2)[20:-20], slow[20:-20], atol=0.002)


def test_noise_does_not_turn_up_among_the_slow_changes():
    """Every second of 100 frames per second would show 44 Hz as 6 Hz."""
    fast = swinging(44.0)
    assert np.abs(without_fast(fast, 2)[20:-20]).max() < 0.002


def test_where_nothing_was_measured_nothing_is_made_up():
    wrench = swinging(6.0)
    wrench[100:120] = np.nan
    np.testing.assert_array_equal(np.isnan(without_fast(wrench, 2)), np.isnan(wrench))


def test_plates_and_their_sum_lose_the_same_frames():
    scene = moving()
    whole = scene_of(scene.q, scene.v, scene.a, wrench=scene.predicted).every(2)
    assert len(whole.times_s) == len(scene.times_s[::2])
    total = sum(plate.wrench for plate in whole.plates)
    np.testing.assert_allclose(whole.measured, total, atol=1e-6)
