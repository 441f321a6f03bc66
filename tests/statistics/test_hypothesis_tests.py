"""Against published examples and SciPy: paired samples, correlations, analysis of variance."""

from dataclasses import asdict
from itertools import product

import numpy as np
import pytest
from scipy import stats

from bsip_cli.statistics.hypothesis_tests import (
    cohens_d_pooled,
    equivalence_tost,
    fisher_z_difference,
    one_way_anova,
    paired_t,
    repeated_measures_anova,
    wilcoxon,
    williams_t,
)

# Student 1908; R's `sleep`: hours of sleep gained under two drugs by ten patients
DRUG_1 = [0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0.0, 2.0]
DRUG_2 = [1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4]

# Hollander and Wolfe 1973, p. 29; R's `?wilcox.test`: depression scale of nine patients
FIRST_VISIT = [1.83, 0.50, 1.62, 2.48, 1.68, 1.88, 1.55, 3.06, 1.30]
SECOND_VISIT = [0.878, 0.647, 0.598, 2.05, 1.06, 1.29, 1.06, 3.14, 1.29]


UNLIKE_BY_COLUMN = np.arange(6.0)[:, None] + [0.1, 0.2, 0.4]


def numbers(result, *names):
    values = asdict(result)
    return [values[name] for name in names]


def test_sleep_data():
    """R: t.test(extra ~ group, data = sleep, paired = TRUE)."""
    test = paired_t(DRUG_1, DRUG_2)
    assert test.statistic == pytest.approx(-4.0621, abs=5e-5)
    assert test.df1 == 9
    assert test.p_value == pytest.approx(0.002833, abs=5e-7)
    assert (test.ci_low, test.ci_high) == pytest.approx((-2.4598858, -0.7001142), abs=1e-7)
    assert test.difference == pytest.approx(-1.58)
    assert test.reason == ""


@pytest.mark.parametrize(
    ("om", "rm", "ci", "d"),
    [
        ((8.79, 1.10), (8.85, 1.11), (-0.10, -0.01), 0.05),  # lower torso
        ((0.95, 0.25), (0.37, 0.05), (0.42, 0.72), -3.21),  # left hand
        ((7.14, 0.95), (7.66, 0.96), (-0.60, -0.46), 0.55),  # left thigh
        ((1.02, 0.24), (0.75, 0.09), (0.17, 0.38), -1.52),  # right foot
    ],
)
def test_conventions_of_hansen_2017_table_1(om, rm, ci, d):
    """x = OM, y = RM: the printed interval is of x - y, the printed d of y - x."""
    assert np.mean(ci) == pytest.approx(om[0] - rm[0], abs=0.011)
    assert cohens_d_pooled(*om, *rm) == pytest.approx(d, abs=0.04)  # two printed digits


def test_incomplete_pairs_are_dropped():
    x, y = [*DRUG_1, np.nan, 4.0, np.inf], [*DRUG_2, 1.0, np.nan, 1.0]
    assert paired_t(x, y) == paired_t(DRUG_1, DRUG_2)
    assert wilcoxon(x, y) == wilcoxon(DRUG_1, DRUG_2)
    assert equivalence_tost(x, y, 1.0) == equivalence_tost(DRUG_1, DRUG_2, 1.0)


@pytest.mark.parametrize(
    ("x", "y", "words"),
    [
        ([], [], "there are 0"),
        ([1.0, 2.0], [1.5, 2.7], "needs 3 pairs"),
        ([1.0, 2.0, np.nan], [1.5, 2.7, 4.0], "there are 2"),
        ([1.0, 2.0, 3.0, 4.0], [1.0, 2.0, 3.0, 4.0], "All differences are equal"),
        ([1.1, 2.3, 3.7], [1.2, 2.4, 3.8], "All differences are equal"),
        ([0.1] * 9, [0.3] * 9, "All differences are equal"),
    ],
)
def test_t_not_possible(x, y, words):
    for result in (paired_t(x, y), equivalence_tost(x, y, 1.0)):
        assert words in result.reason
        assert np.isnan(numbers(result, "df1", "p_value", "ci_low", "ci_high")).all()


def test_what_is_known_is_given_even_without_a_test():
    test = paired_t([1.0, 2.0], [1.5, 2.7])
    assert (test.mean_a, test.mean_b, test.n) == (1.5, pytest.approx(2.1), 2)
    assert np.isnan(cohens_d_pooled(0.1, 0.0, 0.3, 0.0))
    assert paired_t([0.1] * 9, [0.3] * 9).sd_a == 0.0


