import numpy as np
import pytest
from scipy import stats

from bsip_cli.statistics.hypothesis_tests import one_way_anova, repeated_measures_anova

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


@pytest.mark.parametrize(
    ("groups", "words"),
    [
        ([], "needs two groups"),
        ([[1.0, 2.0]], "there are 1"),
        ([[1.0, 2.0], [3.0, np.nan]], "there are 2, 1"),
        ([[0.1] * 5, [0.3] * 5], "do not vary within"),
        ([[0.1] * 5, [0.1] * 5], "do not vary within"),
    ],
)
def test_one_way_not_possible(groups, words):
    test, post_hoc = one_way_anova(groups)
    assert words in test.reason
    assert np.isnan([test.statistic, test.p_value, test.effect_size]).all()
    assert post_hoc == {}


def test_bushtucker():
    """Field, SPSS output 13.2 to 13.4: F(3, 21) = 3.79, epsilon 0.533, p 0.026 and 0.063."""
    test, _post_hoc = repeated_measures_anova(BUSHTUCKER)
    assert test.statistic == pytest.approx(3.794, abs=5e-4)
    assert test.epsilon == pytest.approx(0.533, abs=5e-4)
    assert (test.df1, test.df2) == pytest.approx((3 * test.epsilon, 21 * test.epsilon))
    assert stats.f.sf(test.statistic, 3, 21) == pytest.approx(0.026, abs=5e-4)
    assert test.p_value == pytest.approx(0.063, abs=5e-4)
    assert test.effect_size == pytest.approx(83.13 / (83.13 + 153.38), abs=1e-4)


def test_epsilon_by_orthonormal_contrasts():
    """An independent way: eigenvalues of the covariance of orthonormal contrasts (Box 1954)."""
    helmert = np.array([[1, -1, 0, 0], [1, 1, -2, 0], [1, 1, 1, -3.0]])
    helmert /= np.linalg.norm(helmert, axis=1, keepdims=True)
    eigenvalues = np.linalg.eigvalsh(np.cov(helmert @ BUSHTUCKER.T))
    expected = eigenvalues.sum() ** 2 / (3 * (eigenvalues**2).sum())
    assert repeated_measures_anova(BUSHTUCKER)[0].epsilon == pytest.approx(expected)


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


@pytest.mark.parametrize(
    ("matrix", "words"),
    [
        (np.empty((0, 3)), "there are 0"),
        (BUSHTUCKER[:2], "needs? three complete participants, there are 2"),
        (BUSHTUCKER[:, :1], "two columns"),
        (np.full((6, 3), 0.1), "without any error"),
        (np.arange(6.0)[:, None] + [0.1, 0.2, 0.4], "without any error"),
    ],
)
def test_repeated_measures_not_possible(matrix, words):
    import re

    test, _post_hoc = repeated_measures_anova(matrix)
    assert re.search(words, test.reason)
    assert np.isnan([test.statistic, test.p_value, test.epsilon]).all()


def test_matrix_must_be_a_matrix():
    with pytest.raises(ValueError, match="participants"):
        repeated_measures_anova([1.0, 2.0])
