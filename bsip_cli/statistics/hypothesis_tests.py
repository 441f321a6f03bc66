"""Do methods differ in the same people, and are they close enough to be called equal?

Tests of two samples of shape (n,) in one unit drop the pairs in which either value is not finite,
and test x - y. A test that is not possible has nan numbers and a sentence in `reason`; means and
standard deviations are given wherever they exist.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from itertools import combinations
from math import atanh, isnan, nan, sqrt
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats

from bsip_cli.statistics.samples import (
    ROUNDING,
    TestResult,
    adjusted_p_values,
    finite_pairs,
    finite_values,
    is_constant,
    mean_of,
    standard_deviation,
)

MINIMUM_PAIRS = 3  # fewer pairs give a t test whose interval says nothing
MINIMUM_FOR_WILCOXON = 6
"""Of five pairs or fewer even the most extreme ranks have p = 2 / 2^5 > 0.05."""

EXACT_WILCOXON_UP_TO = 50
"""Above this many non-zero differences, or with ties above `EXACT_WITH_TIES_UP_TO`, p is from
the normal approximation."""

EXACT_WITH_TIES_UP_TO = 16

MINIMUM_SAMPLES = 4.0  # both tests of correlations divide by n - 3
SMALLEST_DETERMINANT = 1e-12

PostHoc = dict[tuple[int, int], TestResult]
"""Bonferroni's t test of two groups or columns, numbered from 0 in the order given."""


# --- two values per participant ---------------------------------------------------------------


def cohens_d_pooled(mean_x: float, sd_x: float, mean_y: float, sd_y: float) -> float:
    """(mean y - mean x) / sqrt((sd_x^2 + sd_y^2) / 2); nan if both SD are zero or nan.

    Hansen 2017 prints it with x = OM and y = RM: its sign is not that of the difference x - y.
    Cohen 1988, Statistical power analysis, eq. 2.3.2; Hansen 2017, tables 1 and 2.
    """
    pooled = sqrt((sd_x**2 + sd_y**2) / 2.0)
    return (mean_y - mean_x) / pooled if pooled > 0.0 else nan


def described_pair(x: NDArray[np.float64], y: NDArray[np.float64]) -> TestResult:
    """Means and SDs of finite pairs."""
    known = TestResult(n=len(x), mean_a=mean_of(x), mean_b=mean_of(y), difference=mean_of(x - y))
    return known.with_(sd_a=standard_deviation(x), sd_b=standard_deviation(y))


def paired_t(x: ArrayLike, y: ArrayLike, confidence: float = 0.95) -> TestResult:
    """Paired samples t test, two-sided (Student 1908), as in Hansen 2017, tables 1 and 2.

    ValueError: if x and y differ in shape.
    """
    x, y = finite_pairs(x, y)
    found = described_pair(x, y)
    if reason := _why_no_t(x, y):
        return found.with_(reason=reason)
    test = stats.ttest_1samp(x - y, 0.0)
    return _tested(found, test, test.confidence_interval(confidence), test.pvalue)


def _tested(found: TestResult, test: Any, interval: Any, p_value: float) -> TestResult:
    names = ("statistic", "df1", "p_value", "ci_low", "ci_high")
    numbers = map(float, (test.statistic, test.df, p_value, interval.low, interval.high))
    return found.with_(**dict(zip(names, numbers, strict=True)))


def wilcoxon(x: ArrayLike, y: ArrayLike) -> TestResult:
    """Wilcoxon's signed-rank test, two-sided, for differences that are not normal.

    Wilcoxon 1945 (Biometrics Bulletin 1). Zero differences are dropped, as Wilcoxon did. p is
    exact up to 50 differences, with ties by all sign flips up to 16, else asymptotic with
    correction for ties. The statistic is the smaller of the two sums of ranks, the difference the
    median of the pairwise means (Hodges and Lehmann 1963), the effect size the rank-biserial
    correlation (Kerby 2014): (positive - negative ranks) / all ranks.
    ValueError: if x and y differ in shape.
    """
    x, y = finite_pairs(x, y)
    whole, unit = _without_rounding(x, y)
    nonzero = whole[whole != 0] * unit
    n, m = len(whole), len(nonzero)
    estimate = _hodges_lehmann(whole) * unit if n else nan
    if reason := _too_few("Wilcoxon's", m):
        return TestResult(n=n, difference=estimate, reason=reason)
    ranks = stats.rankdata(np.abs(nonzero))
    has_ties = len(np.unique(ranks)) < m
    method: Any = stats.PermutationMethod(n_resamples=2**m) if has_ties else "exact"
    if m > (EXACT_WITH_TIES_UP_TO if has_ties else EXACT_WILCOXON_UP_TO):
        method = "asymptotic"
    positive, negative = float(ranks[nonzero > 0].sum()), float(ranks[nonzero < 0].sum())
    found = TestResult(n=n, difference=estimate, statistic=min(positive, negative))
    p = float(stats.wilcoxon(nonzero, method=method).pvalue)
    return found.with_(p_value=p, effect_size=(positive - negative) / (positive + negative))


