"""What is wrong without any effect: a body that wanders, and the spline's own bias."""

import numpy as np
import pytest
from scipy.signal import butter, freqs, sosfiltfilt

from bsip_cli.diagnosis.error_terms import (
    SKIN_DAMPING,
    SKIN_HZ,
    WANDER_M,
    smoothing_bias,
    stays_behind,
    wander,
)
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


def test_tissue_stays_behind_as_what_hangs_on_a_spring_and_a_damper_does():
    """In size and in lateness, of a pace below its own."""
    rate_hz, own = 1000.0, 2 * np.pi * SKIN_HZ
    times_s = np.arange(0, 4, 1 / rate_hz)
    for hz in (1.0, 2.0):
        pace = 2 * np.pi * hz
        exact = freqs([-1.0], [1.0, 2 * SKIN_DAMPING * own, own**2], [pace])[1][0]
        course = stays_behind(np.cos(pace * times_s), rate_hz)[1:-1]
        expected = (exact * np.exp(1j * pace * times_s)).real[1:-1]
        np.testing.assert_allclose(course, expected, atol=0.03 * np.abs(expected).max())
