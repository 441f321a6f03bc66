"""The residual of one trial, made ready to ask: is there more in it than is known to be wrong?

Residual, nuisances and signatures pass the same low-pass and are divided by the noise of each
frame; an autoregression per component whitens them. What is known to be wrong without any effect
(inertial parameters within their covariance, skin that slides, the spline's own bias) is a random
effect of known covariance: with N its columns, the residual has covariance 1 + N N^T, and
``white`` turns residual and signatures by its inverse square root. In these coordinates a null is
white noise of variance 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy import sparse
from scipy.linalg import solve_toeplitz

from bsip_cli.dynamics.lowpass import lowpass_operator
from bsip_cli.dynamics.regressor import move_moments
from bsip_cli.identification.equations import ResidualSeries
from bsip_cli.identification.noise import noise_of

_OVERSAMPLING = 2.5
_ORDER = 4  # of the autoregression
_ROUNDS = 3
_CLIP = 4.0  # standard deviations: a contact's edge must not stand for a minute of movement


@dataclass(frozen=True)
class Filter:
    """One low-pass for everything: operator (n, N), frames (n,), spans of neighbouring samples."""

    operator: sparse.csr_array
    frames: np.ndarray
    spans: tuple[tuple[int, int], ...]
    reference_m: np.ndarray

    def __call__(self, wrench: np.ndarray) -> np.ndarray:
        """(n, 6, k) of world wrenches (N, 6, k) about the origin: moments about the reference."""
        columns = np.moveaxis(np.nan_to_num(wrench), 2, 0)
        moved = np.stack([move_moments(one, self.reference_m) for one in columns], axis=-1)
        flat = self.operator @ moved.reshape(len(moved), -1)
        return flat.reshape(len(self.frames), 6, -1)


def filter_of(
    valid: np.ndarray, rate_hz: float, cutoff_hz: float, reference_m: np.ndarray
) -> Filter:
    """Low-pass and decimation inside the valid stretches."""
    stride = max(1, int(rate_hz / (_OVERSAMPLING * cutoff_hz)))
    operator, frames = lowpass_operator(valid, rate_hz, cutoff_hz, stride)
    cuts = np.flatnonzero(np.diff(frames) != stride) + 1
    edges = [0, *cuts.tolist(), len(frames)]
    return Filter(operator, frames, tuple(pairwise(edges)), reference_m)


@dataclass(frozen=True)
class Evidence:
    """White residual (6 n,) of a null, and what turns signatures into the same coordinates."""

    residual: np.ndarray
    whitening: Whitening

    def white(self, signatures: np.ndarray) -> np.ndarray:
        """(6 n, k) of world wrenches (N, 6, k)."""
        return self.whitening.white(signatures)


@dataclass(frozen=True)
class Whitening:
    """spread (n, 6) of the noise, recursion (6, p) of its autoregression, and of the whitened
    nuisances N the left singular vectors (6 n, m) and by how much each is shrunk (m,)."""

    filter: Filter
    spread: np.ndarray
    recursion: np.ndarray
    left: np.ndarray
    shrink: np.ndarray

    def white(self, wrenches: np.ndarray) -> np.ndarray:
        """(6 n, k) of world wrenches (N, 6, k)."""
        filtered = self.filter(wrenches) / self.spread[..., None]
        columns = _innovations(filtered, self.recursion, self.filter)
        return columns - self.left @ (self.shrink[:, None] * (self.left.T @ columns))


def evidence_of(
    residual: np.ndarray, nuisances: np.ndarray, noise_level: np.ndarray, filter_: Filter
) -> Evidence:
    """From the residual wrench (N, 6), nuisance wrenches (N, 6, m) of unit prior variance, and the
    noise level (N,) of the accelerations."""
    whitening = _whitening(filter_(residual[..., None]), filter_(nuisances), noise_level, filter_)
    white = whitening.white(residual[..., None])[:, 0]
    return Evidence(np.clip(white, -_CLIP, _CLIP), whitening)


def _whitening(
    left_over: np.ndarray, nuisances: np.ndarray, noise_level: np.ndarray, filter_: Filter
) -> Whitening:
    """Noise of what the nuisances leave of the residual (n, 6, 1), and they in its coordinates."""
    level = noise_level[filter_.frames]
    recursion = np.zeros((6, _ORDER))
    spread = _course(left_over[..., 0], level)
    known = _innovations(nuisances / spread[..., None], recursion, filter_)
    for _ in range(_ROUNDS):
        flat = _innovations(left_over / spread[..., None], recursion, filter_)
        inner = known.T @ known + np.eye(known.shape[1])
        explained = nuisances @ np.linalg.solve(inner, known.T @ flat[:, 0])
        remaining = left_over[..., 0] - explained
        spread = _course(remaining, level)
        recursion = np.stack([_recursion(x, filter_.spans) for x in (remaining / spread).T])
        innovations = _innovations((remaining / spread)[..., None], recursion, filter_)
        spread = spread * innovations.reshape(-1, 6).std(axis=0)
        known = _innovations(nuisances / spread[..., None], recursion, filter_)
    left, sizes, _ = np.linalg.svd(known, full_matrices=False)
    return Whitening(filter_, spread, recursion, left, 1 - 1 / np.sqrt(1 + sizes**2))


def _course(residual: np.ndarray, level: np.ndarray) -> np.ndarray:
    """(n, 6) standard deviation of the residual at each sample."""
    noise = noise_of([ResidualSeries(residual, level)])
    return noise.rms / np.sqrt(noise.weights_at(level))


def _recursion(series: np.ndarray, spans: tuple[tuple[int, int], ...]) -> np.ndarray:
    """(_ORDER,) autoregression by Yule and Walker, within the spans."""
    lags = np.zeros(_ORDER + 1)
    for start, stop in spans:
        part = series[start:stop]
        for lag in range(min(_ORDER + 1, len(part))):
            lags[lag] += part[lag:] @ part[: len(part) - lag]
    lags[0] *= 1 + 1e-6
    return solve_toeplitz(lags[:-1], lags[1:])


def _innovations(columns: np.ndarray, recursion: np.ndarray, filter_: Filter) -> np.ndarray:
    """(6 n, k) innovations of (n, 6, k); a span's first samples stay as they are."""
    out = columns.copy()
    for start, stop in filter_.spans:
        for lag in range(1, _ORDER + 1):
            if stop - start > lag:
                earlier = columns[start : stop - lag]
                out[start + lag : stop] -= recursion[:, lag - 1, None] * earlier
    return out.reshape(-1, columns.shape[2])
