"""Derivatives of a known motion, and the noise level read from the samples."""

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from bsip_cli.motion.splines import SkinNoise, noise_level, smooth

NOISE = 0.0005  # m
WINDOW_S = 0.5


def paced(times):
    """Slow sway, and a burst of 4 Hz for half a second: value, second derivative."""
    w1, w2, middle, width = 2 * np.pi * 0.4, 2 * np.pi * 4.0, 0.5 * times[-1], 0.25
    s = (times - middle) / width
    bell = np.exp(-0.5 * s**2)
    sine, cosine = np.sin(w2 * (times - middle)), np.cos(w2 * (times - middle))
    value = 0.2 * np.sin(w1 * times) + 0.05 * bell * sine
    first = 0.2 * w1 * np.cos(w1 * times) + 0.05 * bell * (w2 * cosine - s / width * sine)
    second = -0.2 * w1**2 * np.sin(w1 * times) + 0.05 * bell * (
        ((s**2 - 1) / width**2 - w2**2) * sine - 2 * s / width * w2 * cosine
    )
    return value, first, second


def butterworth_second(samples, rate_hz, cutoff_hz=10.0):
    sections = butter(2, cutoff_hz / 0.802, fs=rate_hz, output="sos")
    smoothed = sosfiltfilt(sections, samples, axis=0)
    return np.gradient(np.gradient(smoothed, 1 / rate_hz, axis=0), 1 / rate_hz, axis=0)


def slow(times, hz):
    """(N,) a sum of sines, and its second derivative."""
    omega = 2 * np.pi * np.array(hz)
    waves = 0.1 * np.sin(times[:, None] * omega)
    return waves.sum(axis=1), -(omega**2 * waves).sum(axis=1)


def rms(x):
    return float(np.sqrt(np.mean(np.square(x))))


@pytest.mark.parametrize("rate_hz", [50.0, 100.0, 250.0])
def test_noise_free_derivatives(rate_hz):
    times = np.arange(round(8 * rate_hz)) / rate_hz
    value, first, second = paced(times)
    found = smooth(value[:, None], rate_hz, WINDOW_S)
    inner = slice(round(0.3 * rate_hz), -round(0.3 * rate_hz))
    assert rms(found.value[inner, 0] - value[inner]) < 1e-5
    assert rms(found.first[inner, 0] - first[inner]) < 2e-3 * rms(first)
    assert rms(found.second[inner, 0] - second[inner]) < 1e-2 * rms(second)


@pytest.mark.parametrize("rate_hz", [100.0, 250.0])
@pytest.mark.parametrize("part", ["all", "slow"])
def test_acceleration_beats_a_10_hz_butterworth(rate_hz, part):
    times = np.arange(round(10 * rate_hz)) / rate_hz
    value, _, second = paced(times)
    rng = np.random.default_rng(1)
    samples = value[:, None] + rng.normal(0, NOISE, (len(times), 12))
    found = smooth(samples, rate_hz, WINDOW_S)
    inner = (times > 0.3) & (times < times[-1] - 0.3)
    if part == "slow":
        inner &= np.abs(times - 0.5 * times[-1]) > 1.2
    mine = rms((found.second - second[:, None])[inner])
    theirs = rms((butterworth_second(samples, rate_hz) - second[:, None])[inner])
    assert mine < (0.75 if part == "all" else 0.4) * theirs


@pytest.mark.parametrize("rate_hz", [50.0, 100.0, 250.0])
def test_the_noise_level_is_recovered(rate_hz):
    times = np.arange(round(20 * rate_hz)) / rate_hz
    value, _, _ = paced(times)
    size = NOISE * np.array([0.2, 1.0, 5.0])
    samples = value[:, None] + np.random.default_rng(2).normal(0, size, (len(times), 3))
    np.testing.assert_allclose(noise_level(samples, rate_hz), size, rtol=0.2)


