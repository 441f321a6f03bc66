"""One low-pass for everything that a trial's forces are compared in; and what makes it white."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy import sparse
from scipy.linalg import solve_toeplitz
from scipy.ndimage import median_filter

from bsip_cli.dynamics.lowpass import lowpass_operator, stride_to
from bsip_cli.effects.scene import Scene, place_of_stance_m

ENOUGH_HZ = 50.0
_OVERSAMPLING = 2.5
_ORDER = 4  # of the autoregression
_SMOOTH_HZ = 0.75  # half-width of the median over the spectrum
_FLOOR = 1e-6  # of the noise's power, taken for white
_IN_CACHE = 2**17  # bytes


@dataclass(frozen=True, eq=False)
class Filter:
    """One low-pass for everything: operator (n, N), frames (n,), spans of neighbouring samples."""

    operator: sparse.csr_array
    frames: np.ndarray
    spans: tuple[tuple[int, int], ...]
    reference_m: np.ndarray
    rate_hz: float

    def __call__(self, wrench: np.ndarray) -> np.ndarray:
        """(n, 6, k) of world wrenches (N, 6, k) about the origin: moments about the reference."""
        flat = self.operator @ wrench.reshape(len(wrench), -1)
        filtered = flat.reshape(len(self.frames), 6, -1)
        filtered[:, 3:] -= np.cross(self.reference_m, filtered[:, :3], axisb=1, axisc=1)
        return filtered

    def one(self, wrench: np.ndarray) -> np.ndarray:
        """(n, 6) of one world wrench (N, 6)."""
        return self(wrench[..., None])[..., 0]


def filter_of(scene: Scene, cutoff_hz: float) -> Filter:
    """Low-pass and decimation inside the valid intervals, moments about where the person stands."""
    stride = stride_to(scene.rate_hz, _OVERSAMPLING * cutoff_hz)
    operator, frames = lowpass_operator(scene.valid, scene.rate_hz, cutoff_hz, stride)
    cuts = np.flatnonzero(np.diff(frames) != stride) + 1
    spans = tuple(pairwise([0, *cuts.tolist(), len(frames)]))
    return Filter(operator, frames, spans, place_of_stance_m(scene), scene.rate_hz / stride)


def at_full_rate(filter_: Filter, scene: Scene, cutoff_hz: float) -> Filter:
    """The filter of a slower trial for signals of the whole one, with the same samples."""
    operator, frames = lowpass_operator(scene.valid, scene.rate_hz, cutoff_hz)
    stride = round(scene.rate_hz / slow(scene).rate_hz)
    return replace(filter_, operator=operator[np.searchsorted(frames, filter_.frames * stride)])


def slow(scene: Scene) -> Scene:
    """The trial at the rate at which nuisances and signatures, smooth as they are, are computed."""
    stride = stride_to(scene.rate_hz, ENOUGH_HZ)
    return scene.once("slow", lambda: scene.every(stride), of_readings=True)


@dataclass(frozen=True, eq=False)
class Noise:
    """What may be left of a trial: an autoregression of innovations of size (6,) and recursion
    (6, p)."""

    filter: Filter
    size: np.ndarray
    recursion: np.ndarray

    def white(self, columns: np.ndarray) -> np.ndarray:
        """(6 n, k) of filtered columns (n, 6, k), less what the recursion makes of what was before;
        a span's first samples stay as they are."""
        columns = columns / self.size[:, None]
        out = columns.copy()
        rows = max(1, _IN_CACHE // max(columns[0].nbytes, 1))
        for start, stop in self.filter.spans:
            for first in range(start, stop, rows):  # as many as stay near the processor
                last = min(first + rows, stop)
                for lag in range(1, min(_ORDER, last - start - 1) + 1):
                    begin = max(first, start + lag)
                    earlier = columns[begin - lag : last - lag]
                    out[begin:last] -= self.recursion[:, lag - 1, None] * earlier
        return out.reshape(-1, columns.shape[2])

    def white_one(self, wrench: np.ndarray) -> np.ndarray:
        """(6 n,) of one filtered wrench (n, 6)."""
        return self.white(wrench[..., None])[:, 0]


def noise_like(filter_: Filter, signal: np.ndarray, least: np.ndarray) -> Noise:
    """Of a signal (n, 6) that may be left of a trial; it is never quieter than ``least`` (6,)."""
    spread = np.maximum(signal.std(axis=0), least)
    share = least / spread
    pairs = zip((signal / spread).T, np.maximum(_FLOOR, share**2), strict=True)
    recursion = np.stack([_recursion_of(x, filter_.rate_hz, floor) for x, floor in pairs])
    white = Noise(filter_, spread, recursion).white_one(signal).reshape(-1, 6)
    return Noise(filter_, spread * np.maximum(white.std(axis=0), share), recursion)


def _recursion_of(series: np.ndarray, rate_hz: float, floor: float) -> np.ndarray:
    """(_ORDER,) autoregression by Yule and Walker, of the smooth part of the spectrum.

    A running median over frequencies leaves out lines: an offset or a swing at one frequency is no
    noise, and must not be whitened away.
    """
    power = np.abs(np.fft.rfft(series, 2 * len(series))) ** 2
    width = 2 * max(1, round(_SMOOTH_HZ * len(series) / rate_hz)) + 1
    lags = np.fft.irfft(median_filter(power, size=width, mode="reflect"))[: _ORDER + 1]
    lags[0] *= 1 + floor
    return solve_toeplitz(lags[:-1], lags[1:])
