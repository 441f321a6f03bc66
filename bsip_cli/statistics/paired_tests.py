"""Two values per participant: do they differ, and are they close enough to be called equal?

All tests take two samples of shape (n,) in one unit, drop the pairs in which either value is not
finite, and test x - y. A test that is not possible has nan numbers and a sentence in `reason`;
means and standard deviations are given wherever they exist.
"""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass
from math import nan, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from bsip_cli.statistics.samples import finite_pairs, is_constant, mean_of, standard_deviation

MINIMUM_PAIRS = 3
"""Fewer pairs give a t test whose interval says nothing."""

MINIMUM_FOR_WILCOXON = 6
"""Of five pairs or fewer even the most extreme ranks have p = 2 / 2^5 > 0.05."""

EXACT_WILCOXON_UP_TO = 50
"""Above this many non-zero differences, or with ties above `EXACT_WITH_TIES_UP_TO`, p is from
the normal approximation."""

EXACT_WITH_TIES_UP_TO = 16


@dataclass(frozen=True)
class PairedComparison:
    """Paired t test of x - y, with the interval of the mean difference.

    The two effect sizes have opposite signs by their definitions: `cohens_d_pooled` is
    (mean y - mean x) / pooled SD, as Hansen 2017 prints it with x = OM and y = RM; `d_paired`
    (d_z) is the mean of x - y over the SD of x - y.
    """

    n: int
    mean_x: float = nan
    sd_x: float = nan
    mean_y: float = nan
    sd_y: float = nan
    mean_difference: float = nan
    ci_low: float = nan
    ci_high: float = nan
    t: float = nan
    df: float = nan
    p: float = nan
    cohens_d_pooled: float = nan
    d_paired: float = nan
    reason: str = ""


@dataclass(frozen=True)
class WilcoxonTest:
    """Wilcoxon's signed-rank test of x - y.

    w : the smaller of the two sums of ranks.
    hodges_lehmann : median of the pairwise means of the differences, in the unit of x.
    rank_biserial : (positive - negative ranks) / all ranks, -1 .. 1, the effect size.
    """

    n: int
    n_nonzero: int
    w: float = nan
    p: float = nan
    hodges_lehmann: float = nan
    rank_biserial: float = nan
    reason: str = ""


@dataclass(frozen=True)
class EquivalenceTest:
    """Two one-sided t tests of |mean(x - y)| < bound.

    The interval is the one at 1 - 2 alpha that belongs to the test: x and y are equivalent if
    it lies within -bound .. bound. `equivalent` is None where the test is not possible.
    """

    n: int
    bound: float
    mean_difference: float = nan
    ci_low: float = nan
    ci_high: float = nan
    t_lower: float = nan
    t_upper: float = nan
    df: float = nan
    p: float = nan
    equivalent: bool | None = None
    reason: str = ""


def cohens_d_pooled(mean_x: float, sd_x: float, mean_y: float, sd_y: float) -> float:
    """(mean y - mean x) / sqrt((sd_x^2 + sd_y^2) / 2); nan if both SD are zero or nan.

    Cohen 1988, Statistical power analysis, eq. 2.3.2; Hansen 2017, tables 1 and 2.
    """
    pooled = sqrt((sd_x**2 + sd_y**2) / 2.0)
    return (mean_y - mean_x) / pooled if pooled > 0.0 else nan


def paired_t(x: ArrayLike, y: ArrayLike, confidence: float = 0.95) -> PairedComparison:
    """Paired samples t test, two-sided (Student 1908), as in Hansen 2017, tables 1 and 2.

    Raises
    ------
    ValueError
        if x and y differ in shape.
    """
    x, y = finite_pairs(x, y)
    difference = x - y
    t = df = p = ci_low = ci_high = d_paired = nan
    reason = _why_no_t(x, y, difference)
    if not reason:
        test = stats.ttest_1samp(difference, 0.0)
        interval = test.confidence_interval(confidence)
        t, df, p = float(test.statistic), float(test.df), float(test.pvalue)
        ci_low, ci_high = float(interval.low), float(interval.high)
        d_paired = float(difference.mean() / difference.std(ddof=1))
    mean_x, sd_x, mean_y, sd_y = (
        mean_of(x),
        standard_deviation(x),
        mean_of(y),
        standard_deviation(y),
    )
    return PairedComparison(
        n=len(x),
        mean_x=mean_x,
        sd_x=sd_x,
        mean_y=mean_y,
        sd_y=sd_y,
        mean_difference=mean_of(difference),
        ci_low=ci_low,
        ci_high=ci_high,
        t=t,
        df=df,
        p=p,
        cohens_d_pooled=cohens_d_pooled(mean_x, sd_x, mean_y, sd_y),
        d_paired=d_paired,
        reason=reason,
    )


