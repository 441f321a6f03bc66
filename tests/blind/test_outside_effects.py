"""Effects outside the catalogue err as they say."""

from __future__ import annotations

import numpy as np
import pytest

from tests.blind.outside_effects import play
from tests.simulate.effect_trials import measured_with, trial_with


def test_a_tether_pulls_the_more_the_farther():
    trial = trial_with("squat", ("outside_elastic_tether", 200.0, ""))
    (band,) = trial.plan.loads
    pull = -band.wrench(trial.poses, 0.001)[0]
    length = np.linalg.norm(trial.poses.origin_m["lower_torso"] - band.fastened_m, axis=1)
    slope = np.polyfit(length, np.linalg.norm(pull, axis=1), 1)[0]
    assert slope == pytest.approx(200.0, rel=1e-6)
    assert trial.force_n[:, 0].mean() == pytest.approx(-pull[:, 0].mean(), abs=1.0)


def test_a_backlash_follows_at_half_its_width():
    t = np.linspace(0.0, 4.0 * np.pi, 2000)
    shown = play(10.0 * np.sin(t), 4.0)
    assert shown[500:].max() == pytest.approx(8.0, abs=1e-3)
    assert np.abs(shown - 10.0 * np.sin(t)).max() <= 2.0 + 1e-9


def test_repeated_frames_have_the_asked_share():
    stalled = measured_with("squat", ("outside_repeated_frames", 0.25, ""))
    still = np.all(np.diff(stalled.points_m, axis=0) == 0.0, axis=(1, 2))
    assert 0.2 < still.mean() < 0.35


def channel_of(name: str, size: float, column: int, target: str = "") -> tuple[np.ndarray, ...]:
    """A channel (N,) without and with an effect, and the times of its samples."""
    plain, other = measured_with("squat"), measured_with("squat", (name, size, target))
    rest = [c for c in range(6) if c != column]
    if name != "outside_clock_jump":
        np.testing.assert_allclose(plain.channels[:, rest], other.channels[:, rest], atol=1e-6)
    times = np.arange(len(plain.channels)) / plain.analog_hz
    return plain.channels[:, column], other.channels[:, column], times


def test_a_late_channel_is_the_channel_of_a_moment_ago():
    plain, late, times = channel_of("outside_late_channel", 0.02, 0, "fx")
    lag = round(0.02 / (times[1] - times[0]))
    np.testing.assert_allclose(late[lag:], plain[:-lag], atol=1e-6)


def test_a_loose_connector_changes_the_gain_of_the_vertical_channel():
    plain, other, _ = channel_of("outside_loose_connector", 0.03, 2)
    gain = other / plain - 1.0
    assert 0.005 < gain.std() < 0.06
    assert np.abs(np.diff(gain)).max() < 1e-3


def test_a_clock_that_jumps_is_right_before_and_late_after():
    plain, other, times = channel_of("outside_clock_jump", 0.05, 2)
    before, after = times < 0.3 * times[-1], times > 0.7 * times[-1]
    np.testing.assert_allclose(other[before], plain[before], atol=1e-6)
    lag = round(0.05 / (times[1] - times[0]))
    shifted = np.roll(plain, lag)
    np.testing.assert_allclose(other[after], shifted[after], atol=1e-6)
