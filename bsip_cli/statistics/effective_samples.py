"""How many independent samples an autocorrelated series is worth.

Frames of a trial are not independent: 12,000 frames of a swaying body may carry a few hundred
independent values. Every interval and test on frames uses these numbers instead of n.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.fft import irfft, next_fast_len, rfft

from bsip_cli.statistics.samples import Stretches, finite_stretches, is_constant, joined

MINIMUM_SAMPLES = 4
"""Below this no autocorrelation can be estimated and the answer is nan."""

WINDOW_PER_TIME = 5.0
"""Lags summed, in integrated correlation times (Sokal 1997, section 3)."""


def effective_samples(x: ArrayLike, stretches: Stretches | None = None) -> float:
    """Independent samples that would give the mean of x the same variance.

    n / (1 + 2 sum_k (N_k / n) rho_k), N_k the number of pairs of samples k apart, summed over
    Geyer's initial positive sequence: as long as rho_2m + rho_2m+1 > 0 (Geyer 1992, Practical
    Markov chain Monte Carlo, Statistical Science 7, section 3.3). The rule stops at the first
    negative swing of an oscillating series, so it counts rather too few samples than too many.

    Parameters
    ----------
    x : shape (n,), any unit. Samples that are not finite are gaps.
    stretches : half-open index pairs to use, None for all. Positions count as time: pairs of
        samples across a gap enter at their true lag.

    Returns
    -------
    float between 0 and n; nan for fewer than four samples or a constant series.
    """
    series = np.asarray(x, dtype=float)
    parts = finite_stretches(stretches, series)
    samples = joined(series, parts)
    if len(samples) < MINIMUM_SAMPLES or is_constant(samples):
        return float("nan")
    products, _ = _lagged_products(series, parts)
    share = products / products[0]  # (N_k / n) rho_k
    pairs = share[: len(share) // 2 * 2].reshape(-1, 2).sum(axis=1)
    negative = np.flatnonzero(pairs <= 0.0)
    last = negative[0] if len(negative) else len(pairs)
    correlation_time = max(-1.0 + 2.0 * float(pairs[:last].sum()), 1.0)
    return len(samples) / correlation_time


def effective_samples_of_pair(
    x: ArrayLike, y: ArrayLike, stretches: Stretches | None = None
) -> float:
    """Independent pairs that would give the correlation of x and y the same variance.

    n / (1 + 2 sum_k (N_k / n) rho_x,k rho_y,k), after Bartlett 1935 (Some aspects of the
    time-correlation problem, J. R. Stat. Soc. 98; Pyper and Peterman 1998): exact for
    series that are independent of each other, an approximation otherwise. The sum ends at the
    first lag of five integrated correlation times (Sokal 1997, section 3): unlike the sign rule
    for one series, this is not fooled by two oscillations that cross zero a frame apart.

    Parameters
    ----------
    x, y : shape (n,), any units. Rows in which either is not finite are gaps.
    stretches : as in `effective_samples`.

    Returns
    -------
    float between 0 and n; nan for fewer than four samples or if either series is constant.
    """
    first, second = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    parts = finite_stretches(stretches, first, second)
    n = sum(stop - start for start, stop in parts)
    if n < MINIMUM_SAMPLES or any(is_constant(joined(s, parts)) for s in (first, second)):
        return float("nan")
    products_x, counts = _lagged_products(first, parts)
    products_y, _ = _lagged_products(second, parts)
    # (N_k / n) rho_x rho_y, each rho = (products_k / N_k) / (products_0 / n)
    share = (products_x / products_x[0]) * (products_y / products_y[0]) * n / np.maximum(counts, 1)
    times = 1.0 + 2.0 * np.cumsum(share[1:])
    lags = np.arange(1, len(share))
    enough = np.flatnonzero(lags >= WINDOW_PER_TIME * times)
    correlation_time = max(float(times[enough[0] if len(enough) else -1]), 1.0)
    return n / correlation_time


def _lagged_products(
    series: NDArray[np.float64], stretches: Stretches
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Sum over all pairs k apart of the centred series, and the number of pairs, k = 0 .. n-1."""
    first, last = stretches[0][0], stretches[-1][1]
    present = np.zeros(last - first)
    centred = np.zeros(last - first)
    mean = joined(series, stretches).mean()
    for start, stop in stretches:
        present[start - first : stop - first] = 1.0
        centred[start - first : stop - first] = series[start:stop] - mean
    counts = np.round(_correlate_with_itself(present))
    products = np.where(counts > 0, _correlate_with_itself(centred), 0.0)
    return products, counts


def _correlate_with_itself(values: NDArray[np.float64]) -> NDArray[np.float64]:
    size = next_fast_len(2 * len(values), real=True)
    return irfft(np.abs(rfft(values, size)) ** 2, size)[: len(values)]
