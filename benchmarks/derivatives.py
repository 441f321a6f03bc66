"""Accelerations from noisy positions: spline of changing stiffness, Butterworth filters, GCV.

The true curve is slow movement (below 0.6 Hz) with a throw-like burst (1.5 to 5 Hz) in it. Both
amplitudes are set so that a Butterworth filter of 10 Hz, without noise, errs in the burst by
``--bias``: with it this bench's Butterworth figures come near those of the published bench that
the target comes from, whose amplitudes are not known.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_smoothing_spline
from scipy.signal import butter, filtfilt

from benchmarks.measure import machine, markdown
from bsip_cli.config import load_config
from bsip_cli.motion.splines import smooth

SLOW_HZ, BURST_HZ = (0.05, 0.6), (1.5, 5.0)
BURST_SD_S = 0.5 / 2.355  # the burst's envelope is 0.5 s wide at half its height
BURST_REACH = 3.0  # standard deviations that count as burst
EVERY_S = 6.4  # one burst in so many seconds: a fifth of the time
EDGE_S = 0.25  # the ends rest on one side only and are not judged
PACE_WINDOW_S = load_config([]).smoothing.pace_window_s

# m/s2 in all, burst and slow parts; noise in mm. The published bench.
PUBLISHED = {
    ("Butterworth 10 Hz", 0.2): (0.44, 0.94, 0.14),
    ("Butterworth 10 Hz", 0.5): (0.56, 1.00, 0.35),
    ("Butterworth 10 Hz", 1.0): (0.83, 1.19, 0.69),
    ("bsip", 0.2): (0.21, 0.45, 0.046),
    ("bsip", 0.5): (0.30, 0.58, 0.095),
    ("bsip", 1.0): (0.45, 0.84, 0.15),
}


@dataclass(frozen=True)
class Truth:
    """Curves (N, channels) [m], their accelerations [m/s2], and which frames are burst or slow."""

    value: np.ndarray
    second: np.ndarray
    burst: np.ndarray
    slow: np.ndarray


def truth(
    duration_s: float, rate_hz: float, channels: int, bursting: int, seed: int, bias: float
) -> Truth:
    """Slow curves, the first ``bursting`` of them with bursts at the same times."""
    t = np.arange(round(duration_s * rate_hz)) / rate_hz
    rng = np.random.default_rng(seed)
    centres = np.arange(EVERY_S / 2, duration_s, EVERY_S)
    near = (np.abs(t[:, None] - centres) < BURST_REACH * BURST_SD_S).any(axis=1)
    inside = (t > EDGE_S) & (t < duration_s - EDGE_S)
    value, second = np.zeros((2, len(t), channels))
    for k in range(channels):
        value[:, k], second[:, k] = _sines(t, SLOW_HZ, 0.15, rng)
        if k < bursting:
            curves = [_burst(t, centre, rng) for centre in centres]
            x, a = np.sum(curves, axis=0)
            error = (butterworth(10.0)(x[:, None], rate_hz)[:, 0] - a)[near & inside]
            size = bias / np.sqrt((error**2).mean())
            value[:, k] += size * x
            second[:, k] += size * a
    return Truth(value, second, near & inside, ~near & inside)


def _sines(t, band_hz, size_m, rng) -> tuple[np.ndarray, np.ndarray]:
    """Five sines with frequencies in a band; the curve and its second derivative."""
    omega = 2 * np.pi * rng.uniform(*band_hz, 5)
    phase, size = rng.uniform(0, 2 * np.pi, 5), size_m * rng.uniform(0.5, 1, 5) / 5
    x = size * np.sin(omega * t[:, None] + phase)
    return x.sum(axis=1), -(x * omega**2).sum(axis=1)


def _burst(t, centre_s, rng) -> tuple[np.ndarray, np.ndarray]:
    """Sines of 1.5 to 5 Hz under a Gaussian; the curve (unit size) and its second derivative."""
    s = (t - centre_s)[:, None]
    omega = 2 * np.pi * rng.uniform(*BURST_HZ, 4)
    phase = rng.uniform(0, 2 * np.pi, 4)
    size = rng.uniform(0.5, 1, 4) / omega**2  # each adds the same acceleration
    envelope = np.exp(-0.5 * (s / BURST_SD_S) ** 2)
    first = -s / BURST_SD_S**2 * envelope
    second = (s**2 / BURST_SD_S**4 - 1 / BURST_SD_S**2) * envelope
    sine, cosine = np.sin(omega * s + phase), omega * np.cos(omega * s + phase)
    a = second * sine + 2 * first * cosine - envelope * omega**2 * sine
    return (size * envelope * sine).sum(axis=1), (size * a).sum(axis=1)


# --- the contestants: positions (N, channels) and rate to accelerations ------------------------

Method = Callable[[np.ndarray, float], np.ndarray]


def butterworth(cutoff_hz: float) -> Method:
    """Second-order Butterworth of that nominal cut-off run both ways, and second differences.

    Without Winter's correction for the second pass, which the published figures show not to have
    been made either.
    """

    def accelerations(samples: np.ndarray, rate_hz: float) -> np.ndarray:
        return _differences(_filtered(samples, cutoff_hz, rate_hz), rate_hz)

    return accelerations


def residual_analysis(samples: np.ndarray, rate_hz: float) -> np.ndarray:
    """Each curve with the cut-off that Winter's residual analysis finds for it."""
    filtered = [
        _filtered(channel[:, None], winter_cutoff_hz(channel, rate_hz), rate_hz)
        for channel in samples.T
    ]
    return _differences(np.hstack(filtered), rate_hz)


