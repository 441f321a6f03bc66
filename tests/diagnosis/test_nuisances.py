"""What is wrong without any effect: skin that slides, and the spline's own bias."""

import numpy as np
import pytest
from moving_scene import moving
from scipy.signal import butter, sosfiltfilt

from bsip_cli.diagnosis.skin import skin_draws
from bsip_cli.diagnosis.smoothing_bias import smoothing_bias


def draws(rms_m, count=20):
    scene = moving()
    size = np.full(len(scene.person.markers), rms_m)
    return skin_draws(scene, size, count, np.random.default_rng(1))


def test_skin_moves_the_wrench_in_proportion():
    small, large = draws(0.002), draws(0.006)
    assert small.shape == (len(moving().times_s), 6, 20)
    np.testing.assert_allclose(large, 3 * small, rtol=1e-9, atol=1e-9)
    assert np.sqrt((small**2).mean(axis=(0, 2)))[:3].min() > 0.05  # [N]: skin does something


def test_markers_that_stay_leave_the_wrench_alone():
    assert np.abs(draws(0.0)).max() == 0.0


def test_the_bias_tells_what_a_low_pass_takes():
    """All groups together, in a motion so small that pose and wrench are proportional."""
    scene = moving(6.0, 0.03)
    columns = smoothing_bias(scene)
    assert columns.shape == (len(scene.times_s), 6, 9)
    force = columns[:, 2, 3:6].sum(axis=1)  # vertical, cut at 6 Hz
    sections = butter(2, 6.0, fs=scene.rate_hz, output="sos")
    lost = scene.predicted[:, 2] - sosfiltfilt(sections, scene.predicted[:, 2])
    inner = slice(60, -60)
    assert np.corrcoef(force[inner], lost[inner])[0, 1] == pytest.approx(1.0, abs=0.2)
