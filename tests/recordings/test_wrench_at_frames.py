"""The wrench at marker times: constants, slow signals, aliases, ratios, unusable samples."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bsip_cli.recordings.model import Plate, Recording
from bsip_cli.recordings.plate_wrench import sample_at_frames, silent_frames, wrench_at_marker_rate

FRAMES = 200
RATES = [(1000.0, 100.0), (2000.0, 120.0), (1000.0, 100.5), (100.0, 100.0), (240.0, 200.0)]


def _signal(rate_hz: float, f_hz: float, n: int) -> np.ndarray:
    return np.sin(2 * np.pi * f_hz * np.arange(n) / rate_hz)[:, None]


@pytest.mark.parametrize(("rate", "frame_rate"), RATES)
def test_constant_passes_exactly_also_at_the_ends(rate, frame_rate):
    n = int(FRAMES * rate / frame_rate)
    values, usable = sample_at_frames(
        np.full((n, 2), 7.5), np.ones(n, bool), rate, frame_rate, FRAMES
    )
    np.testing.assert_allclose(values[usable], 7.5, rtol=1e-12)
    assert usable.all()


@pytest.mark.parametrize(("rate", "frame_rate"), RATES)
def test_slow_signal_has_no_delay(rate, frame_rate):
    n = int(FRAMES * rate / frame_rate)
    values, _ = sample_at_frames(_signal(rate, 5.0, n), np.ones(n, bool), rate, frame_rate, FRAMES)
    expected = np.sin(2 * np.pi * 5.0 * np.arange(FRAMES) / frame_rate)
    np.testing.assert_allclose(values[15:-15, 0], expected[15:-15], atol=0.003)


@pytest.mark.parametrize(("rate", "frame_rate"), RATES)
def test_frames_in_which_software_wrote_zeros(rate, frame_rate):
    n = int(FRAMES * rate / frame_rate)
    signal = np.full((n, 6), 300.0)
    signal[: n // 2] = 0.0
    values, _ = sample_at_frames(signal, np.ones(n, bool), rate, frame_rate, FRAMES)
    silent = silent_frames(values, resampled=rate != frame_rate)
    assert abs(silent.sum() - FRAMES / 2) <= 1 and silent[: FRAMES // 2 - 1].all()


def test_what_would_alias_is_gone():
    values, _ = sample_at_frames(_signal(1000, 93.0, 2000), np.ones(2000, bool), 1000, 100, FRAMES)
    assert np.abs(values[15:-15]).max() < 0.005


def test_slower_forces_are_interpolated():
    n = FRAMES // 2
    values, _ = sample_at_frames(_signal(50, 3.0, n), np.ones(n, bool), 50, 100, FRAMES)
    expected = np.sin(2 * np.pi * 3.0 * np.arange(FRAMES) / 100)
    np.testing.assert_allclose(values[30:-30, 0], expected[30:-30], atol=0.01)


def test_unusable_samples_mark_frames_and_do_not_leak():
    signal, usable = np.full((2000, 1), 3.0), np.ones(2000, bool)
    signal[1000:1100], usable[1000:1100] = np.nan, False
    values, good = sample_at_frames(signal, usable, 1000, 100, FRAMES)
    assert np.isfinite(values).all()
    assert not good[100:110].any()
    assert good[:90].all() and good[120:].all()
    np.testing.assert_allclose(values[good], 3.0, rtol=1e-12)


def test_plates_are_summed():
    n = 1000
    plates = tuple(
        Plate(str(i), np.full((n, 3), i), np.full((n, 3), -i), None, np.ones(n, bool))
        for i in (1.0, 2.0)
    )
    markers = np.zeros((100, 1, 3))
    recording = Recording(Path("a"), 100.0, ("A",), markers, 1000.0, plates, (), np.eye(3), "", 0.5)
    wrench = wrench_at_marker_rate(recording)
    np.testing.assert_allclose(wrench.total, np.tile([3.0] * 3 + [-3.0] * 3, (100, 1)))
    assert wrench.usable.all()
