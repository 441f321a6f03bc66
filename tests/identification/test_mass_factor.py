"""RM+mass: the table's body times one number."""

from dataclasses import replace

import numpy as np
import pytest

from bsip_cli.errors import NumericalError
from bsip_cli.identification.mass_factor import estimate
from bsip_cli.identification.problem import Problem
from bsip_cli.identification.uncertainty import readable
from tests.identification.synthetic_identification import (
    noisy_problem,
    problem_of,
    regressor,
    world,
)

NOISE = np.array([8.0, 8.0, 8.0, 4.0, 4.0, 4.0])


def noisy(phi: np.ndarray, seed: int = 1) -> Problem:
    return noisy_problem(regressor(), NOISE, seed, phi)


def factor_and_sd(found) -> tuple[float, float]:
    """Of the sum of all masses over the table's."""
    table_kg = world().prior.phi[::10].sum()
    sd_kg = np.sqrt(found.covariance[::10, ::10].sum())
    return found.phi[::10].sum() / table_kg, sd_kg / table_kg


def test_the_number_is_found_and_its_interval_covers():
    truth = 1.05 * world().prior.phi
    hits = []
    for seed in range(200):
        found = estimate(noisy(truth, seed))
        factor, sd = factor_and_sd(found)
        assert found.phi == pytest.approx(factor * world().prior.phi)
        assert factor == pytest.approx(1.05, abs=5 * sd)
        hits.append(abs(factor - 1.05) < 1.96 * sd)
    assert 0.90 < np.mean(hits) < 0.99
    assert f"times {factor:.4f}" in found.note


def test_what_the_number_leaves_widens_its_interval():
    """Another body errs by more than the noise says."""
    problems = [noisy(1.05 * world().prior.phi), noisy(world().phi_true)]
    (_, like_table), (_, other) = (factor_and_sd(estimate(problem)) for problem in problems)
    assert other > 1.5 * like_table
    trusted_less = replace(problems[0], trust_ratio=4.0)
    assert factor_and_sd(estimate(trusted_less))[1] == pytest.approx(4 * like_table)


def test_segments_keep_the_tables_spread():
    """The number says nothing of a single segment beside what the sum of masses says."""
    prior = world().prior
    found = readable(estimate(noisy(prior.phi)), prior)
    assert found.share[:, 1:4] == pytest.approx(0.0, abs=1e-9)
    assert found.sd[:, 1:4] == pytest.approx(prior.readable_sd[:, 1:4])
    assert (found.sd[:, 0] > 0.8 * prior.readable_sd[:, 0]).all()


def test_segments_without_markers_are_scaled_too():
    prior, rows = world().prior, regressor()
    known = np.repeat(np.arange(len(prior.inertias)) == 2, 10)
    whole = problem_of(rows, 1.05 * rows @ prior.phi, NOISE)
    problem = replace(
        whole, equations=whole.equations.with_known(prior.phi, known), whole=whole.equations
    )
    assert estimate(problem).phi == pytest.approx(1.05 * prior.phi)
    assert estimate(problem).residual_rms(problem) == pytest.approx(0.0, abs=1e-4)


def test_forces_that_push_upwards_have_no_such_body():
    with pytest.raises(NumericalError, match="above 0"):
        estimate(noisy(-world().prior.phi))