def wilcoxon(x: ArrayLike, y: ArrayLike) -> WilcoxonTest:
    """Wilcoxon's signed-rank test, two-sided, for differences that are not normal.

    Wilcoxon 1945 (Biometrics Bulletin 1). Zero differences are dropped, as Wilcoxon did. p is
    exact up to 50 differences, with ties by all sign flips up to 16, else asymptotic with
    correction for ties. Hodges and Lehmann 1963; Kerby 2014 for the rank-biserial correlation.

    Raises
    ------
    ValueError
        if x and y differ in shape.
    """
    x, y = finite_pairs(x, y)
    whole, unit = _without_rounding(x, y)
    nonzero = whole[whole != 0] * unit
    n, m = len(whole), len(nonzero)
    estimate = _hodges_lehmann(whole) * unit if n else nan
    if m < MINIMUM_FOR_WILCOXON:
        reason = (
            f"Wilcoxon's test needs {MINIMUM_FOR_WILCOXON} pairs that differ to reach p < 0.05, "
            f"there are {m}."
        )
        return WilcoxonTest(n, m, hodges_lehmann=estimate, reason=reason)
    ranks = stats.rankdata(np.abs(nonzero))
    positive, negative = float(ranks[nonzero > 0].sum()), float(ranks[nonzero < 0].sum())
    p = _signed_rank_p(nonzero, ranks)
    biserial = (positive - negative) / (positive + negative)
    return WilcoxonTest(n, m, min(positive, negative), p, estimate, biserial)


def equivalence_tost(
    x: ArrayLike, y: ArrayLike, bound: float, alpha: float = 0.05
) -> EquivalenceTest:
    """Paired test of equivalence by two one-sided t tests (Schuirmann 1987; Lakens 2017).

    Parameters
    ----------
    bound : half-width of the range that counts as equal, in the unit of x, positive.
    alpha : level of each one-sided test.

    Raises
    ------
    ValueError
        if x and y differ in shape.
    """
    x, y = finite_pairs(x, y)
    difference = x - y
    reason = _why_no_t(x, y, difference)
    if not (np.isfinite(bound) and bound > 0.0):
        reason = f"An equivalence test needs a positive bound, not {bound}."
    n, mean = len(x), mean_of(difference)
    if reason:
        return EquivalenceTest(n, bound, mean, reason=reason)
    lower = stats.ttest_1samp(difference, -bound, alternative="greater")
    upper = stats.ttest_1samp(difference, bound, alternative="less")
    interval = stats.ttest_1samp(difference, 0.0).confidence_interval(1.0 - 2.0 * alpha)
    p = float(max(lower.pvalue, upper.pvalue))
    return EquivalenceTest(
        n=n,
        bound=bound,
        mean_difference=mean,
        ci_low=float(interval.low),
        ci_high=float(interval.high),
        t_lower=float(lower.statistic),
        t_upper=float(upper.statistic),
        df=float(n - 1),
        p=p,
        equivalent=p < alpha,
    )


def _why_no_t(
    x: NDArray[np.float64], y: NDArray[np.float64], difference: NDArray[np.float64]
) -> str:
    if len(x) < MINIMUM_PAIRS:
        return f"A paired t test needs {MINIMUM_PAIRS} pairs, there are {len(x)}."
    if is_constant(difference, beside=_magnitude(x, y)):
        return "All differences are equal, so the t statistic has no finite value."
    return ""


def _magnitude(x: NDArray[np.float64], y: NDArray[np.float64]) -> float:
    return float(np.max(np.abs(np.concatenate([x, y])), initial=0.0))


def _without_rounding(
    x: NDArray[np.float64], y: NDArray[np.float64]
) -> tuple[NDArray[np.int64], float]:
    """x - y in whole units of the twelfth digit of the largest value, and that unit: equal
    differences become exact ties."""
    magnitude = _magnitude(x, y)
    unit = 10.0 ** (np.floor(np.log10(magnitude)) - 11) if magnitude else 1.0
    return np.round((x - y) / unit).astype(np.int64), unit


def _hodges_lehmann(whole: NDArray[np.int64]) -> float:
    """Median of the means of all pairs, each value with itself too.

    The pairs are counted, not formed: those of a large cohort would fill the memory.
    """
    ordered = np.sort(whole)
    count = len(ordered) * (len(ordered) + 1) // 2
    middle = (_pair_sum(ordered, (count + 1) // 2), _pair_sum(ordered, count // 2 + 1))
    return sum(middle) / 4.0


def _pair_sum(ordered: NDArray[np.int64], number: int) -> int:
    """The sum of a pair than which ``number - 1`` pairs have none that is larger."""
    own = np.arange(len(ordered))

    def pairs_up_to(total: int) -> int:
        partners = np.searchsorted(ordered, total - ordered, side="right") - own
        return int(np.maximum(partners, 0).sum())

    sums = range(2 * int(ordered[0]), 2 * int(ordered[-1]) + 1)
    return sums[bisect_left(sums, number, key=pairs_up_to)]


def _signed_rank_p(nonzero: NDArray[np.float64], ranks: NDArray[np.float64]) -> float:
    n = len(nonzero)
    if len(np.unique(ranks)) == n:
        method = "exact" if n <= EXACT_WILCOXON_UP_TO else "asymptotic"
        return float(stats.wilcoxon(nonzero, method=method).pvalue)
    if n > EXACT_WITH_TIES_UP_TO:
        return float(stats.wilcoxon(nonzero, method="asymptotic").pvalue)
    signs = (np.arange(2**n)[:, None] >> np.arange(n)) & 1
    sums = signs @ ranks
    middle = ranks.sum() / 2.0
    extreme = abs(float(ranks[nonzero > 0].sum()) - middle)
    return float(np.mean(np.abs(sums - middle) >= extreme - 1e-9))
