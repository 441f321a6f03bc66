"""The residual of one trial, made ready to ask: is there more in it than is known to be wrong?

Residual, nuisances and signatures pass the same low-pass and are divided by the noise of each
frame; an autoregression per component whitens them. What is known to be wrong without any effect
(inertial parameters within their covariance, skin that slides, the spline's own bias) is a random
effect of known covariance: with N its columns, the residual has covariance 1 + N N^T, and
``white`` turns residual and signatures by its inverse square root. In these coordinates a null is
white noise of variance 1.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy import sparse
from scipy.linalg import eigh, solve_toeplitz
from scipy.ndimage import median_filter

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.dynamics.lowpass import lowpass_operator, stride_to
from bsip_cli.effects.scene import Scene, standing_place_m
from bsip_cli.identification.equations import ResidualSeries
from bsip_cli.identification.noise import noise_of

ENOUGH_HZ = 50.0
_OVERSAMPLING = 2.5
_ORDER = 4  # of the autoregression
_SMOOTH_HZ = 0.75  # half-width of the median over the spectrum
_ROUNDS = 3
FLOOR = 1e-6  # of the noise's power, taken for white
_MATTERS = 1e-3  # by which a direction is shrunk, at least
# Noise that no lab goes below: parts of body weight, and arms of it (half a millimetre) [m].
LEAST = np.array([0.0003, 0.0003, 0.0005, 0.0005, 0.0005, 0.0001])


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
    """Low-pass and decimation inside the valid stretches, moments about where the person stands."""
    stride = stride_to(scene.rate_hz, _OVERSAMPLING * cutoff_hz)
    operator, frames = lowpass_operator(scene.valid, scene.rate_hz, cutoff_hz, stride)
    cuts = np.flatnonzero(np.diff(frames) != stride) + 1
    edges = [0, *cuts.tolist(), len(frames)]
    place, rate_hz = standing_place_m(scene), scene.rate_hz / stride
    return Filter(operator, frames, tuple(pairwise(edges)), place, rate_hz)


@dataclass(frozen=True, eq=False)
class Whitening:
    """spread (n, 6) of the noise, recursion (6, p) of its autoregression, and of the whitened
    nuisances N the left singular vectors (6 n, m) that matter and by how much each is shrunk (m,).
    """

    filter: Filter
    spread: np.ndarray
    recursion: np.ndarray
    left: np.ndarray
    shrink: np.ndarray

    def white(self, wrenches: np.ndarray) -> np.ndarray:
        """(6 n, k) of world wrenches (N, 6, k)."""
        return self.of_filtered(self.filter(wrenches))

    def of_filtered(self, wrenches: np.ndarray) -> np.ndarray:
        """(6 n, k) of wrenches (n, 6, k) that have passed the filter."""
        columns, kind = self.innovations(wrenches), wrenches.dtype
        left, shrink = (x.astype(kind, copy=False) for x in (self.left, self.shrink))
        return columns - left @ (shrink[:, None] * (left.T @ columns))

    def transposed(self, rows: np.ndarray) -> np.ndarray:
        """(n, 6, k) whose products with filtered wrenches are those of rows (6 n, k) with the
        white ones."""
        kept = rows - self.left @ (self.shrink[:, None] * (self.left.T @ rows))
        return _innovations_transposed(kept, self.recursion, self.filter) / self.spread[..., None]

    def innovations(self, wrenches: np.ndarray) -> np.ndarray:
        """(6 n, k) of filtered wrenches (n, 6, k): the noise alone is white, nuisances stay."""
        kind = wrenches.dtype
        spread, recursion = self.spread[..., None].astype(kind), self.recursion.astype(kind)
        return innovations(wrenches / spread, recursion, self.filter)


@dataclass(frozen=True, eq=False)
class Filtered:
    """What has passed the filter: residual (n, 6), the trial's own nuisances (n, 6, m) and those it
    shares (n, 6, p), noise level of the accelerations (n,); noise that is always there (6,); how
    many standard deviations of a stated mass the shared ones make the body heavier (p,), and that
    standard deviation as part of it; zeros where none is stated."""

    filter: Filter
    residual: np.ndarray
    own: np.ndarray
    shared: np.ndarray
    level: np.ndarray
    least: np.ndarray
    heavier: np.ndarray
    mass_sd: float


@dataclass(frozen=True, eq=False)
class TrialEvidence:
    """One trial in coordinates in which its own nuisances and its noise are white.

    residual (6 n,) : measured wrench less that of the parameters before the data.
    shared (6 n, p) : what the parameters' own uncertainty, of unit variance, does to it.
    """

    name: str
    scene: Scene
    filtered: Filtered
    whitening: Whitening
    residual: np.ndarray
    shared: np.ndarray

    def with_noise_beside(self, change: np.ndarray, floor: float = FLOOR) -> TrialEvidence:
        """The same trial; its noise is what remains beside a known, filtered change (n, 6).

        floor : part of the noise's power that is white whatever the residual says.
        """
        return _evidence(self.name, self.scene, self.filtered, change, floor)

    def white(self, wrenches: np.ndarray) -> np.ndarray:
        """(6 n, k) of world wrenches (N, 6, k)."""
        return self.whitening.white(wrenches)

    def rows_s(self) -> np.ndarray:
        """(6 n,) time of every row of the white vectors [s]."""
        return np.repeat(self.scene.times_s[self.whitening.filter.frames], 6)


def slow(scene: Scene) -> Scene:
    """The trial at the rate at which nuisances and signatures, smooth as they are, are computed."""
    return scene.once("slow", lambda: scene.every(stride_to(scene.rate_hz, ENOUGH_HZ)))


def trial_evidence(
    name: str,
    scene: Scene,
    own: np.ndarray,
    shared: np.ndarray,
    noise_level: np.ndarray,
    cutoff_hz: float,
    heavier: np.ndarray | None = None,
    mass_sd: float = 0.0,
) -> TrialEvidence:
    """Evidence of a trial in full, with nuisances of unit variance of the ``slow`` one.

    own (N', 6, m), shared (N', 6, p) : nuisances that are the trial's own, and those that it
    shares with other trials. noise_level (N,) : of the accelerations. heavier (p,), mass_sd :
    as of :class:`Filtered`; nothing where no mass is stated.
    """
    heavier = np.zeros(shared.shape[2]) if heavier is None else heavier
    fewer = slow(scene)
    stride = round(scene.rate_hz / fewer.rate_hz)
    filter_ = filter_of(fewer, cutoff_hz)
    full = at_full_rate(filter_, scene, cutoff_hz)
    residual = full.one(scene.measured - scene.predicted)
    level = noise_level[::stride][filter_.frames]
    least = LEAST * scene.mass_kg * GRAVITY_M_S2
    filtered = Filtered(
        filter_, residual, filter_(own), filter_(shared), level, least, heavier, mass_sd
    )
    return _evidence(name, fewer, filtered, np.zeros_like(residual))


def _evidence(
    name: str, scene: Scene, filtered: Filtered, beside: np.ndarray, floor: float = FLOOR
) -> TrialEvidence:
    whitening = _whitening(filtered, beside, floor)
    white = whitening.of_filtered(filtered.residual[..., None])[:, 0]
    shared = whitening.of_filtered(filtered.shared)
    return TrialEvidence(name, scene, filtered, whitening, white, shared)


def at_full_rate(filter_: Filter, scene: Scene, cutoff_hz: float) -> Filter:
    """The filter of a slower trial for courses of the whole one, with the same samples."""
    operator, frames = lowpass_operator(scene.valid, scene.rate_hz, cutoff_hz)
    stride = round(scene.rate_hz / slow(scene).rate_hz)
    return replace(filter_, operator=operator[np.searchsorted(frames, filter_.frames * stride)])


def _whitening(filtered: Filtered, beside: np.ndarray, floor: float) -> Whitening:
    """Noise of what a known change (n, 6) and all nuisances leave of the residual, and the own
    nuisances in the coordinates of that noise.

    Nuisances take up a part of the noise too: only ``kept`` of its power is seen beside them.
    """
    filter_, level = filtered.filter, filtered.level
    nuisances = np.concatenate([filtered.own, filtered.shared], axis=2)
    left_over = filtered.residual - beside
    recursion = np.zeros((6, _ORDER))
    spread = _course(left_over, level)
    known = innovations(nuisances / spread[..., None], recursion, filter_)
    for _ in range(_ROUNDS):
        flat = innovations((left_over / spread)[..., None], recursion, filter_)
        inner = known.T @ known + np.eye(known.shape[1])
        sizes = np.linalg.solve(inner, np.column_stack([known.T @ flat, known.T]))
        remaining = left_over - nuisances @ sizes[:, 0]
        kept = 1 - (known * sizes[:, 1:].T).sum(axis=1).reshape(-1, 6).mean(axis=0)
        spread = _course(remaining, level)
        series = (remaining / spread).T
        recursion = np.stack([recursion_of(x, filter_.rate_hz, floor) for x in series])
        white = innovations((remaining / spread)[..., None], recursion, filter_)
        size = white.reshape(-1, 6).std(axis=0) / np.sqrt(kept)
        spread = spread * size * np.maximum(1.0, filtered.least / remaining.std(axis=0))
        known = innovations(nuisances / spread[..., None], recursion, filter_)
    return Whitening(filter_, spread, recursion, *shrunk(known[:, : filtered.own.shape[2]]))


def shrunk(columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of columns A (R, m) the left singular vectors (R, p) that (1 + A A^T)^-1/2 shrinks, and by
    how much (p,).

    By the small matrix A^T A: what its rounding spoils is hardly shrunk, and left out.
    """
    squares, right = eigh(columns.T @ columns)
    shrink = 1 - 1 / np.sqrt(1 + np.maximum(squares, 0.0))
    matter = shrink > _MATTERS
    return columns @ right[:, matter] / np.sqrt(squares[matter]), shrink[matter]


