"""What is wrong without any effect: skin that slides, and the spline's own bias."""

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from bsip_cli.diagnosis.skin import skin_draws
from bsip_cli.diagnosis.smoothing_bias import smoothing_bias
from bsip_cli.diagnosis.wander import WANDER_M, wander
from tests.effects.moving_scene import moving


def draws(rms_m, shared=0.0, count=20):
    scene = moving()
    size = np.full(len(scene.person.markers), rms_m)
    return skin_draws(scene, size, shared, count, np.random.default_rng(1))


def test_skin_moves_the_wrench_in_proportion():
    small, large = draws(0.002), draws(0.006)
    assert small.shape == (len(moving().times_s), 6, 20)
    np.testing.assert_allclose(large, 3 * small, rtol=1e-9, atol=1e-9)
    assert np.sqrt((small**2).mean(axis=(0, 2)))[:3].min() > 0.05  # [N]: skin does something


def test_skin_that_slides_as_a_whole_moves_the_wrench_more():
    """Errors of single markers cancel in part, shared ones do not."""
    single, both = draws(0.004), draws(0.004, shared=1.0)
    shared = np.sqrt((both**2).mean() - (single**2).mean())
    assert shared > 1.5 * np.sqrt((single**2).mean())


def test_a_body_that_wanders_moves_the_pressure_by_a_millimetre():
    scene = moving()
    columns = wander(scene)
    weight = scene.predicted[:, 2].mean()
    moment = np.sqrt((columns[:, 3:5] ** 2).sum(axis=2).mean(axis=0))
    np.testing.assert_allclose(moment / weight, WANDER_M, rtol=0.2)
    assert np.abs(columns[:, :3]).max() == 0.0


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
