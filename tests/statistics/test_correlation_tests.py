import numpy as np
import pytest

from bsip_cli.statistics.hypothesis_tests import fisher_z_difference, williams_t


def test_williams_of_steiger():
    """R's psych: r.test(n = 103, r12 = .4, r13 = .5, r23 = .1): t = -0.89, p < 0.37."""
    test = williams_t(0.4, 0.5, 0.1, 103)
    assert test.statistic == pytest.approx(-0.89, abs=0.005)
    assert test.p_value == pytest.approx(0.37, abs=0.006)
    assert test.df1 == 100


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
            fisher_z_difference(r1, 40, r2, 40).p_value < 0.05,
        ]
    assert rejected[:, 0].mean() == pytest.approx(0.05, abs=0.02)
    assert rejected[:, 1].mean() < 0.01


def test_effective_numbers_need_not_be_whole():
    assert williams_t(0.99, 0.9, 0.92, 47.3).df1 == pytest.approx(44.3)


def test_fisher_z():
    """Fisher's own kind of example: atanh 0.5 - atanh 0.3 = 0.2398, se = sqrt(2/47)."""
    test = fisher_z_difference(0.5, 50, 0.3, 50)
    assert test.statistic * np.sqrt(2 / 47) == pytest.approx(0.23979, abs=1e-5)
    assert test.statistic == pytest.approx(1.1624, abs=1e-4)
    assert test.p_value == pytest.approx(0.2451, abs=1e-4)


def test_fisher_scatters_as_a_standard_normal():
    rng = np.random.default_rng(1)
    z = []
    for _ in range(1000):
        (x1, y1), (x2, y2) = (
            rng.multivariate_normal([0, 0], [[1, 0.6], [0.6, 1]], n).T for n in (25, 40)
        )
        z.append(
            fisher_z_difference(
                np.corrcoef(x1, y1)[0, 1], 25, np.corrcoef(x2, y2)[0, 1], 40
            ).statistic
        )
    assert np.std(z) == pytest.approx(1.0, abs=0.07)


@pytest.mark.parametrize(
    ("test", "arguments", "words"),
    [
        (williams_t, (0.4, 0.5, 0.1, 3.5), "needs 4 independent samples, there are 3.5"),
        (williams_t, (0.4, 0.5, 0.1, np.nan), "unknown number"),
        (williams_t, (0.4, np.nan, 0.1, 50), "unknown"),
        (williams_t, (1.0, 0.5, 0.5, 50), "perfect"),
        (williams_t, (0.4, 0.4, 1.0, 50), "perfect"),
        (williams_t, (0.4, 1.4, 0.1, 50), "outside -1..1"),
        (williams_t, (0.9, -0.9, 0.9, 50), "No three signals"),
        (fisher_z_difference, (0.4, 50, 0.5, 3), "there are 3"),
        (fisher_z_difference, (0.4, np.nan, 0.5, 30), "unknown number"),
        (fisher_z_difference, (-1.0, 50, 0.5, 30), "perfect"),
    ],
)
def test_not_possible(test, arguments, words):
    result = test(*arguments)
    assert words in result.reason
    assert np.isnan([result.statistic, result.p_value]).all()