def equivalence_tost(x: ArrayLike, y: ArrayLike, bound: float, alpha: float = 0.05) -> TestResult:
    """Paired test of |mean(x - y)| < bound by two one-sided t tests (Schuirmann 1987; Lakens 2017).

    Statistic and p are those of the weaker side. The interval is the one at 1 - 2 alpha that
    belongs to the test: x and y are equivalent if it lies within -bound .. bound.

    bound : half-width of the range that counts as equal, in the unit of x, positive.
    alpha : level of each one-sided test.
    ValueError: if x and y differ in shape.
    """
    x, y = finite_pairs(x, y)
    difference = x - y
    found = TestResult(n=len(x), bound=bound, difference=mean_of(difference))
    reason = _why_no_t(x, y)
    if not (np.isfinite(bound) and bound > 0.0):
        reason = f"An equivalence test needs a positive bound, not {bound}."
    if reason:
        return found.with_(reason=reason)
    lower = stats.ttest_1samp(difference, -bound, alternative="greater")
    upper = stats.ttest_1samp(difference, bound, alternative="less")
    interval = stats.ttest_1samp(difference, 0.0).confidence_interval(1.0 - 2.0 * alpha)
    weaker = lower if lower.statistic <= -upper.statistic else upper
    return _tested(found, weaker, interval, max(lower.pvalue, upper.pvalue))


def sign_test(x: ArrayLike, y: ArrayLike) -> TestResult:
    """In how many participants each value is the smaller, with an exact p-value."""
    x, y = finite_pairs(x, y)
    own, other = int(np.sum(x < y)), int(np.sum(y < x))
    share = own / len(x) if len(x) else nan
    found = TestResult(n=len(x), effect_size=share, count_a=own, count_b=other)
    if reason := _too_few("The sign", own + other):
        return found.with_(reason=reason)
    return found.with_(p_value=float(stats.binomtest(own, own + other).pvalue))


def _too_few(which: str, pairs: int) -> str:
    if pairs >= MINIMUM_FOR_WILCOXON:
        return ""
    needs = f"{which} test needs {MINIMUM_FOR_WILCOXON} pairs that differ to reach p < 0.05"
    return f"{needs}, there are {pairs}."


