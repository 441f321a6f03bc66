import numpy as np
import pytest

from bsip_cli.statistics.samples import adjusted_p_values, lilliefors_test


def test_nan_is_dropped():
    x = np.random.default_rng(3).normal(size=12)
    assert lilliefors_test([*x, np.nan]) == lilliefors_test(x)


@pytest.mark.parametrize(
    ("x", "n", "words"),
    [([], 0, "needs 4"), ([1, 2, 3, np.nan], 3, "there are 3"), ([0.1] * 12, 12, "equal")],
)
def test_not_possible(x, n, words):
    test = lilliefors_test(x)
    assert test.n == n
    assert np.isnan([test.statistic, test.p_value]).all()
    assert words in test.reason


def test_holm_and_bonferroni():
    """R: p.adjust(c(0.01, 0.04, 0.03, 0.005), "holm")."""
    p = [0.01, 0.04, 0.03, 0.005]
    assert adjusted_p_values(p) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert adjusted_p_values(p, "bonferroni") == pytest.approx([0.04, 0.16, 0.12, 0.02])


def test_impossible_tests_do_not_count():
    adjusted = adjusted_p_values([0.01, np.nan, 0.04])
    assert adjusted[::2] == pytest.approx([0.02, 0.04])
    assert np.isnan(adjusted[1])
    assert adjusted_p_values([]) == ()
    assert np.isnan(adjusted_p_values([np.nan])).all()
    with pytest.raises(ValueError, match="outside"):
        adjusted_p_values([1.2])
