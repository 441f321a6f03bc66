"""Penalised splines whose stiffness follows the local pace of the motion.

The signal is a quintic B-spline; the fourth differences of its coefficients get the prior
variance ``tau^2(t)``, the samples the noise variance ``sigma^2`` (P-splines: Eilers and Marx
1996). Both come from the data: sigma from the power above human movement, tau
by evidence maximisation (MacKay 1992) over a window that moves along. Derivatives are those of
the spline.

Skin adds noise that is not white: its acceleration has the same power at all frequencies, so it
grows like 1 / f^4 towards low ones, and it keeps pace with the motion. The best gain against both
is 1 / (1 + (sigma^2 / tau^2) w^8 + rho w^4) with the skin's share rho: a penalty on the second
differences next to the one on the fourth.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np
from scipy import sparse
from scipy.interpolate import BSpline
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.ndimage import uniform_filter1d
from scipy.signal import spectrogram
from scipy.stats import chi2

from bsip_cli.motion.compiled import compiled

_DEGREE = 5
_KNOT_RATE_HZ = 100.0  # about: a whole number of samples per knot; human motion ends far below
_SECOND, _FOURTH = np.array([1.0, -2.0, 1.0]), np.array([1.0, -4.0, 6.0, -4.0, 1.0])
_NOISE_ORDER, _NOISE_BAND_HZ, _NOISE_WINDOW_S = 3, (12.0, 20.0), 0.64
_ROUNDS = 20
_FEWEST = 12
# sigma^2 / tau^2: where the evidence begins, and its limits (a cut-off of 28 Hz and of 1.2 Hz).
# Stiffer equations would lose the digits of the samples (weight 1) and of the bridges.
_FIRST_STIFFNESS, _STIFFNESS_RANGE = 1e1, (1e-2, 1e9)
_BRIDGE_WEIGHT = 1e-4  # of a missing sample, against 1: keeps long gaps solvable
_FREQUENCIES = 1000  # at which a gain is computed to find the cut-off


@dataclass(frozen=True, eq=False)
class SmoothSignal:
    """A smoothed signal and its derivatives at the samples, each (N, channels).

    ``second_sd`` is the standard deviation of the second derivative; ``cutoff_hz`` (N,) the
    frequency at which the smoother's gain is one half.
    """

    value: np.ndarray
    first: np.ndarray
    second: np.ndarray
    second_sd: np.ndarray
    cutoff_hz: np.ndarray


@dataclass(frozen=True)
class SkinNoise:
    """Noise that falls with frequency, on top of the white one.

    Below ``corner_hz`` its power, mean over the trial, is larger than that of the white noise;
    below ``from_hz`` it is never taken to be larger than the signal's.
    """

    corner_hz: float
    from_hz: float


def smooth(
    samples: np.ndarray,
    rate_hz: float,
    window_s: float,
    noise_sd: np.ndarray | None = None,
    skin: SkinNoise | None = None,
) -> SmoothSignal:
    """Smooth all channels by one stiffness that changes over time.

    samples : (N, channels); NaN where missing, which is bridged, each channel on its own.
    window_s : time over which the pace of the motion is judged.
    noise_sd : (channels,) white noise of the samples, estimated from them where not given.
    skin : coloured noise on top of it; none where not given.

    ValueError: there are fewer than 12 samples, or a channel has none.
    """
    count = len(samples)
    if count < _FEWEST or not np.isfinite(samples).any(axis=0).all():
        raise ValueError("too few samples for a spline")
    sigma = noise_level(samples, rate_hz) if noise_sd is None else noise_sd
    basis = _Basis(count, max(1, round(rate_hz / _KNOT_RATE_HZ)), rate_hz)
    window = max(9, round(window_s * rate_hz / basis.samples_per_knot))
    seen = np.isfinite(samples)
    offset = np.nanmean(samples, axis=0)
    scaled = (bridged(samples) - offset) / sigma
    groups: dict[bytes, list[int]] = {}  # channels that miss the same samples, together
    for k in range(samples.shape[1]):
        groups.setdefault(seen[:, k].tobytes(), []).append(k)
    first = max(groups.values(), key=lambda columns: seen[:, columns[0]].sum())
    fourth, second = _penalty(scaled[:, first], seen[:, first[0]], window, basis, skin)
    c, spread = np.empty((basis.size, samples.shape[1])), np.empty(samples.shape)
    # The skin's part has as much power at all frequencies that pass: the value's variance times it.
    skins = second / fourth[basis.knot_of_sample] * basis.per_s**4
    for columns in groups.values():
        equations = _equations(basis, scaled[:, columns], seen[:, columns[0]])
        c[:, columns], inverse = _fit(*equations, fourth, second)
        white = _variances(basis.curves, inverse)
        of_curve = np.sqrt(white + skins * _variances(basis.values, inverse))
        spread[:, columns] = np.outer(of_curve, sigma[columns])
    c *= sigma
    return SmoothSignal(
        basis.values @ c + offset,
        basis.slopes @ c,
        basis.curves @ c,
        spread,
        _cutoff_hz(basis, fourth, second),
    )


def noise_level(samples: np.ndarray, rate_hz: float) -> np.ndarray:
    """(channels,) standard deviation of the noise on a smooth signal, as if it were white.

    The power above human movement (12 to 20 Hz) in the quietest third of the trial: bursts stand
    above that third, and a lab's own low-pass, which would hide the noise from the highest
    frequencies, ends above that band.
    """
    nyquist = 0.5 * rate_hz
    band = (min(_NOISE_BAND_HZ[0], 0.5 * nyquist), min(_NOISE_BAND_HZ[1], 0.9 * nyquist))
    width = min(max(16, round(_NOISE_WINDOW_S * rate_hz)), len(samples) - _NOISE_ORDER)
    whole_curves = bridged(samples)
    # Differences first: slow motion, a thousand times the noise, must not leak into the band.
    f, t, power = spectrogram(
        np.diff(whole_curves, _NOISE_ORDER, axis=0),
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
    # Windows with bridged samples, whose noise is nil, count only where there are no others.
    missing = np.concatenate([[0], np.cumsum(~np.isfinite(samples).all(axis=1))])
    first = (t * rate_hz - 0.5 * width).round().astype(int)
    last = np.minimum(first + width + _NOISE_ORDER, len(samples))
    whole = missing[last] == missing[first]
    whole |= not whole.any()
    level = np.sqrt(
        np.quantile(density[:, whole], 1 / 3, axis=1) * freedom / chi2.ppf(1 / 3, freedom) * nyquist
    )
    scale = np.abs(whole_curves).max(axis=0)
    return np.maximum(level, 1e-9 * np.maximum(scale, 1.0))


def bridged(samples: np.ndarray) -> np.ndarray:
    """(N, channels) with straight lines where NaN was; every channel has a sample."""
    times = np.arange(len(samples))
    out = np.empty_like(samples)
    for k, channel in enumerate(samples.T):
        seen = np.isfinite(channel)
        out[:, k] = np.interp(times, times[seen], channel[seen])
    return out


class _Basis:
    """Values of the B-splines and their derivatives at N uniform samples, as sparse matrices."""

    def __init__(self, count: int, samples_per_knot: int, rate_hz: float) -> None:
        self.samples_per_knot = samples_per_knot
        self.x = np.arange(count) / samples_per_knot  # in knots
        self.intervals = max(int(np.ceil(self.x[-1])), 1)
        self.per_s = rate_hz / samples_per_knot
        self.size = self.intervals + _DEGREE
        matrices = []  # basis of degree 5 - order on the same knots, times differences of an order
        for order, signs in enumerate(([1.0], [-1.0, 1.0], [1.0, -2.0, 1.0])):
            degree, size = _DEGREE - order, self.size - order
            knots = np.arange(-degree, self.intervals + degree + 1, dtype=float)
            basis = sparse.csr_array(BSpline.design_matrix(self.x, knots, degree))
            differences = sparse.diags_array(
                [np.full(size, s) for s in signs], offsets=range(order + 1), shape=(size, self.size)
            )
            matrices.append(sparse.csr_array(basis @ differences) * self.per_s**order)
        self.values, self.slopes, self.curves = matrices
        # (N,) fourth difference that is centred on each sample
        self.knot_of_sample = np.clip(np.round(self.x).astype(int), 0, self.size - 5)

    def power(self, omega: np.ndarray) -> np.ndarray:
        """Gain of B^T B far from the ends at these frequencies (radians per knot)."""
        k = np.arange(-_DEGREE, _DEGREE + 1)
        x = np.arange(-3 * self.samples_per_knot, 3 * self.samples_per_knot) / self.samples_per_knot
        spline = BSpline.basis_element(np.arange(-3.0, 4.0), extrapolate=False)
        products = [np.nansum(spline(x) * spline(x - shift)) for shift in k]
        return np.cos(np.outer(omega, k)) @ np.array(products)


def _penalty(
    y: np.ndarray, seen: np.ndarray, window: int, basis: _Basis, skin: SkinNoise | None
) -> tuple[np.ndarray, float]:
    """Weights of the squared fourth (n - 4,) and second differences of n coefficients, which the
    channels y (N, channels) share; y in units of its white noise.

    All channels share one: where each has its own, the errors of pelvis and legs no longer cancel
    and a planted foot accelerates.
    """
    equations, stiffness = _equations(basis, y, seen), np.full(basis.size - 4, _FIRST_STIFFNESS)
    for _ in range(_ROUNDS):
        c, inverse = _fit(*equations, stiffness, _skin_share(stiffness, basis, skin))
        leverage = seen * _variances(basis.values, inverse)
        known = np.bincount(basis.knot_of_sample, leverage, minlength=len(stiffness))
        n = len(c) - 4  # pace: mean square over the channels of the fourth differences
        pace = (sum(_FOURTH[k] * c[k : k + n] for k in range(5)) ** 2).mean(axis=1)
        new = _mean(known, window) / np.maximum(_mean(pace, window), 1e-300)
        new = np.exp(_mean(np.log(np.clip(new, *_STIFFNESS_RANGE)), max(3, window // 4)))
        converged = np.max(np.abs(np.log(new / stiffness))) < 0.1
        stiffness = new
        if converged:
            break
    return stiffness, _skin_share(stiffness, basis, skin)


def _skin_share(stiffness: np.ndarray, basis: _Basis, skin: SkinNoise | None) -> float:
    """Weight of the second differences: the skin's power over tau^2, both means over the trial."""
    if skin is None:
        return 0.0
    corner, lowest = (2 * np.pi * f / basis.per_s for f in (skin.corner_hz, skin.from_hz))
    share = corner**4 / float(np.mean(1.0 / stiffness))
    return min(share, basis.samples_per_knot / lowest**4)