def test_depression_data():
    """R: wilcox.test(x, y, paired = TRUE): V = 40, two-sided p = 0.03906."""
    test = wilcoxon(FIRST_VISIT, SECOND_VISIT)
    assert test.statistic == 45 - 40
    assert test.p_value == pytest.approx(0.0390625)
    assert test.effect_size == pytest.approx((40 - 5) / 45)
    assert test.difference == pytest.approx(0.46, abs=0.005)


@pytest.mark.parametrize("n", [1, 2, 3, 10, 57, 300])
@pytest.mark.parametrize("digits", [0, 2, 12])
def test_hodges_lehmann_is_the_median_of_all_pairs_means(n, digits):
    """With ties (few digits) and without, an even and an odd number of pairs."""
    rng = np.random.default_rng([n, digits])
    x, y = np.round(rng.normal(1.0, 2.0, (2, n)), digits)
    rows, columns = np.triu_indices(n)
    means = ((x - y)[rows] + (x - y)[columns]) / 2
    assert wilcoxon(x, y).difference == pytest.approx(np.median(means), abs=1e-10)


def test_hodges_lehmann_of_a_large_cohort_forms_no_pairs():
    """A hundred thousand values have five thousand million pairs."""
    x = np.random.default_rng(4).standard_cauchy(100_000) + 3.0
    assert wilcoxon(x, np.zeros(len(x))).difference == pytest.approx(3.0, abs=0.05)


def test_ties_by_all_sign_flips():
    x = np.array([1.0, 1, 2, 2, 3, -1, 4, 5, 0])
    test = wilcoxon(x, np.zeros(9))
    ranks = stats.rankdata(np.abs(x[:8]))
    sums = np.array([np.dot(signs, ranks) for signs in product([0, 1], repeat=8)])
    observed = ranks[x[:8] > 0].sum()
    assert test.p_value == pytest.approx(2 * np.mean(sums >= observed))
    assert test.n == 9


def test_ties_hidden_by_rounding():
    x, y = np.array([1.1, 2.3, 3.7, 0.4, 5.2, 8.8, 9.1]), np.zeros(7) + 0.1
    assert wilcoxon(x + 0.1, x).statistic == 0.0
    assert wilcoxon(x + 0.1, x).p_value == pytest.approx(2 / 2**7)
    assert "there are 0" in wilcoxon(x + y - 0.1, x).reason


def test_many_ties_are_asymptotic():
    x = np.round(np.random.default_rng(0).normal(0.3, 1, size=40), 1)
    nonzero = x[x != 0]
    expected = stats.wilcoxon(nonzero, method="asymptotic").pvalue
    assert wilcoxon(x, np.zeros(40)).p_value == pytest.approx(expected)


@pytest.mark.parametrize("bound", [0.5, 2.0, 4.0])
def test_tost_against_statsmodels(bound):
    from statsmodels.stats.weightstats import ttost_paired

    expected = ttost_paired(np.array(DRUG_1), np.array(DRUG_2), -bound, bound)
    test = equivalence_tost(DRUG_1, DRUG_2, bound)
    assert test.p_value == pytest.approx(expected[0])
    assert test.statistic == pytest.approx(min(expected[1][0], expected[2][0], key=abs))
    inside = -bound < test.ci_low and test.ci_high < bound
    assert (test.p_value < 0.05) is inside
    assert inside is (bound == 4.0)


def test_shapes_must_match():
    for test in (paired_t, wilcoxon):
        with pytest.raises(ValueError, match="shapes"):
            test([1.0, 2.0], [1.0])


# --- correlation tests ----------------------------------------------------------------------------


def test_williams_of_steiger():
    """R's psych: r.test(n = 103, r12 = .4, r13 = .5, r23 = .1): t = -0.89, p < 0.37."""
    test = williams_t(0.4, 0.5, 0.1, 103)
    assert test.statistic == pytest.approx(-0.89, abs=0.005)
    assert test.p_value == pytest.approx(0.37, abs=0.006)
    assert test.df1 == 100
    assert williams_t(0.99, 0.9, 0.92, 47.3).df1 == pytest.approx(44.3)  # effective numbers


def test_williams_is_antisymmetric():
    assert williams_t(0.5, 0.4, 0.1, 103).statistic == -williams_t(0.4, 0.5, 0.1, 103).statistic
    assert williams_t(0.4, 0.4, 0.1, 103).p_value == pytest.approx(1.0)


