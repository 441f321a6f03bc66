import numpy as np
import pytest

from bsip_cli.statistics.samples import finite_stretches, joined, stretches_of


def test_runs_of_true():
    assert stretches_of([0, 1, 1, 0, 1]) == [(1, 3), (4, 5)]
    assert stretches_of([]) == []
    assert stretches_of([True, True]) == [(0, 2)]


def test_split_at_what_is_not_finite_and_keep_given_breaks():
    x = np.array([0.0, 1.0, np.nan, 3.0, 4.0, 5.0])
    y = np.array([0.0, 1.0, 2.0, 3.0, np.inf, 5.0])
    assert finite_stretches(None, x) == [(0, 2), (3, 6)]
    assert finite_stretches([(3, 6), (0, 3)], x, y) == [(0, 2), (3, 4), (5, 6)]
    assert finite_stretches([(0, 1), (1, 2)], x) == [(0, 1), (1, 2)]
    assert finite_stretches([], x) == []
    assert joined(x, [(0, 2), (5, 6)]).tolist() == [0.0, 1.0, 5.0]


@pytest.mark.parametrize("stretches", [[(0, 7)], [(-1, 2)], [(3, 2)], [(0, 3), (2, 4)]])
def test_stretches_that_do_not_fit(stretches):
    with pytest.raises(ValueError, match="stretch"):
        finite_stretches(stretches, np.zeros(6))


def test_signals_of_different_length():
    with pytest.raises(ValueError, match="shape"):
        finite_stretches(None, np.zeros(6), np.zeros(5))