def _cutoff_hz(basis: _Basis, fourth: np.ndarray, second: float) -> np.ndarray:
    """(N,) frequency at which the gain of the spline, were its stiffness constant, is one half."""
    omega = np.linspace(0.0, np.pi, _FREQUENCIES + 1)[1:]
    difference = 2 * np.sin(0.5 * omega)
    signal = basis.power(omega)
    stiffness = (signal - second * difference**4) / difference**8
    falling = stiffness > 0.0  # beyond, the second differences alone leave less than half
    hz = np.interp(-np.log(fourth), -np.log(stiffness[falling]), omega[falling] * basis.per_s) / (
        2 * np.pi
    )
    return hz[basis.knot_of_sample]


def _equations(basis: _Basis, y: np.ndarray, seen: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(6, n) lower band of B^T W B and (n, channels) B^T W y; weights W by which samples (N,) are
    seen."""
    weights = np.where(seen, 1.0, _BRIDGE_WEIGHT)[:, None]
    matrix = basis.values.T @ (basis.values * weights)
    band = np.zeros((_DEGREE + 1, basis.size))
    for k in range(_DEGREE + 1):
        band[k, : basis.size - k] = matrix.diagonal(-k)
    return band, basis.values.T @ (weights * y)


def _mean(x: np.ndarray, window: int) -> np.ndarray:
    return uniform_filter1d(x, window, mode="nearest")


def _fit(
    normal: np.ndarray, right: np.ndarray, fourth: np.ndarray, second: float
) -> tuple[np.ndarray, np.ndarray]:
    """Coefficients and the band of the posterior covariance over sigma^2."""
    matrix, seconds = normal.copy(), np.full(normal.shape[1] - 2, second)
    for signs, weights in ((_FOURTH, fourth), (_SECOND, seconds)):
        for a, b in combinations_with_replacement(range(len(signs)), 2):
            matrix[b - a, a : a + len(weights)] += signs[a] * signs[b] * weights
    factor = cholesky_banded(matrix, lower=True)
    return cho_solve_banded((factor, True), right), _inverse_band(factor)


@compiled
def _inverse_band(factor: np.ndarray) -> np.ndarray:
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
