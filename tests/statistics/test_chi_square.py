"""The far tail of the chi-square distribution."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2

from bsip_cli.statistics.chi_square import minus_log_p

DEGREES = [1, 2, 3, 6, 10]


@pytest.mark.parametrize("degrees", DEGREES)
def test_where_a_float_can_hold_it(degrees):
    x = np.linspace(0, 600, 50)
    np.testing.assert_allclose(minus_log_p(x, degrees), -np.log(chi2.sf(x, degrees)), rtol=1e-9)


@pytest.mark.parametrize("degrees", DEGREES)
def test_beyond_it_goes_on_without_a_step(degrees):
    """The slope of -log p tends to one half."""
    x = np.arange(990.0, 1010.0, 0.01)
    steps = np.diff(minus_log_p(x, degrees))
    assert (steps > 0).all()
    np.testing.assert_allclose(steps, 0.005, rtol=0.02)
    far = minus_log_p(np.array([1e4, 1e6, 1e9]), degrees)
    np.testing.assert_allclose(far, [5e3, 5e5, 5e8], rtol=0.01)


def test_two_degrees_are_exact_everywhere():
    x = np.array([1.0, 999.0, 1001.0, 1e7])
    np.testing.assert_allclose(minus_log_p(x, 2), x / 2, rtol=1e-12)


def test_what_gains_nothing_is_no_surprise():
    """A residual that grows has a negative statistic."""
    assert minus_log_p(-3.0, 2) == 0
    more = minus_log_p(2000.0, 1), minus_log_p(2000.0, 3)
    assert more[0] > more[1]  # with more free numbers chance brings as much more often
