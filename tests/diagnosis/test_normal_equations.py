"""Eliminating each trial's own coefficients gives the posterior of all of them at once."""

import numpy as np
import pytest

from bsip_cli.diagnosis.normal_equations import Equations, solved, summed

COUNT = 14
USED = ([0, 1, 2, 3, 4, 5], [0, 2, 6, 7, 8], [9, 1, 2, 10], [0, 1])  # 11 to 13 nowhere


def equations_of(used: list[int], rng: np.random.Generator) -> Equations:
    columns, right = rng.standard_normal((20, len(used))), rng.standard_normal(20)
    return Equations(np.array(used), columns.T @ columns, columns.T @ right)


@pytest.mark.parametrize("trials", [USED, USED[:1], ([0, 1], [0, 1])])
def test_the_same_as_all_at_once(trials):
    rng = np.random.default_rng(0)
    equations = [equations_of(used, rng) for used in trials]
    root = rng.uniform(0.1, 3.0, COUNT)
    root[2] = 0.0  # one that stays zero
    gram, against = summed(equations, COUNT)
    inner = np.eye(COUNT) + gram * np.outer(root, root)
    covariance = np.linalg.inv(inner) * np.outer(root, root)
    found = solved(equations, root)
    np.testing.assert_allclose(found.covariance, covariance, atol=1e-12)
    np.testing.assert_allclose(found.variance, np.diag(covariance), atol=1e-12)
    np.testing.assert_allclose(found.mean, covariance @ against, atol=1e-12)
    assert found.log_determinant == pytest.approx(np.linalg.slogdet(inner)[1])
    for t, one in enumerate(equations):
        alone, together = found.roots(t)
        for s, other in enumerate(equations):
            across = together.T @ found.roots(s)[1] + (alone.T @ alone if s == t else 0.0)
            expected = covariance[np.ix_(one.used, other.used)]
            np.testing.assert_allclose(across, expected, atol=1e-12)
