from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from bsip_cli.identification.base import base_parameters
from bsip_cli.identification.robert2017 import estimate, programme_of, solve
from bsip_cli.identification.uncertainty import readable
from tests.identification.synthetic_identification import noisy_problem, regressor, world


def noisy(noise=3.0, seed=1, phi=None):
    return noisy_problem(regressor(), noise, seed, phi)


def by_scipy(programme):
    """The same quadratic programme by sequential quadratic programming."""
    masses = np.arange(0, len(programme.table), 10)
    matrix = np.eye(len(programme.table)) + programme.relations.T @ programme.relations
    right = programme.relations.T @ programme.targets
    scale = 1 / np.sqrt(np.diag(matrix))

    def room(z):
        return (programme.table + programme.spread * z)[masses] - programme.floor

    slope = np.zeros((len(masses), len(programme.table)))
    slope[np.arange(len(masses)), masses] = programme.spread[masses]
    best = minimize(
        lambda u: 0.5 * (u * scale) @ matrix @ (u * scale) - right @ (u * scale),
        np.zeros(len(scale)),
        jac=lambda u: (matrix @ (u * scale) - right) * scale,
        constraints={
            "type": "ineq",
            "fun": lambda u: room(u * scale),
            "jac": lambda u: slope * scale,
        },
        method="SLSQP",
        options={"maxiter": 2000, "ftol": 1e-14},
    )
    return best.x * scale


def test_relations_are_those_below_the_limit():
    problem = noisy()
    fit = base_parameters(problem)
    counts = []
    for limit in (1.0, 5.0, 50.0):
        programme = programme_of(replace(problem, sigma_percent_limit=limit))
        sure = fit.sigma_percent() < limit
        counts.append(len(programme.targets))
        assert counts[-1] == sure.sum()
        sd = np.sqrt(np.diag(fit.covariance))[sure]
        z = np.random.default_rng(1).normal(size=150)
        phi = programme.table + programme.spread * z
        np.testing.assert_allclose(
            programme.relations @ z - programme.targets,
            (world().basis.combine[sure] @ phi - fit.values[sure]) / sd,
            rtol=1e-6,
            atol=1e-6 * np.abs(programme.targets).max(),
        )
    assert counts[0] < counts[1] < counts[2]


def test_equals_the_closed_form_while_masses_are_positive():
    programme = programme_of(noisy())
    matrix = np.eye(150) + programme.relations.T @ programme.relations
    z = np.linalg.solve(matrix, programme.relations.T @ programme.targets)
    assert np.all((programme.table + programme.spread * z)[::10] > programme.floor)
    np.testing.assert_allclose(solve(programme), z, atol=1e-5 * np.abs(z).max())


def test_equals_scipy_where_masses_would_be_negative():
    """Lighter hands than none: the bound holds them."""
    programme = programme_of(noisy(noise=30.0))
    hand = 10 * world().person.skeleton.index("hand_l")
    pull = np.zeros((1, 150))
    pull[0, hand] = programme.spread[hand] / (0.1 * programme.spread[hand])
    harder = replace(
        programme,
        relations=np.vstack([programme.relations, pull]),
        targets=np.append(
            programme.targets, -2 * programme.table[hand] / programme.spread[hand] * 10
        ),
    )
    ours, theirs = solve(harder), by_scipy(harder)
    masses = (harder.table + harder.spread * ours)[::10]
    assert masses[hand // 10] == pytest.approx(harder.floor[hand // 10], rel=1e-4)
    np.testing.assert_allclose(ours, theirs, atol=1e-4 * np.abs(theirs).max())

    def cost(z):
        return 0.5 * z @ z + 0.5 * ((harder.relations @ z - harder.targets) ** 2).sum()

    assert cost(ours) == pytest.approx(cost(theirs), rel=1e-7)


def test_no_sure_relation_leaves_rm():
    problem = replace(noisy(noise=1e7), sigma_percent_limit=1e-6)
    found = estimate(problem)
    np.testing.assert_allclose(found.phi, world().prior.phi, rtol=1e-9)
    assert found.note.startswith("0 of 128")
    np.testing.assert_allclose(readable(found, world().prior).share, 0.0, atol=1e-6)


def test_base_parameters_are_reproduced_as_well_as_they_are_known():
    problem = noisy(noise=0.1)
    found, fit = estimate(problem), base_parameters(problem)
    sure = fit.sigma_percent() < problem.sigma_percent_limit
    assert sure.sum() > 40
    sd = np.sqrt(np.diag(fit.covariance))
    misfit = ((world().basis.combine @ found.phi - fit.values) / sd)[sure]
    assert np.sqrt(np.mean(misfit**2)) < 1.0


def test_intervals_cover_the_truth():
    """People drawn from the prior, near enough to the table that masses stay positive."""
    rng = np.random.default_rng(3)
    prior = world().prior
    squares = []
    for seed in range(20):
        true = prior.phi + prior.root @ rng.normal(size=150) * 0.7
        found = estimate(noisy(3.0, seed, true))
        squares.append((found.phi - true) ** 2 / np.diag(found.covariance))
    within = np.mean(np.array(squares) < 1.96**2)
    assert 0.93 < within < 0.999