def _course(residual: np.ndarray, level: np.ndarray) -> np.ndarray:
    """(n, 6) standard deviation of the residual at each sample."""
    noise = noise_of([ResidualSeries(residual, level)])
    return noise.rms / np.sqrt(noise.weights_at(level))


def recursion_of(series: np.ndarray, rate_hz: float, floor: float) -> np.ndarray:
    """(_ORDER,) autoregression by Yule and Walker, of the smooth part of the spectrum.

    A running median over frequencies leaves out lines: an offset or a swing at one frequency is no
    noise, and must not be whitened away.
    """
    power = np.abs(np.fft.rfft(series, 2 * len(series))) ** 2
    width = 2 * max(1, round(_SMOOTH_HZ * len(series) / rate_hz)) + 1
    smooth = median_filter(power, size=width, mode="reflect")
    lags = np.fft.irfft(smooth)[: _ORDER + 1]
    lags[0] *= 1 + floor
    return solve_toeplitz(lags[:-1], lags[1:])


def innovations(columns: np.ndarray, recursion: np.ndarray, filter_: Filter) -> np.ndarray:
    """(6 n, k) innovations of (n, 6, k); a span's first samples stay as they are."""
    out = columns.copy()
    for start, stop in filter_.spans:
        for lag in range(1, _ORDER + 1):
            if stop - start > lag:
                earlier = columns[start : stop - lag]
                out[start + lag : stop] -= recursion[:, lag - 1, None] * earlier
    return out.reshape(-1, columns.shape[2])


def _innovations_transposed(rows: np.ndarray, recursion: np.ndarray, filter_: Filter) -> np.ndarray:
    """(n, 6, k) of (6 n, k): the same linear map, transposed."""
    later = rows.reshape(len(rows) // 6, 6, rows.shape[1])
    out = later.copy()
    for start, stop in filter_.spans:
        for lag in range(1, _ORDER + 1):
            if stop - start > lag:
                out[start : stop - lag] -= recursion[:, lag - 1, None] * later[start + lag : stop]
    return out
