from dataclasses import asdict
from itertools import product

import numpy as np
import pytest
from scipy import stats

from bsip_cli.statistics.hypothesis_tests import (
    cohens_d_pooled,
    d_of_differences,
    equivalence_tost,
    paired_t,
    wilcoxon,
)

# Student 1908; R's `sleep`: hours of sleep gained under two drugs by ten patients
DRUG_1 = [0.7, -1.6, -0.2, -1.2, -0.1, 3.4, 3.7, 0.8, 0.0, 2.0]
DRUG_2 = [1.9, 0.8, 1.1, 0.1, -0.1, 4.4, 5.5, 1.6, 4.6, 3.4]

# Hollander and Wolfe 1973, p. 29; R's `?wilcox.test`: depression scale of nine patients
FIRST_VISIT = [1.83, 0.50, 1.62, 2.48, 1.68, 1.88, 1.55, 3.06, 1.30]
SECOND_VISIT = [0.878, 0.647, 0.598, 2.05, 1.06, 1.29, 1.06, 3.14, 1.29]


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
    assert d_of_differences(DRUG_1, DRUG_2) == pytest.approx(test.statistic / np.sqrt(10))
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
    assert np.isnan(d_of_differences(x, y))


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


@pytest.mark.parametrize("n", [0, 1, 5])
def test_wilcoxon_not_possible(n):
    x = np.arange(n) + 1.0
    test = wilcoxon(x, -x)
    assert "needs 6 pairs" in test.reason
    assert np.isnan(numbers(test, "statistic", "p_value", "effect_size")).all()
    assert "there are 0" in wilcoxon(np.ones(12), np.ones(12)).reason


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


@pytest.mark.parametrize("bound", [0.0, -1.0, np.nan, np.inf])
def test_tost_needs_a_bound(bound):
    test = equivalence_tost(DRUG_1, DRUG_2, bound)
    assert "positive bound" in test.reason
    assert np.isnan(test.p_value)


def test_shapes_must_match():
    for test in (paired_t, wilcoxon):
        with pytest.raises(ValueError, match="shapes"):
            test([1.0, 2.0], [1.0])
