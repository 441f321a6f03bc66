"""Penalised splines whose stiffness follows the local pace of the motion.

The signal is a quintic B-spline; the fourth differences of its coefficients get the prior
variance ``tau^2(t)``, the samples the noise variance ``sigma^2`` (P-splines: Eilers and Marx
1996). Both come from the data: sigma from the power above human movement, tau
by evidence maximisation (MacKay 1992) over a window that moves along. Derivatives are those of
the spline.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit
from scipy import sparse
from scipy.interpolate import BSpline
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.ndimage import uniform_filter1d
from scipy.signal import spectrogram
from scipy.stats import chi2

_DEGREE = 5
_KNOT_RATE_HZ = 100.0  # at most; human motion ends far below
_FOURTH = np.array([1.0, -4.0, 6.0, -4.0, 1.0])
_NOISE_ORDER, _NOISE_BAND_HZ, _NOISE_WINDOW_S = 3, (12.0, 20.0), 0.64
_ROUNDS = 20
_FEWEST = 12
# sigma^2 / tau^2: where the evidence begins, and its limits (a cut-off of 28 Hz and of 1.2 Hz).
# Stiffer equations would lose the digits of the samples (weight 1) and of the bridges.
_FIRST_STIFFNESS, _STIFFNESS_RANGE = 1e1, (1e-2, 1e9)
_BRIDGE_WEIGHT = 1e-4  # of a missing sample, against 1: keeps long gaps solvable


@dataclass(frozen=True)
class SmoothSignal:
    """A smoothed signal and its derivatives at the samples, each (N, channels).

    ``second_sd`` is the standard deviation of the second derivative.
    """

    value: np.ndarray
    first: np.ndarray
    second: np.ndarray
    second_sd: np.ndarray


def smooth(
    samples: np.ndarray, rate_hz: float, window_s: float, noise_sd: np.ndarray | None = None
) -> SmoothSignal:
    """Smooth all channels by one stiffness that changes over time.

    Parameters
    ----------
    samples : (N, channels); NaN where missing, which is bridged, each channel on its own.
    window_s : time over which the pace of the motion is judged.
    noise_sd : (channels,) noise of the samples, estimated from them where not given.

    Raises
    ------
    ValueError
        There are fewer than 12 samples, or a channel has none.
    """
    count = len(samples)
    if count < _FEWEST or not np.isfinite(samples).any(axis=0).all():
        raise ValueError("too few samples for a spline")
    sigma = noise_level(samples, rate_hz) if noise_sd is None else noise_sd
    basis = _Basis(count, max(1, round(rate_hz / _KNOT_RATE_HZ)), rate_hz)
    window = max(9, round(window_s * rate_hz / basis.samples_per_knot))
    seen = np.isfinite(samples)
    offset = np.nanmean(samples, axis=0)
    scaled = (np.stack([_bridged(channel) for channel in samples.T], axis=1) - offset) / sigma
    groups = _alike(seen)
    first = max(groups, key=lambda columns: seen[:, columns[0]].sum())
    stiffness = _stiffness(scaled[:, first], seen[:, first[0]], window, basis)
    c, spread = np.empty((basis.size, samples.shape[1])), np.empty(samples.shape)
    for columns in groups:
        weights = np.where(seen[:, columns[0]], 1.0, _BRIDGE_WEIGHT)
        right = basis.values.T @ (weights[:, None] * scaled[:, columns])
        c[:, columns], inverse = _fit(_normal(basis, weights), stiffness, right)
        sd = np.sqrt(_variances(basis.curves, inverse))
        spread[:, columns] = np.outer(sd, sigma[columns])
    c *= sigma
    return SmoothSignal(basis.values @ c + offset, basis.slopes @ c, basis.curves @ c, spread)


def _alike(seen: np.ndarray) -> list[list[int]]:
    """Channels (columns) that miss the same samples, together."""
    groups: dict[bytes, list[int]] = {}
    for k in range(seen.shape[1]):
        groups.setdefault(seen[:, k].tobytes(), []).append(k)
    return list(groups.values())


def noise_level(samples: np.ndarray, rate_hz: float) -> np.ndarray:
    """(channels,) standard deviation of the noise on a smooth signal, as if it were white.

    The power above human movement (12 to 20 Hz) in the quietest third of the trial: bursts stand
    above that third, and a lab's own low-pass, which would hide the noise from the highest
    frequencies, ends above that band.
    """
    nyquist = 0.5 * rate_hz
    band = (min(_NOISE_BAND_HZ[0], 0.5 * nyquist), min(_NOISE_BAND_HZ[1], 0.9 * nyquist))
    width = min(max(16, round(_NOISE_WINDOW_S * rate_hz)), len(samples) - _NOISE_ORDER)
    bridged = np.stack([_bridged(channel) for channel in samples.T], axis=1)
    # Differences first: slow motion, a thousand times the noise, must not leak into the band.
    f, t, power = spectrogram(
        np.diff(bridged, _NOISE_ORDER, axis=0),
        rate_hz,
        axis=0,
        nperseg=width,
        window="hann",
        detrend="linear",
    )
    inside = (f >= band[0]) & (f <= band[1])
    inside[1 + np.argmin(np.abs(f[1:] - np.mean(band)))] = True  # few frequencies if short
    gain = (2 * np.sin(np.pi * f[inside] / rate_hz)) ** (2 * _NOISE_ORDER)
    density = (power[inside] / gain[:, None, None]).mean(axis=0)
    # The lower third of such a mean lies below it; a Hann window ties neighbouring frequencies.
    freedom = 2 * inside.sum() / 1.9
    whole = _whole_windows(samples, (t * rate_hz - 0.5 * width).round().astype(int), width)
    level = np.sqrt(
        np.quantile(density[:, whole], 1 / 3, axis=1) * freedom / chi2.ppf(1 / 3, freedom) * nyquist
    )
    scale = np.abs(bridged).max(axis=0)
    return np.maximum(level, 1e-9 * np.maximum(scale, 1.0))


def _whole_windows(samples: np.ndarray, first: np.ndarray, width: int) -> np.ndarray:
    """Which windows hold no bridged sample, whose noise is nil; all of them where none does."""
    missing = np.concatenate([[0], np.cumsum(~np.isfinite(samples).all(axis=1))])
    last = np.minimum(first + width + _NOISE_ORDER, len(samples))
    whole = missing[last] == missing[first]
    return whole if whole.any() else np.ones(len(first), dtype=bool)


def _bridged(channel: np.ndarray) -> np.ndarray:
    seen = np.isfinite(channel)
    return np.interp(np.arange(len(channel)), np.flatnonzero(seen), channel[seen])


class _Basis:
    """Values of the B-splines and their derivatives at N uniform samples, as sparse matrices."""

    def __init__(self, count: int, samples_per_knot: int, rate_hz: float) -> None:
        self.samples_per_knot = samples_per_knot
        self.x = np.arange(count) / samples_per_knot  # in knots
        self.intervals = max(int(np.ceil(self.x[-1])), 1)
        self.per_s = rate_hz / samples_per_knot
        self.size = self.intervals + _DEGREE

    def _derivative(self, order: int) -> sparse.csr_array:
        """Basis of degree 5 - order on the same knots, times the differences of that order."""
        degree = _DEGREE - order
        knots = np.arange(-degree, self.intervals + degree + 1, dtype=float)
        basis = sparse.csr_array(BSpline.design_matrix(self.x, knots, degree))
        signs = {0: [1.0], 1: [-1.0, 1.0], 2: [1.0, -2.0, 1.0]}[order]
        size = self.size - order
        differences = sparse.diags_array(
            [np.full(size, s) for s in signs], offsets=range(order + 1), shape=(size, self.size)
        )
        return sparse.csr_array(basis @ differences) * self.per_s**order

    @cached_property
    def values(self) -> sparse.csr_array:
        return self._derivative(0)

    @cached_property
    def slopes(self) -> sparse.csr_array:
        return self._derivative(1)

    @cached_property
    def curves(self) -> sparse.csr_array:
        return self._derivative(2)

    @cached_property
    def knot_of_sample(self) -> np.ndarray:
        """(N,) fourth difference that is centred on each sample."""
        return np.clip(np.round(self.x).astype(int), 0, self.size - 5)


def _stiffness(y: np.ndarray, seen: np.ndarray, window: int, basis: _Basis) -> np.ndarray:
    """The stiffness at each fourth difference that the channels y (N, channels) share.

    y in units of its noise. All channels share one stiffness: where each has its own, the errors
    of pelvis and legs no longer cancel and a planted foot accelerates.
    """
    weights = np.where(seen, 1.0, _BRIDGE_WEIGHT)
    right = basis.values.T @ (weights[:, None] * y)
    normal = _normal(basis, weights)
    stiffness = np.full(basis.size - 4, _FIRST_STIFFNESS)
    for _ in range(_ROUNDS):
        c, inverse = _fit(normal, stiffness, right)
        leverage = seen * _variances(basis.values, inverse)
        known = np.bincount(basis.knot_of_sample, leverage, minlength=len(stiffness))
        new = _mean(known, window) / np.maximum(_mean(_pace(c), window), 1e-300)
        new = np.exp(_mean(np.log(np.clip(new, *_STIFFNESS_RANGE)), max(3, window // 4)))
        settled = np.max(np.abs(np.log(new / stiffness))) < 0.1
        stiffness = new
        if settled:
            break
    return stiffness


def _normal(basis: _Basis, weights: np.ndarray) -> np.ndarray:
    """(6, n) lower band of B^T diag(weights) B."""
    return _lower_band(basis.values.T @ (basis.values * weights[:, None]))


def _pace(c: np.ndarray) -> np.ndarray:
    """Mean square over the channels of the coefficients' fourth differences."""
    n = len(c) - 4
    return (sum(_FOURTH[k] * c[k : k + n] for k in range(5)) ** 2).mean(axis=1)


