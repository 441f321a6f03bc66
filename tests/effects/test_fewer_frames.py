"""A trial at a lower rate shows what is slow as it is, and nothing of what is fast."""

import numpy as np

from bsip_cli.effects.scene import without_fast
from tests.effects.moving_scene import moving, scene_of


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
