"""What the data can know beside the table, and how it is said."""

import numpy as np
import pytest

from bsip_cli.identification.hansen2017 import estimate
from bsip_cli.identification.uncertainty import beforehand, excitation, in_words, readable
from tests.identification.synthetic_identification import (
    problem_of,
    regressor,
    without_segment,
    world,
)


def problem(stride: int = 25, noise: float = 5.0):
    rows = regressor()[::stride]
    return problem_of(rows, rows @ world().phi_true, noise)


def test_without_data_everything_is_the_tables():
    before = beforehand(problem())
    np.testing.assert_allclose(before.share(np.zeros((150, 150))), 0.0, atol=1e-9)


def test_the_same_from_the_side_of_the_measurements():
    """Information form against covariance form (Kalman's): the same linear Gaussian update."""
    rows = regressor()[::100].reshape(-1, 150) / 5.0
    before = beforehand(problem())
    seen = before.seen @ before.seen.T
    cross = before.readable @ before.seen.T
    gain = cross @ rows.T @ np.linalg.inv(rows @ seen @ rows.T + np.eye(len(rows)))
    left = before.readable @ before.readable.T - gain @ rows @ cross.T
    np.testing.assert_allclose(before.covariance(rows.T @ rows), left, atol=1e-7)


def test_what_the_estimators_say_where_the_data_are_strong():
    """hansen2017 drops the table's part of a known direction: alike where the data are strong."""
    sharp = problem(stride=4, noise=0.3)
    information, _ = sharp.trusted_equations()
    share = beforehand(sharp).share(information)
    own = readable(estimate(sharp), sharp.prior).share
    assert (own > 0.95).sum() > 30
    np.testing.assert_allclose(share[own > 0.95], own[own > 0.95], atol=0.05)


def test_combinations_that_the_data_know():
    """A segment that hangs without weight in the wrench is not excited; the others are."""
    rows, arm = without_segment("forearm_l"), world().person.skeleton.index("forearm_l")
    found = excitation(problem_of(rows, rows @ world().phi_true, 5.0))
    assert found.combinations[arm] == 0
    assert np.all(np.delete(found.combinations, arm) > 0)
    assert found.combinations.max() <= 10


@pytest.mark.parametrize(
    ("shares", "words"),
    [
        (
            [0.12, 0.7, 0.6, 0.62, *[0.03] * 6],
            "mass from the table (prior 88 %), centre of mass: data 64 %, "
            "inertia from the table (prior 97 %)",
        ),
        (
            [0.94, 0.3, 0.3, 0.3, *[0.5] * 6],
            "mass: data 94 %, centre of mass: prior 70 %, inertia: data 50 %",
        ),
    ],
)
def test_words(shares, words):
    assert in_words(np.array(shares)) == words