def winter_cutoff_hz(channel: np.ndarray, rate_hz: float) -> float:
    """Where the residual falls to the noise that the line through its linear part shows."""
    cutoffs = np.arange(1.0, min(20.0, 0.3 * rate_hz) + 0.25, 0.25)
    residual = np.array(
        [
            np.sqrt(np.mean((channel[:, None] - _filtered(channel[:, None], f, rate_hz)) ** 2))
            for f in cutoffs
        ]
    )
    linear = cutoffs >= 0.6 * cutoffs[-1]
    noise = np.polyfit(cutoffs[linear], residual[linear], 1)[1]
    below = np.flatnonzero(residual <= noise)
    return float(cutoffs[below[0]] if len(below) else cutoffs[-1])


def generalised_cross_validation(samples: np.ndarray, rate_hz: float) -> np.ndarray:
    """Cubic smoothing spline of each curve, its penalty by GCV (scipy)."""
    t = np.arange(len(samples)) / rate_hz
    splines = [make_smoothing_spline(t, channel) for channel in samples.T]
    return np.stack([spline.derivative(2)(t) for spline in splines], axis=1)


def ours(samples: np.ndarray, rate_hz: float) -> np.ndarray:
    """bsip: all curves share one stiffness, which changes over time."""
    return smooth(samples, rate_hz, PACE_WINDOW_S).second


def ours_each(samples: np.ndarray, rate_hz: float) -> np.ndarray:
    """bsip's spline on each curve by itself."""
    columns = [ours(channel[:, None], rate_hz) for channel in samples.T]
    return np.hstack(columns)


def _filtered(samples: np.ndarray, cutoff_hz: float, rate_hz: float) -> np.ndarray:
    b, a = butter(2, min(cutoff_hz, 0.45 * rate_hz), fs=rate_hz)
    return filtfilt(b, a, samples, axis=0, padlen=min(len(samples) - 1, int(rate_hz)))


def _differences(values: np.ndarray, rate_hz: float) -> np.ndarray:
    inner = np.diff(values, 2, axis=0) * rate_hz**2
    return np.concatenate([inner[:1], inner, inner[-1:]])


# --- the bench ---------------------------------------------------------------------------------