def _mean(x: np.ndarray, window: int) -> np.ndarray:
    return uniform_filter1d(x, window, mode="nearest")


def _lower_band(matrix: sparse.csr_array) -> np.ndarray:
    """(6, n) lower band of a symmetric matrix."""
    band = np.zeros((_DEGREE + 1, matrix.shape[0]))
    for k in range(_DEGREE + 1):
        band[k, : matrix.shape[0] - k] = matrix.diagonal(-k)
    return band


def _fit(normal: np.ndarray, stiffness: np.ndarray, right: np.ndarray):
    """Coefficients and the band of the posterior covariance over sigma^2."""
    matrix = normal.copy()
    for a in range(5):
        for b in range(a, 5):
            matrix[b - a, a : a + len(stiffness)] += _FOURTH[a] * _FOURTH[b] * stiffness
    factor = cholesky_banded(matrix, lower=True)
    return cho_solve_banded((factor, True), right), _inverse_band(factor)


@njit(cache=True)
def _inverse_band(factor):
    """The band of (L L^T)^-1 for a lower banded factor L (Takahashi's recursion)."""
    width, n = factor.shape
    z = np.zeros((width, n))
    for i in range(n - 1, -1, -1):
        last = min(width - 1, n - 1 - i)
        for b in range(last, -1, -1):
            total = 1.0 / factor[0, i] if b == 0 else 0.0
            for k in range(1, last + 1):
                total -= factor[k, i] * z[abs(k - b), i + min(k, b)]
            z[b, i] = total / factor[0, i]
    return z


def _variances(rows: sparse.csr_array, inverse: np.ndarray) -> np.ndarray:
    """(N,) variance over sigma^2 of each row applied to the coefficients."""
    n = inverse.shape[1]
    diagonals = [inverse[k, : n - k] for k in range(len(inverse))]
    offsets = [*range(len(inverse)), *range(-1, -len(inverse), -1)]
    covariance = sparse.diags_array([*diagonals, *diagonals[1:]], offsets=offsets, shape=(n, n))
    return np.maximum(np.asarray((rows @ covariance).multiply(rows).sum(axis=1)).ravel(), 0.0)
