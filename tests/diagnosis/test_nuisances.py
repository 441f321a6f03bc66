"""What is wrong without any effect: a body that wanders, and the spline's own bias."""

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from bsip_cli.diagnosis.error_terms import WANDER_M, smoothing_bias, wander
from tests.effects.moving_scene import moving


def test_a_body_that_wanders_moves_the_pressure_by_a_millimetre():
    scene = moving()
    columns = wander(scene)
    weight = scene.predicted[:, 2].mean()
    moment = np.sqrt((columns[:, 3:5] ** 2).sum(axis=2).mean(axis=0))
    np.testing.assert_allclose(moment / weight, WANDER_M, rtol=0.2)
    assert np.abs(columns[:, :3]).max() == 0.0


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
