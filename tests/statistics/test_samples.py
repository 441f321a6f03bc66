"""Independent samples, normality, p values of several tests."""

import numpy as np
import pytest
from scipy.signal import lfilter

from bsip_cli.statistics.samples import (
    adjusted_p_values,
    effective_samples,
    effective_samples_of_pair,
    lilliefors_test,
)

N = 12_000


def autoregressive(coefficients, n, runs, seed):
    noise = np.random.default_rng(seed).normal(size=(runs, n + 500))
    return lfilter([1.0], coefficients, noise, axis=1)[:, 500:]


@pytest.mark.parametrize("a", [0.0, 0.5, 0.9, 0.97])
def test_mean_of_ar1(a):
    counted = [effective_samples(x) for x in autoregressive([1.0, -a], N, 20, seed=1)]
    assert np.mean(counted) == pytest.approx(N * (1 - a) / (1 + a), rel=0.12)


@pytest.mark.parametrize("a", [-0.5, 0.0, 0.5, 0.9])
def test_correlation_of_two_ar1(a):
    x, y = np.split(autoregressive([1.0, -a], N, 20, seed=2), 2)
    counted = [effective_samples_of_pair(u, v) for u, v in zip(x, y, strict=True)]
    assert np.mean(counted) == pytest.approx(N * (1 - a**2) / (1 + a**2), rel=0.08)


def test_correlation_of_oscillations_scatters_as_the_effective_samples_say():
    damped = [1.0, -2 * 0.98 * np.cos(2 * np.pi * 0.01), 0.98**2]
    x, y = np.split(autoregressive(damped, 3000, 600, seed=3), 2)
    scatter = np.std([np.corrcoef(u, v)[0, 1] for u, v in zip(x, y, strict=True)])
    counted = np.mean([effective_samples_of_pair(u, v) for u, v in zip(x, y, strict=True)])
    assert 1 / scatter**2 == pytest.approx(counted, rel=0.25)


def test_two_nearly_equal_oscillations_do_not_end_the_sum_at_their_zero_crossings():
    damped = [1.0, -2 * 0.98 * np.cos(2 * np.pi * 0.01), 0.98**2]
    x, y = autoregressive(damped, 3000, 2, seed=4)
    assert effective_samples_of_pair(x, x + 0.05 * y) < 150


def test_alternating_series_is_worth_no_more_than_its_length():
    (x,) = autoregressive([1.0, 0.8], N, 1, seed=5)
    assert effective_samples(x) == N


def test_gaps_count_as_time():
    series = autoregressive([1.0, -0.9], N, 20, seed=6)
    series[:, np.arange(N) % 400 >= 300] = np.nan
    counted = np.mean([effective_samples(x) for x in series])
    assert counted == pytest.approx(0.75 * N * 0.1 / 1.9, rel=0.12)


def test_what_is_missing_at_the_ends_does_not_count():
    x, y = autoregressive([1.0, -0.9], N, 2, seed=7)
    longer = [np.concatenate([np.full(70, np.nan), one, np.full(30, np.inf)]) for one in (x, y)]
    assert effective_samples(longer[0]) == effective_samples(x)
    assert effective_samples_of_pair(*longer) == effective_samples_of_pair(x, y)


def test_signals_of_different_length():
    with pytest.raises(ValueError, match="shape"):
        effective_samples_of_pair(np.zeros(6), np.zeros(5))


@pytest.mark.parametrize("x", [[], [1.0, 2.0, 3.0], np.full(100, 0.1), np.full(9, np.nan)])
def test_no_answer(x):
    assert np.isnan(effective_samples(x))
    assert np.isnan(effective_samples_of_pair(x, x))


# --- normality and p values -----------------------------------------------------------------------


def test_nan_is_dropped():
    x = np.random.default_rng(3).normal(size=12)
    assert lilliefors_test([*x, np.nan]) == lilliefors_test(x)


@pytest.mark.parametrize(
    ("x", "n", "words"),
    [([], 0, "needs 4"), ([1, 2, 3, np.nan], 3, "there are 3"), ([0.1] * 12, 12, "equal")],
)
def test_lilliefors_not_possible(x, n, words):
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
