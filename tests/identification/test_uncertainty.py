"""What the data can know beside the table, how it is said, and bodies that are rare."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from bsip_cli.identification.hansen2017 import estimate
from bsip_cli.identification.problem import Estimate
from bsip_cli.identification.uncertainty import (
    RARE,
    beforehand,
    excitation,
    in_words,
    rarity_of,
    readable,
)
from bsip_cli.segments import SEGMENTS
from tests.identification.synthetic_identification import (
    problem_of,
    regressor,
    without_segment,
    world,
)

TORSO = SEGMENTS.index("upper_torso")


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


# --- bodies that fewer than 1 in 100 people have, told from data that decide a part of them -------


def estimates(count: int, decided: int, wider: float = 1.0) -> list[Estimate]:
    """Posterior means of people drawn from the prior, whom data tell in so many directions; by an
    estimator that takes people for ``wider``."""
    rng, prior = np.random.default_rng(4), world().prior
    ways = np.linalg.qr(rng.normal(size=(150, decided)))[0]
    information = ways @ np.diag(np.geomspace(0.5, 300, decided)) @ ways.T
    after = np.linalg.inv(information + np.eye(150) / wider**2)
    noise = ways @ np.diag(np.sqrt(np.geomspace(0.5, 300, decided)))
    covariance = prior.root @ after @ prior.root.T
    found = []
    for _ in range(count):
        told = information @ rng.normal(size=150) + noise @ rng.normal(size=decided)
        phi = prior.phi + prior.root @ after @ told
        before = None if wider == 1.0 else wider**2 * prior.root @ prior.root.T
        found.append(Estimate(phi, covariance, "", before))
    return found


def test_one_person_in_a_hundred_is_rare_however_little_the_data_decide():
    for decided, wider in ((8, 1.0), (60, 1.0), (20, 2.0)):
        p = [rarity_of(world().prior, e).probability for e in estimates(1000, decided, wider)]
        assert 0.001 <= np.mean(np.array(p) < RARE) <= 0.025
        assert 0.45 < np.median(p) < 0.55


def test_a_torso_of_two_thirds_is_rare_though_little_is_decided():
    """Taken for a true body of 150 parameters it would pass."""
    prior, (likely,) = world().prior, estimates(1, 8)
    phi = prior.phi.copy()
    phi[10 * TORSO : 10 * TORSO + 10] *= 0.67
    thighs = [SEGMENTS.index("thigh_l"), SEGMENTS.index("thigh_r")]
    lost = prior.phi[::10].sum() - phi[::10].sum()
    for i in thighs:
        phi[10 * i : 10 * i + 10] *= 1 + lost / 2 / phi[10 * i]
    found = rarity_of(prior, replace(likely, phi=phi))
    assert found.is_rare and chi2.sf(found.distance, 150) > RARE
    assert set(found.farthest()) <= {TORSO, *thighs}
    assert abs(found.shares.sum() - 1) < 1e-9


def test_the_table_itself_is_not_rare_and_fixed_segments_do_not_count():
    prior, (likely,) = world().prior, estimates(1, 8)
    same = rarity_of(prior, replace(likely, phi=prior.phi))
    assert same.probability == 1.0 and same.farthest() == []
    fixed = replace(prior, fixed=np.arange(15) == TORSO)
    assert rarity_of(fixed, likely).shares[TORSO] == 0.0
