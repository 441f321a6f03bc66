from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from bsip_cli.body.inertia import from_phi, from_readable
from bsip_cli.dynamics.ground_wrench import predicted_wrench
from bsip_cli.identification.consistent import (
    are_physical,
    estimate,
    fit_at,
    fit_with_weights,
    terms_of,
)
from bsip_cli.identification.prior import likeliest
from bsip_cli.identification.uncertainty import readable
from tests.body.standing_person import parameters_of
from tests.identification.synthetic_identification import (
    distance,
    motion,
    noisy_problem,
    problem_of,
    regressor,
    standing_still,
    without_segment,
    world,
)


def test_rich_noise_free_data_are_reproduced():
    rows = regressor()
    measured = rows @ world().phi_true
    found = estimate(problem_of(rows, measured, 1e-2))
    assert np.abs(rows @ found.phi - measured).max() < 1e-4 * np.abs(measured).max()
    assert are_physical(found.phi)
    q, v, a = motion(3.0, seed=9)
    both = np.stack([found.phi, world().phi_true], axis=1)
    wrench = predicted_wrench(world().model, q, v, a, both, np.zeros(3))
    assert np.abs(wrench[..., 0] - wrench[..., 1]).max() < 1e-3 * np.abs(wrench).max()


def test_almost_no_data_leave_rm_and_say_so():
    rows = regressor()[:3]
    found = estimate(problem_of(rows, rows @ world().phi_true, 1e7))
    np.testing.assert_allclose(distance(found.phi), 0.0, atol=1e-5)
    read = readable(found, world().prior)
    np.testing.assert_allclose(read.share, 0.0, atol=1e-4)
    assert np.all(read.sd[:, :4] < 1.001 * world().prior.readable_sd[:, :4])
    assert "decide 0 of 150" in found.note
    assert "the table the rest" in found.note


def test_standing_still_tells_the_mass_and_leaves_the_rest():
    found = estimate(noisy_problem(standing_still(200), 3.0, seed=4))
    total = world().phi_true[::10].sum()
    assert found.phi[::10].sum() == pytest.approx(total, abs=0.1)
    assert "too little motion" in found.note
    assert readable(found, world().prior).share.mean() < 0.1
    assert np.sqrt(np.mean(distance(found.phi) ** 2)) < 0.3