def test_williams_holds_its_level_where_fisher_is_too_timid():
    rng = np.random.default_rng(0)
    rejected = np.zeros((1000, 2))
    for i in range(1000):
        measured = rng.normal(size=40)
        shared = rng.normal(size=40)  # both computed signals err alike, and each on its own
        computed = [measured + shared + 0.5 * rng.normal(size=40) for _ in range(2)]
        (_, r1, r2), (_, _, r12), _ = np.corrcoef([measured, *computed])
        rejected[i] = [
            williams_t(r1, r2, r12, 40).p_value < 0.05,
            fisher_z_difference(r1, r2, 40).p_value < 0.05,
        ]
    assert rejected[:, 0].mean() == pytest.approx(0.05, abs=0.02)
    assert rejected[:, 1].mean() < 0.01


def test_fisher_z():
    """Fisher's own kind of example: atanh 0.5 - atanh 0.3 = 0.2398, se = sqrt(2/47)."""
    test = fisher_z_difference(0.5, 0.3, 50)
    assert test.statistic * np.sqrt(2 / 47) == pytest.approx(0.23979, abs=1e-5)
    assert test.statistic == pytest.approx(1.1624, abs=1e-4)
    assert test.p_value == pytest.approx(0.2451, abs=1e-4)


# --- anova ----------------------------------------------------------------------------------------


# Dobson 1983; R's `PlantGrowth`
CONTROL = [4.17, 5.58, 5.18, 6.11, 4.50, 4.61, 5.17, 4.53, 5.33, 5.14]
TREATMENT_1 = [4.81, 4.17, 4.41, 3.59, 5.87, 3.83, 6.03, 4.89, 4.32, 4.69]
TREATMENT_2 = [6.31, 5.12, 5.54, 5.50, 5.37, 5.29, 4.92, 6.15, 5.80, 5.26]

# Field 2009, Discovering statistics using SPSS, ch. 13: seconds until eight people retch
BUSHTUCKER = np.array(
    [
        [8, 7, 1, 6],
        [9, 5, 2, 5],
        [6, 2, 3, 8],
        [5, 3, 1, 9],
        [8, 4, 5, 8],
        [7, 5, 6, 7],
        [10, 2, 7, 2],
        [12, 6, 8, 1],
    ]
)


def test_plant_growth():
    """R: summary(aov(weight ~ group, PlantGrowth)); pairwise.t.test(..., "bonferroni")."""
    test, post_hoc = one_way_anova([CONTROL, TREATMENT_1, TREATMENT_2])
    assert test.statistic == pytest.approx(4.846, abs=5e-4)
    assert test.p_value == pytest.approx(0.01591, abs=5e-6)
    assert (test.df1, test.df2) == (2, 27)
    assert test.effect_size == pytest.approx(3.766 / (3.766 + 10.492), abs=1e-4)
    assert list(post_hoc) == [(0, 1), (0, 2), (1, 2)]
    assert [c.p_value for c in post_hoc.values()] == pytest.approx([0.583, 0.263, 0.013], abs=5e-4)


def test_two_groups_are_a_t_test():
    test, post_hoc = one_way_anova([CONTROL, TREATMENT_1[:7]])
    expected = stats.ttest_ind(CONTROL, TREATMENT_1[:7])
    assert test.statistic == pytest.approx(expected.statistic**2)
    (pair,) = post_hoc.values()
    assert (pair.statistic, pair.p_value) == pytest.approx((expected.statistic, expected.pvalue))
    interval = expected.confidence_interval(0.95)
    assert (pair.ci_low, pair.ci_high) == pytest.approx((interval.low, interval.high))


def test_bushtucker():
    """Field, SPSS output 13.2 to 13.4: F(3, 21) = 3.79, epsilon 0.533, p 0.026 and 0.063."""
    test, _post_hoc = repeated_measures_anova(BUSHTUCKER)
    assert test.statistic == pytest.approx(3.794, abs=5e-4)
    assert test.epsilon == pytest.approx(0.533, abs=5e-4)
    assert (test.df1, test.df2) == pytest.approx((3 * test.epsilon, 21 * test.epsilon))
    assert stats.f.sf(test.statistic, 3, 21) == pytest.approx(0.026, abs=5e-4)
    assert test.p_value == pytest.approx(0.063, abs=5e-4)
    assert test.effect_size == pytest.approx(83.13 / (83.13 + 153.38), abs=1e-4)