@pytest.mark.parametrize("rate_hz", [100.0, 250.0])
def test_the_noise_level_survives_a_labs_low_pass_at_25_hz(rate_hz):
    """Noise of the raw markers, as if white: what the filter took above 20 Hz is not missed."""
    times = np.arange(round(20 * rate_hz)) / rate_hz
    value, _, _ = paced(times)
    samples = value[:, None] + np.random.default_rng(3).normal(0, NOISE, (len(times), 50))
    sections = butter(2, 25.0 / 0.802, fs=rate_hz, output="sos")
    filtered = sosfiltfilt(sections, samples, axis=0)
    assert rms(filtered - value[:, None]) < 0.9 * NOISE
    levels = noise_level(filtered, rate_hz)
    assert np.median(levels) == pytest.approx(NOISE, rel=0.2)
    assert levels.std() < 0.1 * NOISE


@pytest.mark.parametrize("rate_hz", [100.0, 250.0])
def test_the_stated_sd_is_the_true_error(rate_hz):
    """In slow phases: at the burst's edges the pace lags and the error is larger for a moment."""
    times = np.arange(round(20 * rate_hz)) / rate_hz
    value, second = slow(times, [0.5, 0.9, 1.3])
    rng = np.random.default_rng(5)
    samples = value[:, None] + rng.normal(0, NOISE, (len(times), 10))
    found = smooth(samples, rate_hz, WINDOW_S)
    inner = (times > 0.5) & (times < times[-1] - 0.5)
    ratio = rms(found.second_sd[inner]) / rms((found.second - second[:, None])[inner])
    assert 0.5 < ratio < 2


def test_sd_scales_with_each_channels_noise():
    times = np.arange(1000) / 100
    value, _, _ = paced(times)
    rng = np.random.default_rng(6)
    samples = value[:, None] + rng.normal(0, 1, (1000, 2)) * [1e-3, 1e-4]
    sd = smooth(samples, 100.0, WINDOW_S, np.array([1e-3, 1e-4])).second_sd
    np.testing.assert_allclose(sd[:, 0], 10 * sd[:, 1])


def test_the_ends_are_less_certain_than_the_middle():
    times = np.arange(1000) / 100
    samples = np.sin(2 * np.pi * 0.8 * times)[:, None]
    samples = samples + np.random.default_rng(7).normal(0, 1e-3, samples.shape)
    sd = smooth(samples, 100.0, WINDOW_S).second_sd[:, 0]
    assert sd[0] > 2 * np.median(sd)
    assert sd[-1] > 2 * np.median(sd)


def test_missing_rows_are_bridged():
    times = np.arange(1000) / 100
    value = 0.2 * np.sin(2 * np.pi * 0.8 * times)
    second = -((2 * np.pi * 0.8) ** 2) * value
    samples = value[:, None] + np.random.default_rng(8).normal(0, 2e-4, (1000, 2))
    whole = smooth(samples, 100.0, WINDOW_S)
    samples[400:420] = np.nan
    samples[500, 0] = np.nan  # one channel missing: the row does not count
    holed = smooth(samples, 100.0, WINDOW_S)
    for part in (holed.value, holed.first, holed.second, holed.second_sd):
        assert np.isfinite(part).all()
    assert np.abs(holed.value[400:420, 0] - value[400:420]).max() < 2e-3
    assert rms(holed.second[400:420, 0] - second[400:420]) < 0.2 * rms(second)
    assert holed.second_sd[410, 0] > 1.5 * whole.second_sd[410, 0]
    np.testing.assert_allclose(holed.value[700:], whole.value[700:], atol=5e-5)


def test_channels_are_smoothed_by_one_linear_operator():
    """Given the noise, and one stiffness for all: a sum of channels is smoothed as the sum."""
    rng = np.random.default_rng(9)
    times = np.arange(600) / 100
    a, b = np.sin(5 * times) + rng.normal(0, 1e-3, 600), np.cos(3 * times)
    found = smooth(np.stack([a, b, a + b], axis=1), 100.0, WINDOW_S, np.full(3, 1e-3))
    np.testing.assert_allclose(
        found.second[:, 0] + found.second[:, 1], found.second[:, 2], atol=1e-8
    )


