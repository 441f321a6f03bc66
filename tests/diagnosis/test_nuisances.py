"""What is wrong without any effect: a body that drifts, the spline's own bias, plates in flight."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, freqs, sosfiltfilt

from bsip_cli.diagnosis.error_terms import (
    DRIFT_M,
    SKIN_HZ,
    as_simulated,
    drift,
    smoothing_bias,
    stays_behind,
)
from tests.effects.moving_scene import moving


def test_a_body_that_drifts_moves_the_pressure_by_a_millimetre():
    scene = moving()
    columns = drift(scene)
    weight = scene.predicted[:, 2].mean()
    moment = np.sqrt((columns[:, 3:5] ** 2).sum(axis=2).mean(axis=0))
    np.testing.assert_allclose(moment / weight, DRIFT_M, rtol=0.2)
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
    """In size and in lateness, of paces below its own and of any damping up to critical."""
    rate_hz, own = 1000.0, 2 * np.pi * SKIN_HZ
    times_s = np.arange(0, 2, 1 / rate_hz)
    turn, every = np.exp(2j * np.pi * times_s), slice(1, -1, 20)
    dampings = np.linspace(0, 1, 101)
    exact = [freqs([-1.0], [1.0, 2 * z * own, own**2], [2 * np.pi])[1][0] for z in dampings]
    courses = np.outer(exact, turn).real[:, every]
    told = stays_behind(turn.real, rate_hz)[every]
    expected = courses.T @ courses / len(courses)
    np.testing.assert_allclose(told @ told.T, expected, atol=0.05 * np.abs(expected).max())
    np.testing.assert_allclose(told[:, 0], courses[50], atol=0.05 * np.abs(courses).max())


def test_in_flight_no_plate_reads_more_than_is_simulated():
    """Where plates read noise around zero, their shares of the simulated load stay shares."""
    rng = np.random.default_rng(4)
    scene = moving(2.0)
    plate, whole = scene.plates[0], scene.measured
    stands = np.arange(len(scene.times_s)) % 2 == 0
    noise = rng.normal(size=(2, *whole.shape))
    half = 0.5 * whole * stands[:, None]
    plates = tuple(replace(plate, name=str(k), wrench=half + x) for k, x in enumerate(noise, 1))
    scene = replace(scene, plates=plates)
    off = np.abs(scene.predicted - scene.measured) + 1e-6
    found = as_simulated(scene).plates
    for before, after in zip(plates, found, strict=True):
        assert (np.abs(after.wrench - before.wrench) <= off).all()
    total = found[0].wrench + found[1].wrench
    np.testing.assert_allclose(total[stands], scene.predicted[stands], atol=1e-6)


def test_where_a_plate_has_no_reading_the_others_keep_theirs():
    scene = moving(2.0)
    plate = scene.plates[0]
    silent = replace(plate, name="2", wrench=np.full_like(plate.wrench, np.nan))
    first, second = as_simulated(replace(scene, plates=(plate, silent))).plates
    np.testing.assert_array_equal(first.wrench, plate.wrench)
    assert np.isnan(second.wrench).all()
