"""Bodies that fewer than 1 in 100 people have, told from data that decide only a part of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.stats import chi2

from bsip_cli.identification.problem import Estimate
from bsip_cli.identification.uncertainty import RARE, rarity_of
from bsip_cli.segments import SEGMENTS
from tests.identification.synthetic_identification import world

TORSO = SEGMENTS.index("upper_torso")


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