def test_two_columns_are_a_paired_t_test():
    test, post_hoc = repeated_measures_anova(BUSHTUCKER[:, :2])
    expected = stats.ttest_rel(BUSHTUCKER[:, 0], BUSHTUCKER[:, 1])
    assert test.epsilon == pytest.approx(1.0)
    assert test.statistic == pytest.approx(expected.statistic**2)
    assert test.p_value == pytest.approx(expected.pvalue)
    (pair,) = post_hoc.values()
    assert pair.p_value == pytest.approx(expected.pvalue)


def test_post_hoc_is_paired_and_corrected():
    _test, post_hoc = repeated_measures_anova(BUSHTUCKER)
    assert len(post_hoc) == 6
    pair = post_hoc[0, 2]
    expected = stats.ttest_rel(BUSHTUCKER[:, 0], BUSHTUCKER[:, 2])
    assert pair.p_value == pytest.approx(min(1.0, 6 * expected.pvalue))
    interval = expected.confidence_interval(1 - 0.05 / 6)
    assert (pair.ci_low, pair.ci_high) == pytest.approx((interval.low, interval.high))


def test_incomplete_rows_are_dropped():
    holed = np.vstack([BUSHTUCKER, [1.0, 2.0, np.nan, 3.0]])
    assert repeated_measures_anova(holed) == repeated_measures_anova(BUSHTUCKER)


def test_two_equal_columns_leave_the_other_comparisons():
    table = BUSHTUCKER[:, [0, 0, 1]]
    test, post_hoc = repeated_measures_anova(table)
    assert test.reason == ""
    assert "equal" in post_hoc[0, 1].reason
    assert np.isnan(post_hoc[0, 1].p_value)
    assert np.isfinite(post_hoc[0, 2].p_value)


# --- what is not possible -------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("test", "arguments", "words"),
    [
        (wilcoxon, ([], []), "needs 6 pairs"),
        (wilcoxon, ([1.0], [-1.0]), "needs 6 pairs"),
        (wilcoxon, (np.arange(5) + 1.0, -np.arange(5) - 1.0), "needs 6 pairs"),
        (wilcoxon, (np.ones(12), np.ones(12)), "there are 0"),
        *(
            (equivalence_tost, (DRUG_1, DRUG_2, x), "positive bound")
            for x in (0, -1, np.nan, np.inf)
        ),
        (williams_t, (0.4, 0.5, 0.1, 3.5), "needs 4 independent samples, there are 3.5"),
        (williams_t, (0.4, 0.5, 0.1, np.nan), "unknown number"),
        (williams_t, (0.4, np.nan, 0.1, 50), "unknown"),
        (williams_t, (1.0, 0.5, 0.5, 50), "perfect"),
        (williams_t, (0.4, 0.4, 1.0, 50), "perfect"),
        (williams_t, (0.4, 1.4, 0.1, 50), "outside -1..1"),
        (williams_t, (0.9, -0.9, 0.9, 50), "No three signals"),
        (fisher_z_difference, (0.4, 0.5, 3), "there are 3"),
        (fisher_z_difference, (0.4, 0.5, np.nan), "unknown number"),
        (fisher_z_difference, (-1.0, 0.5, 50), "perfect"),
        (one_way_anova, ([],), "needs two groups"),
        (one_way_anova, ([[1.0, 2.0]],), "there are 1"),
        (one_way_anova, ([[1.0, 2.0], [3.0, np.nan]],), "there are 2, 1"),
        (one_way_anova, ([[0.1] * 5, [0.3] * 5],), "do not vary within"),
        (one_way_anova, ([[0.1] * 5, [0.1] * 5],), "do not vary within"),
        (repeated_measures_anova, (np.empty((0, 3)),), "there are 0"),
        (repeated_measures_anova, (BUSHTUCKER[:2],), "three complete participants, there are 2"),
        (repeated_measures_anova, (BUSHTUCKER[:, :1],), "two columns"),
        (repeated_measures_anova, (np.full((6, 3), 0.1),), "without any error"),
        (repeated_measures_anova, (UNLIKE_BY_COLUMN,), "without any error"),
    ],
)
def test_not_possible(test, arguments, words):
    result = test(*arguments)
    result, post_hoc = result if isinstance(result, tuple) else (result, {})
    assert words in result.reason
    assert np.isnan(numbers(result, "statistic", "p_value", "effect_size", "epsilon")).all()
    assert post_hoc == {}


def test_matrix_must_be_a_matrix():
    with pytest.raises(ValueError, match="participants"):
        repeated_measures_anova([1.0, 2.0])