SINGLE: dict[str, Method] = {
    "Butterworth 6 Hz": butterworth(6.0),
    "Butterworth 10 Hz": butterworth(10.0),
    "Winter's residual analysis": residual_analysis,
    "GCV cubic spline": generalised_cross_validation,
    "bsip": ours,
}
MANY: dict[str, Method] = {
    "Butterworth 6 Hz": butterworth(6.0),
    "Butterworth 10 Hz": butterworth(10.0),
    "bsip, a stiffness for each curve": ours_each,
    "bsip, one stiffness": ours,
}
Parts = tuple[float, float, float]


def errors(method: Method, true: Truth, noise_m: float, rate_hz: float, seed: int) -> np.ndarray:
    """(3, channels) mean square error [m2/s4] of the acceleration: all, burst, slow."""
    noise = np.random.default_rng(seed).normal(0, noise_m, true.value.shape)
    squares = (method(true.value + noise, rate_hz) - true.second) ** 2
    parts = (true.burst | true.slow, true.burst, true.slow)
    return np.stack([squares[part].mean(axis=0) for part in parts])


def bench(
    methods: dict[str, Method],
    rate_hz: float,
    noise_mm: float,
    options: argparse.Namespace,
    channels: int = 1,
    bursting: int = 1,
) -> dict[str, np.ndarray]:
    """Method to root-mean-square error (3, channels) over the trials."""
    sums = {name: np.zeros((3, channels)) for name in methods}
    for seed in range(options.trials):
        true = truth(options.duration, rate_hz, channels, bursting, seed, options.bias)
        for name, method in methods.items():
            sums[name] += errors(method, true, 1e-3 * noise_mm, rate_hz, 1000 + seed)
    return {name: np.sqrt(total / options.trials) for name, total in sums.items()}


def shown(parts: np.ndarray | Parts) -> list[str]:
    return [f"{value:.2g}" if value < 0.1 else f"{value:.2f}" for value in parts]


def single_table(options: argparse.Namespace) -> str:
    """One curve at a time, beside the published figures."""
    rows = []
    for rate in options.rates:
        for noise in options.noises:
            found = bench(SINGLE, rate, noise, options)
            for name, value in found.items():
                published = PUBLISHED.get((name, noise)) if rate == options.rates[0] else None
                beside = " / ".join(shown(published)) if published else ""
                rows.append([f"{rate:g}", f"{noise:g}", name, *shown(value[:, 0]), beside])
    header = ["rate [Hz]", "noise [mm]", "method", "all", "burst", "slow", "published"]
    return markdown(header, rows)


def many_table(options: argparse.Namespace) -> str:
    """Many curves of one movement, of which a few burst."""
    rows = []
    for noise in options.noises:
        found = bench(MANY, options.rates[0], noise, options, options.curves, options.bursting)
        for name, value in found.items():
            busy, quiet = value[:, : options.bursting], value[:, options.bursting :]
            means = [np.sqrt((part**2).mean()) for part in (value[0], busy[1], busy[2], quiet[0])]
            rows.append([f"{noise:g}", name, *shown(means)])
    header = ["noise [mm]", "method", "all", "bursting: burst", "bursting: slow", "quiet curves"]
    return markdown(header, rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--duration", type=float, default=12.8, help="of a trial [s]")
    parser.add_argument("--bias", type=float, default=0.93, help="see above [m/s2]")
    parser.add_argument("--rates", type=float, nargs="+", default=[100.0, 250.0], help="[Hz]")
    parser.add_argument("--noises", type=float, nargs="+", default=[0.2, 0.5, 1.0], help="[mm]")
    parser.add_argument("--curves", type=int, default=20)
    parser.add_argument("--bursting", type=int, default=5)
    options = parser.parse_args()
    print(f"machine: {machine()}; acceleration errors (RMS) [m/s2] over {options.trials} trials\n")
    print(single_table(options))
    print(f"\n{options.curves} curves, {options.bursting} of them burst, {options.rates[0]:g} Hz\n")
    print(many_table(options))


if __name__ == "__main__":
    main()