def _why_no_t(x: NDArray[np.float64], y: NDArray[np.float64]) -> str:
    if len(x) < MINIMUM_PAIRS:
        return f"A paired t test needs {MINIMUM_PAIRS} pairs, there are {len(x)}."
    if is_constant(x - y, magnitude=_magnitude(x, y)):
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
    """Median of the means of all pairs, each value with itself too, which are counted, not formed:
    those of a large cohort would fill the memory."""
    ordered, own = np.sort(whole), np.arange(len(whole))

    def pairs_up_to(total: int) -> int:
        partners = np.searchsorted(ordered, total - ordered, side="right") - own
        return int(np.maximum(partners, 0).sum())

    count = len(ordered) * (len(ordered) + 1) // 2
    sums = range(2 * int(ordered[0]), 2 * int(ordered[-1]) + 1)
    places = (bisect_left(sums, k, key=pairs_up_to) for k in ((count + 1) // 2, count // 2 + 1))
    return sum(sums[place] for place in places) / 4.0


# --- more than two methods: one-way analysis of variance, and the one for repeated measures -------

# Hansen 2017 (table 3) compares force plate, OM and RM by a one-way ANOVA, as if they were three
# groups of people. They are the same people: `repeated_measures_anova` is the test for them.


def one_way_anova(groups: Sequence[ArrayLike], alpha: float = 0.05) -> tuple[TestResult, PostHoc]:
    """One-way ANOVA of independent groups (Fisher 1925), with eta squared = SS between / SS total.

    The post hoc t tests share the pooled variance and its degrees of freedom, as in SPSS and in
    R's pairwise.t.test; p and intervals are corrected for their number.

    groups : two or more samples of shape (n_i,), one unit. Values that are not finite are dropped.
    alpha : the post hoc intervals hold together at 1 - alpha.
    """
    samples = [finite_values(group) for group in groups]
    sizes = [len(sample) for sample in samples]
    reason = ""
    if len(samples) < 2:
        reason = f"An analysis of variance needs two groups, there are {len(samples)}."
    elif min(sizes) < 2:
        reason = f"Each group needs two values; there are {', '.join(map(str, sizes))}."
    elif _nothing_left(
        np.concatenate([sample - sample.mean() for sample in samples]), np.concatenate(samples)
    ):
        reason = "The values do not vary within the groups, so F has no finite value."
    found = TestResult(n=max(sizes, default=0), effect_size_name="eta squared", reason=reason)
    if reason:
        return found, {}
    pooled = np.concatenate(samples)
    ss_within = float(sum(np.sum((sample - sample.mean()) ** 2) for sample in samples))
    ss_total = float(np.sum((pooled - pooled.mean()) ** 2))
    df = float(len(pooled) - len(samples))
    f, p = map(float, stats.f_oneway(*samples))
    found = found.with_(statistic=f, df1=float(len(samples) - 1), df2=df, p_value=p)
    found = found.with_(effect_size=1.0 - ss_within / ss_total)
    pairs, after = list(combinations(range(len(samples)), 2)), {}
    critical = float(stats.t.isf(alpha / 2.0 / len(pairs), df))
    for i, j in pairs:
        d = float(samples[i].mean() - samples[j].mean())
        e = sqrt(ss_within / df * (1.0 / sizes[i] + 1.0 / sizes[j]))
        p = 2.0 * float(stats.t.sf(abs(d) / e, df))
        one = TestResult(difference=d, statistic=d / e, df1=df, p_value=p)
        after[i, j] = one.with_(ci_low=d - critical * e, ci_high=d + critical * e)
    return found, _bonferroni(after)


def repeated_measures_anova(matrix: ArrayLike, alpha: float = 0.05) -> tuple[TestResult, PostHoc]:
    """ANOVA of k measurements of the same n participants, with Bonferroni paired post hoc tests.

    epsilon = (tr S)^2 / ((k - 1) tr(S S)) with S the doubly centred covariance of the columns
    (Greenhouse and Geisser 1959, Psychometrika 24; Box 1954); p is at epsilon times both degrees
    of freedom. Partial eta squared = SS effect / (SS effect + SS error).

    matrix : shape (n, k), one row per participant. Rows with a value that is not finite are
        dropped; n says how many are left.
    alpha : the post hoc intervals hold together at 1 - alpha.
    ValueError: if matrix is not two-dimensional.
    """
    table = np.asarray(matrix, dtype=float)
    if table.ndim != 2:
        raise ValueError(f"matrix must have shape (participants, columns), not {table.shape}")
    table = table[np.isfinite(table).all(axis=1)]
    n, k = table.shape
    reason = ""
    if k < 2:
        reason = f"Repeated measures need two columns, there are {k}."
    elif n < 3:
        reason = f"Repeated measures need three complete participants, there are {n}."
    elif _nothing_left(_doubly_centred(table), table):
        reason = "All participants change alike, without any error, so F has no finite value."
    found = TestResult(n=n, effect_size_name="partial eta squared", reason=reason)
    if reason:
        return found, {}
    ss_effect = n * float(np.sum((table.mean(axis=0) - table.mean()) ** 2))
    ss_error = float(np.sum(_doubly_centred(table) ** 2))
    df_effect, df_error = float(k - 1), float((k - 1) * (n - 1))
    f = (ss_effect / df_effect) / (ss_error / df_error)
    covariance = _doubly_centred(np.cov(table, rowvar=False))
    epsilon = float(np.trace(covariance) ** 2 / ((k - 1) * np.sum(covariance**2)))
    pairs = list(combinations(range(k), 2))
    confidence = 1.0 - alpha / len(pairs)
    after = {(i, j): paired_t(table[:, i], table[:, j], confidence) for i, j in pairs}
    df1, df2 = epsilon * df_effect, epsilon * df_error
    p, share = float(stats.f.sf(f, df1, df2)), ss_effect / (ss_effect + ss_error)
    numbers = {"statistic": f, "df1": df1, "df2": df2, "p_value": p, "effect_size": share}
    return found.with_(**numbers, epsilon=epsilon), _bonferroni(after)


def _nothing_left(residual: NDArray[np.float64], values: NDArray[np.float64]) -> bool:
    return float(np.max(np.abs(residual))) <= ROUNDING * float(np.max(np.abs(values)))


def _doubly_centred(table: NDArray[np.float64]) -> NDArray[np.float64]:
    rows, columns = table.mean(axis=1, keepdims=True), table.mean(axis=0, keepdims=True)
    return table - rows - columns + table.mean()


def _bonferroni(tests: PostHoc) -> PostHoc:
    adjusted = adjusted_p_values([test.p_value for test in tests.values()], "bonferroni")
    pairs = zip(tests.items(), adjusted, strict=True)
    return {pair: test.with_(p_value=p) for (pair, test), p in pairs}


# --- does one computed signal correlate better with the measured one than another does? -----------

# Frames are not independent: pass the effective number of samples as n (it need not be whole).


def williams_t(r_mc1: float, r_mc2: float, r_c1c2: float, n: float) -> TestResult:
    """Test of two correlations that share one signal: measured with c1, measured with c2.

    t = (r_mc1 - r_mc2) sqrt((n - 1)(1 + r_c1c2) / (2 (n - 1)/(n - 3) |R| + rbar^2
    (1 - r_c1c2)^3)) with n - 3 degrees of freedom, |R| the determinant of the three
    correlations (Williams 1959; Steiger 1980, Psychological Bulletin 87, eq. 7); two-sided.

    r_mc1, r_mc2 : correlation of the measured with each computed signal.
    r_c1c2 : correlation of the two computed signals.
    n : independent samples; of two effective numbers the smaller.
    """
    found = TestResult(difference=r_mc1 - r_mc2)
    determinant = 1.0 - r_mc1**2 - r_mc2**2 - r_c1c2**2 + 2.0 * r_mc1 * r_mc2 * r_c1c2
    reason = _why_no_correlation(n, r_mc1, r_mc2, r_c1c2)
    if not reason and determinant < -SMALLEST_DETERMINANT:
        reason = (
            f"No three signals can have the correlations {r_mc1:.6g}, {r_mc2:.6g} and {r_c1c2:.6g}."
        )
    if reason:
        return found.with_(reason=reason)
    mean = (r_mc1 + r_mc2) / 2.0
    spread = 2.0 * (n - 1.0) / (n - 3.0) * max(determinant, 0.0) + mean**2 * (1.0 - r_c1c2) ** 3
    if spread < SMALLEST_DETERMINANT * (1.0 - r_c1c2):
        reason = "The three signals are linearly dependent, so the difference has no spread."
        return found.with_(reason=reason)
    t = found.difference * sqrt((n - 1.0) * (1.0 + r_c1c2) / spread)
    df = n - 3.0
    return found.with_(statistic=t, df1=df, p_value=2.0 * float(stats.t.sf(abs(t), df)))


def fisher_z_difference(r1: float, r2: float, n: float) -> TestResult:
    """Test of two correlations, of n independent samples each, as if the samples of one were not
    those of the other (Fisher 1921; Hansen 2014, 2.4); two-sided.

    z = (atanh r1 - atanh r2) / sqrt(2/(n - 3)). For two correlations with the same measured signal
    it is too timid: `williams_t` is the test for them.
    """
    found = TestResult(difference=r1 - r2)
    if reason := _why_no_correlation(n, r1, r2):
        return found.with_(reason=reason)
    z = (atanh(r1) - atanh(r2)) / sqrt(2.0 / (n - 3.0))
    return found.with_(statistic=z, p_value=2.0 * float(stats.norm.sf(abs(z))))


def _why_no_correlation(n: float, *correlations: float) -> str:
    if isnan(n) or n < MINIMUM_SAMPLES:
        count = "an unknown number" if isnan(n) else f"{n:.3g}"
        return f"The test needs {MINIMUM_SAMPLES:.0f} independent samples, there are {count}."
    if any(isnan(r) for r in correlations):
        return "A correlation is unknown, because one of the signals is constant or empty."
    if any(abs(r) > 1.0 for r in correlations):
        return f"A correlation lies outside -1..1: {', '.join(f'{r:.6g}' for r in correlations)}."
    if any(abs(r) > 1.0 - 1e-12 for r in correlations):
        return "A correlation is perfect, so its sampling error is zero."
    return ""