def test_one_arm_that_never_moved_stays_near_the_table():
    """Its rows are empty: nothing but the scale's total speaks about it."""
    arm = 10 * world().person.skeleton.index("forearm_l")
    found = estimate(noisy_problem(without_segment("forearm_l"), 3.0, seed=5))
    body, table = (from_phi(x[arm : arm + 10]) for x in (found.phi, world().prior.phi))
    assert body.mass_kg == pytest.approx(table.mass_kg, rel=0.05)
    np.testing.assert_allclose(body.com_m, table.com_m, atol=1e-3)
    share = readable(found, world().prior).share
    assert share[arm // 10].max() < 0.02 < share.mean()


def likely(rows, measured):
    """What the weights of the identification begin with."""
    first = problem_of(rows, measured, 10.0)
    return likeliest(first.prior, *first.equations.weighted(first.noise.weights()))


@pytest.mark.parametrize("seed", range(6))
def test_physical_with_data_of_no_body(seed):
    """Sign lost, forces of nothing, noise that no plate makes, components that disagree."""
    rng = np.random.default_rng(seed)
    rows = regressor()[: (5, 30, 100)[seed % 3]]
    clean = rows @ world().phi_true
    measured = [-clean, rng.normal(0, 1e4, clean.shape), clean * rng.normal(0, 2, 6)][seed // 2]
    left = measured - rows @ likely(rows, measured)
    rms = np.maximum(np.sqrt((left**2).mean(axis=0)), 1e-3)
    found = estimate(problem_of(rows, measured, rms, (1.0, 4.0)[seed % 2]))
    assert are_physical(found.phi)
    assert np.isfinite(found.covariance).all()
    share = readable(found, world().prior).share
    assert np.all((share >= 0) & (share <= 1))


def drawn(scale, rng):
    """A physical person off the table by ``scale`` (10,) times what [prior] says; (15, 10)."""
    prior = world().prior
    table = np.array([body.readable() for body in prior.inertias])
    root = np.linalg.inv(prior.white)
    rows: list[np.ndarray] = []
    while len(rows) < len(table):
        block = slice(10 * len(rows), 10 * len(rows) + 10)
        phi = prior.phi[block] + root[block, block] @ (scale * rng.normal(size=10))
        body = from_phi(phi).moved(prior.origin_in_joint_m[len(rows)])
        if body.is_physical():
            rows.append(body.readable())
    off = sum(row[0] for row in rows) - table[:, 0].sum()
    rows = np.array(rows)
    share = np.square(table[:, 0])
    rows[:, 0] -= off * share / share.sum()  # the scale knows the sum
    return rows


def parameters(rows):
    return parameters_of(world().person, [from_readable(row) for row in rows])


def test_the_spread_of_a_person_is_found():
    """One as the table says but for noise, one whose centres of mass are far off."""
    rows = regressor()
    rng = np.random.default_rng(7)
    spreads = []
    for centres in (0.0, 2.0):
        scale = np.array([0.1, *[centres] * 3, *[0.1] * 6])
        true = parameters(drawn(scale, rng))
        measured = rows @ true + rng.normal(0, 1.0, rows.shape[:2])
        fit = fit_with_weights(terms_of(problem_of(rows, measured, 1.0)))
        spreads.append(1 / np.sqrt(fit.spread))
    assert spreads[0][0] < 0.7
    assert spreads[1][0] == pytest.approx(1.0)  # never wider than said


def test_the_spreads_have_the_largest_evidence():
    """Nothing said beforehand: no spread of centres twice or half as wide is likelier."""
    rows = regressor()
    rng = np.random.default_rng(8)
    true = parameters(drawn(np.array([1.0, 1.0, 1.0, 1.0, *[0.3] * 6]), rng))
    measured = rows @ true + rng.normal(0, 1.0, rows.shape[:2])
    problem = replace(problem_of(rows, measured, 1.0), spread_weight=1e-3)
    terms = terms_of(problem)
    tensors = sum(terms.spreads[1:], terms.fixed)  # as said
    terms = replace(terms, spreads=terms.spreads[:1], fixed=tensors)
    fit = fit_with_weights(terms)
    for factor in (0.25, 4.0):
        other = fit_at(terms, factor * fit.spread, fit.gamma)
        assert other.evidence < fit.evidence
    for gamma in (0.03, 0.3, 3.0):
        other = fit_at(terms, fit.spread, gamma)
        assert other.evidence <= fit.evidence + 1e-9


def test_intervals_cover_the_truth():
    """People and noise drawn as the estimator believes."""
    rows = regressor()
    rng = np.random.default_rng(9)
    quantile = stats.norm.ppf(0.975)
    hits = []
    for _ in range(8):
        person = drawn(0.5 * np.ones(10), rng)
        true = parameters(person)
        measured = rows @ true + rng.normal(0, 3.0, rows.shape[:2])
        read = readable(estimate(problem_of(rows, measured, 3.0)), world().prior)
        hits.append(np.abs(read.values - person) < quantile * read.sd)
    assert 0.90 < np.mean(hits) < 0.995
    assert np.mean(hits, axis=(0, 1)).min() > 0.85


def test_data_that_are_trusted_less_leave_more_to_the_table():
    problems = (noisy_problem(regressor(), 3.0, 10, trust_ratio=x) for x in (1.0, 4.0, 16.0))
    shares = [readable(estimate(one), world().prior).share.mean() for one in problems]
    assert shares[0] > shares[1] > shares[2] > 0