def shaken(rng, times, corner_hz, white):
    """White noise, and noise of the same power at the corner that falls like 1 / f^4."""
    f = np.fft.rfftfreq(len(times), times[1] - times[0])
    f[0] = np.inf
    spectrum = np.fft.rfft(rng.normal(0, white, len(times))) * (corner_hz / f) ** 2
    return rng.normal(0, white, len(times)) + np.fft.irfft(spectrum, len(times))


@pytest.mark.parametrize("rate_hz", [100.0, 250.0])
def test_knowing_the_skins_noise_helps(rate_hz):
    """And the stated standard deviation of the acceleration is that of its error."""
    times = np.arange(round(20 * rate_hz)) / rate_hz
    value, second = slow(times, [0.4, 0.8, 1.1, 1.6])
    rng = np.random.default_rng(10)
    samples = np.stack([value + shaken(rng, times, 20.0, 1e-4) for _ in range(12)], axis=1)
    inner = (times > 1) & (times < times[-1] - 1)

    def found(skin):
        signal = smooth(samples, rate_hz, WINDOW_S, np.full(12, 1e-4), skin)
        return rms((signal.second - second[:, None])[inner]), rms(signal.second_sd[inner])

    blind, _ = found(None)
    error, stated = found(SkinNoise(corner_hz=20.0, from_hz=2.0))
    assert error < 0.75 * blind
    assert stated == pytest.approx(error, rel=0.25)


@pytest.mark.parametrize("rate_hz", [50.0, 100.0, 250.0])
@pytest.mark.parametrize("skin", [None, SkinNoise(corner_hz=9.0, from_hz=3.0)])
def test_the_gain_is_one_half_at_the_stated_cutoff(rate_hz, skin):
    """A small ripple at the cut-off goes through by half."""
    times = np.arange(round(16 * rate_hz)) / rate_hz
    rng = np.random.default_rng(11)
    swing = 0.1 * np.sin(2 * np.pi * 1.2 * times) + 0.01 * np.sin(2 * np.pi * 2.9 * times)
    samples = swing[:, None] + rng.normal(0, NOISE, (len(times), 20))
    sigma = np.full(20, NOISE)
    plain = smooth(samples, rate_hz, 4.0, sigma, skin)
    middle = slice(len(times) // 4, -len(times) // 4)
    cutoff = np.median(plain.cutoff_hz[middle])
    ripple = 1e-3 * NOISE * np.sin(2 * np.pi * cutoff * times)
    through = smooth(samples + ripple[:, None], rate_hz, 4.0, sigma, skin).value - plain.value
    gain = rms(through[middle]) / rms(ripple[middle])
    assert gain == pytest.approx(0.5, abs=0.04)


def test_the_skin_is_never_taken_to_swing_more_than_the_motion_below_a_frequency():
    times = np.arange(2000) / 100
    samples = 0.01 * np.sin(2 * np.pi * 1.0 * times)[:, None]
    samples = samples + np.random.default_rng(12).normal(0, 1e-4, samples.shape)
    skin = SkinNoise(corner_hz=1000.0, from_hz=4.0)
    found = smooth(samples, 100.0, WINDOW_S, np.array([1e-4]), skin)
    inner = slice(100, -100)
    kept = rms(found.value[inner]) / rms(samples[inner])
    assert kept > 0.98
    assert found.cutoff_hz.max() < 4.1


def test_a_burst_has_a_higher_cutoff():
    times = np.arange(1000) / 100
    value, _, _ = paced(times)
    samples = value[:, None] + np.random.default_rng(13).normal(0, NOISE, (1000, 8))
    cutoff = smooth(samples, 100.0, WINDOW_S).cutoff_hz
    assert cutoff.shape == (1000,)
    assert cutoff[500] > 2 * np.median(cutoff[:300])


@pytest.mark.parametrize(
    "samples", [np.zeros((11, 1)), np.column_stack([np.zeros(50), np.full(50, np.nan)])]
)
def test_too_few_samples(samples):
    with pytest.raises(ValueError, match="too few"):
        smooth(samples, 100.0, WINDOW_S)
