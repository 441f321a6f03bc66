"""Residuals and columns in which what is left is white noise: an autoregression per component."""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_toeplitz
from scipy.ndimage import median_filter

from bsip_cli.diagnosis.filtering import Filter

_ORDER = 4  # of the autoregression
_SMOOTH_HZ = 0.75  # half-width of the median over the spectrum
FLOOR = 1e-6  # of the noise's power, taken for white


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


def white_columns(
    columns: np.ndarray, size: np.ndarray, recursion: np.ndarray, filter_: Filter
) -> np.ndarray:
    """(6 n, k) of filtered columns (n, 6, k), in which what is left is white."""
    return innovations(columns / size[:, None], recursion, filter_)
