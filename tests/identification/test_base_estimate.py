import numpy as np
import pytest

from bsip_cli.dynamics.ground_wrench import wrench_regressor
from bsip_cli.dynamics.lowpass import lowpass_operator
from bsip_cli.identification.base import base_parameters, estimate
from bsip_cli.identification.problem import (
    Problem,
    accumulate,
    even_noise,
    noise_of,
)
from bsip_cli.identification.uncertainty import readable
from tests.identification.synthetic_identification import (
    equations_of,
    problem_of,
    recording,
    regressor,
    remeasured,
    standing_still,
    world,
)

NOISE = np.array([3.0, 3.0, 5.0, 1.5, 1.5, 1.0])  # N, N m


def test_noise_free_parameters_come_back_to_eight_digits():
    one = recording(30.0)
    equations = accumulate(world().model, [one], 8.0, np.zeros(3))
    noise = even_noise(np.full(6, 1e-3), equations.samples)
    fit = base_parameters(Problem(equations, noise, world().prior, world().basis, 1.0))
    true = world().basis.combine @ world().phi_true
    mapped = world().basis.combine @ world().prior.root
    spread = np.sqrt(np.diag(mapped @ mapped.T))  # each in how far people stray
    assert np.abs((fit.rm_values - true) / spread).max() > 0.5
    np.testing.assert_allclose(fit.values / spread, true / spread, rtol=1e-8, atol=1e-8)


def test_segments_have_the_combinations_and_can_be_written():
    """A segment without a mass would have no centre of mass."""
    rows = regressor()
    problem = problem_of(rows, rows @ world().phi_true, 1e-3)
    fit, found = base_parameters(problem), estimate(problem)
    combine, prior = world().basis.combine, world().prior
    spread = np.sqrt(np.diag(combine @ prior.root @ prior.root.T @ combine.T))
    np.testing.assert_allclose((combine @ found.phi - fit.values) / spread, 0.0, atol=1e-8)
    read = readable(found, prior)
    assert np.isfinite(read.values).all()
    assert np.isfinite(read.sd).all()
    step = np.linalg.solve(prior.root, found.phi - prior.phi)
    nearer = np.linalg.solve(prior.root, world().phi_true - prior.phi)
    assert np.linalg.norm(step) < np.linalg.norm(nearer)


def test_equals_dense_weighted_least_squares():
    """Where the data say much more than the trace of the table's weight."""
    rows = regressor()
    rng = np.random.default_rng(1)
    measured = rows @ world().phi_true + rng.normal(0, NOISE, rows.shape[:2])
    fit = base_parameters(problem_of(rows, measured, NOISE))
    A = (rows[..., world().basis.independent] / NOISE[:, None]).reshape(-1, 128)
    expected = np.linalg.lstsq(A, (measured / NOISE).ravel(), rcond=None)[0]
    sd = np.sqrt(np.diag(np.linalg.inv(A.T @ A)))
    np.testing.assert_allclose((fit.values - expected) / sd, 0.0, atol=1e-3)
    np.testing.assert_allclose(np.sqrt(np.diag(fit.covariance)), sd, rtol=1e-3)
    np.testing.assert_allclose(fit.sigma_percent(), 100 * sd / np.abs(expected), rtol=0.01)


def test_intervals_cover_the_truth_through_the_whole_chain():
    """White noise on the plates, the low-pass with its memory, noise from the residuals."""
    one = recording(30.0)
    operator, _ = lowpass_operator(one.use, 100.0, 8.0, 5)
    model = world().model
    Y = wrench_regressor(model, one.q, one.v, one.a, np.zeros(3))
    rows = (operator @ Y.reshape(len(Y), -1)).reshape(-1, 6, 150)
    true = world().basis.combine @ world().phi_true
    rng = np.random.default_rng(3)
    motion_only = equations_of(rows, np.zeros(rows.shape[:2]))
    hits = []
    for _ in range(25):
        measured = operator @ (one.wrench + rng.normal(0, NOISE, one.wrench.shape))
        noise = even_noise(NOISE, len(rows))
        equations = remeasured(motion_only, rows, measured)
        problem = Problem(equations, noise, world().prior, world().basis, 1.0)
        left = measured - rows @ estimate(problem).phi
        noise = noise_of([(left, np.ones(len(left)))])
        fit = base_parameters(Problem(equations, noise, world().prior, world().basis, 1.0))
        hits.append(np.abs(fit.values - true) < 1.96 * np.sqrt(np.diag(fit.covariance)))
    assert 0.90 < np.mean(hits) < 0.98


def test_what_was_not_excited_stays_with_the_table_and_is_uncertain():
    """A person who stands still shows weight and centre of mass only."""
    rows = standing_still(50)
    fit = base_parameters(problem_of(rows, rows @ world().phi_true, 1.0))
    true = world().basis.combine @ world().phi_true
    assert fit.values[0] == pytest.approx(true[0], rel=1e-6)  # the mass of the whole body
    sigma = fit.sigma_percent()
    assert sigma[0] < 0.1
    assert np.median(sigma) > 100
    assert np.isfinite(fit.values).all()
