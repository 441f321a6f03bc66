"""What every test asks of its samples first: finite values, and values that vary; what it gives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import nan
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.fft import irfft, next_fast_len, rfft

# --- what a test gives ----------------------------------------------------------------------------


@dataclass(frozen=True, kw_only=True)
class TestResult:
    """A test of a against b over n participants; differences are a - b.

    What cannot be computed is nan, and `reason` says why. `count_a` and `count_b` are the
    participants in whom the one or the other is better, for tests that count.
    """

    __test__ = False  # it is none of pytest's

    n: int = 0
    mean_a: float = nan
    sd_a: float = nan
    mean_b: float = nan
    sd_b: float = nan
    difference: float = nan
    ci_low: float = nan
    ci_high: float = nan
    bound: float = nan
    statistic: float = nan
    df1: float = nan
    df2: float = nan
    p_value: float = nan
    effect_size: float = nan
    effect_size_name: str = ""
    epsilon: float = nan
    count_a: float = nan
    count_b: float = nan
    reason: str = ""

    def with_(self, **numbers: Any) -> TestResult:
        return replace(self, **numbers)


Z95 = 1.959964  # standard deviations to either side that hold 95 % of a normal distribution


# --- p values of several tests, corrected for their number ----------------------------------------


def adjusted_p_values(
    p_values: Sequence[float], method: Literal["holm", "bonferroni"] = "holm"
) -> tuple[float, ...]:
    """P values that hold for the whole family of tests.

    Bonferroni: m p. Holm 1979 (Scand. J. Stat. 6): the same guarantee, never larger. Tests that
    were not possible (nan) stay nan and do not count in m.
    ValueError: if a p value lies outside 0 .. 1.
    """
    p = np.array(p_values, dtype=float)
    possible = ~np.isnan(p)
    if np.any((p[possible] < 0.0) | (p[possible] > 1.0)):
        raise ValueError(f"p values outside 0..1: {p_values}")
    if possible.any():
        from statsmodels.stats.multitest import multipletests

        p[possible] = multipletests(p[possible], method=method)[1]
    return tuple(float(value) for value in p)


# --- whether several estimates may be of one size -------------------------------------------------


def p_of_one_size(estimates: np.ndarray, widths: np.ndarray) -> float:
    """p-value of estimates (n,) of one size that spread like these (Cochran's Q).

    widths : (n,) of their 95 % intervals, above zero, in the estimates' unit.
    """
    from statsmodels.stats.meta_analysis import combine_effects

    with np.errstate(divide="ignore"):  # of I squared, where all are the same
        result = combine_effects(estimates, (widths / (2 * Z95)) ** 2)
    return float(result.test_homogeneity().pvalue)


# --- is a sample normal enough for a t test? ------------------------------------------------------

MINIMUM_FOR_LILLIEFORS = 4  # the simulated table of critical values starts here


def lilliefors_test(x: ArrayLike) -> TestResult:
    """Kolmogorov-Smirnov test of normality with estimated mean and variance.

    Lilliefors 1967 (J. Am. Stat. Assoc. 62), as in Hansen 2017 (Statistical analyses); p from
    the simulated table of statsmodels, which ends at 0.001 and 0.99.

    x : shape (n,), any unit; for a paired t test the differences. Values that are not finite
        are dropped; n says how many are left.
    """
    values = finite_values(x)
    n = len(values)
    reason = ""
    if n < MINIMUM_FOR_LILLIEFORS:
        reason = f"Lilliefors' test needs {MINIMUM_FOR_LILLIEFORS} values, there are {n}."
    elif is_constant(values):
        reason = "All values are equal, so there is no distribution to test."
    if reason:
        return TestResult(n=n, reason=reason)
    from statsmodels.stats.diagnostic import lilliefors

    statistic, p_value = lilliefors(values, dist="norm", pvalmethod="table")
    return TestResult(n=n, statistic=float(statistic), p_value=float(p_value))


ROUNDING = 1e-12  # differences below this part of the largest value are rounding, not variation


def finite_values(x: ArrayLike) -> NDArray[np.float64]:
    """The finite values of a one-dimensional sample."""
    values = np.asarray(x, dtype=float)
    if values.ndim != 1:
        raise ValueError(f"a sample must be one-dimensional, not of shape {values.shape}")
    return values[np.isfinite(values)]


def finite_pairs(x: ArrayLike, y: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The rows in which both samples, of one shape (n,), are finite."""
    first, second = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    if first.ndim != 1 or first.shape != second.shape:
        raise ValueError(f"paired samples of shapes {first.shape} and {second.shape}")
    both = np.isfinite(first) & np.isfinite(second)
    return first[both], second[both]


def is_constant(values: NDArray[np.float64], *, magnitude: float = 0.0) -> bool:
    """Whether the values vary by no more than rounding.

    values : shape (n,), n > 0.
    magnitude : largest magnitude of what the values were computed from, in their unit; the
        difference of two large numbers carries their rounding.
    """
    scale = max(float(np.max(np.abs(values))), magnitude)
    return float(np.ptp(values)) <= ROUNDING * scale


def standard_deviation(values: NDArray[np.float64]) -> float:
    """Sample standard deviation (n - 1): nan below two values, 0 if they differ by rounding."""
    if len(values) < 2:
        return float("nan")
    return 0.0 if is_constant(values) else float(np.std(values, ddof=1))


def mean_of(values: NDArray[np.float64]) -> float:
    """Mean, nan for no values."""
    return float(np.mean(values)) if len(values) else float("nan")


# --- how many independent samples an autocorrelated series is worth -------------------------------

MINIMUM_SAMPLES = 4  # below this no autocorrelation can be estimated and the answer is nan
WINDOW_PER_TIME = 5.0  # lags summed, in integrated correlation times (Sokal 1997, section 3)


def effective_samples(x: ArrayLike) -> float:
    """Independent samples that would give the mean of x the same variance.

    n / (1 + 2 sum_k (N_k / n) rho_k), N_k the number of pairs of samples k apart, summed over
    Geyer's initial positive sequence: as long as rho_2m + rho_2m+1 > 0 (Geyer 1992, Practical
    Markov chain Monte Carlo, Statistical Science 7, section 3.3). The rule stops at the first
    negative swing of an oscillating series, so it counts rather too few samples than too many.

    x : shape (n,), any unit. Samples that are not finite are gaps: positions count as time, so
        pairs of samples across a gap enter at their true lag.
    Returns a float between 0 and n; nan for fewer than four samples or a constant series.
    """
    series = np.asarray(x, dtype=float)
    samples = finite_values(series)
    if len(samples) < MINIMUM_SAMPLES or is_constant(samples):
        return float("nan")
    products, _ = _lagged_products(series)
    share = products / products[0]  # (N_k / n) rho_k
    pairs = share[: len(share) // 2 * 2].reshape(-1, 2).sum(axis=1)
    negative = np.flatnonzero(pairs <= 0.0)
    last = negative[0] if len(negative) else len(pairs)
    correlation_time = max(-1.0 + 2.0 * float(pairs[:last].sum()), 1.0)
    return len(samples) / correlation_time


def effective_samples_of_pair(x: ArrayLike, y: ArrayLike) -> float:
    """Independent pairs that would give the correlation of x and y the same variance.

    n / (1 + 2 sum_k (N_k / n) rho_x,k rho_y,k), after Bartlett 1935 (Some aspects of the
    time-correlation problem, J. R. Stat. Soc. 98; Pyper and Peterman 1998): exact for
    series that are independent of each other, an approximation otherwise. The sum ends at the
    first lag of five integrated correlation times (Sokal 1997, section 3): unlike the sign rule
    for one series, this is not fooled by two oscillations that cross zero a frame apart.

    x, y : shape (n,), any units. Rows in which either is not finite are gaps.
    Returns a float between 0 and n; nan for fewer than four samples or a constant series.
    """
    first, second = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    pairs = finite_pairs(first, second)
    n = len(pairs[0])
    if n < MINIMUM_SAMPLES or any(map(is_constant, pairs)):
        return float("nan")
    gap = ~(np.isfinite(first) & np.isfinite(second))
    products_x, counts = _lagged_products(np.where(gap, np.nan, first))
    products_y, _ = _lagged_products(np.where(gap, np.nan, second))
    # (N_k / n) rho_x rho_y, each rho = (products_k / N_k) / (products_0 / n)
    share = (products_x / products_x[0]) * (products_y / products_y[0]) * n / np.maximum(counts, 1)
    times = 1.0 + 2.0 * np.cumsum(share[1:])
    lags = np.arange(1, len(share))
    enough = np.flatnonzero(lags >= WINDOW_PER_TIME * times)
    correlation_time = max(float(times[enough[0] if len(enough) else -1]), 1.0)
    return n / correlation_time


def _lagged_products(
    series: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Sum over all pairs k apart of the centred series, and the number of pairs, k = 0 .. n-1."""
    places = np.flatnonzero(np.isfinite(series))
    inner = series[places[0] : places[-1] + 1]
    present = np.isfinite(inner)
    centred = np.where(present, inner - inner[present].mean(), 0.0)
    counts = np.round(_correlate_with_itself(present.astype(float)))
    products = np.where(counts > 0, _correlate_with_itself(centred), 0.0)
    return products, counts


def _correlate_with_itself(values: NDArray[np.float64]) -> NDArray[np.float64]:
    size = next_fast_len(2 * len(values), real=True)
    return irfft(np.abs(rfft(values, size)) ** 2, size)[: len(values)]
