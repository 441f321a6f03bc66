"""The damped Newton against a conic solver, derivatives, and problems made to be nasty."""

import clarabel
import numpy as np
import pytest
from scipy import sparse

from bsip_cli.body.inertia import Inertia, from_phi
from bsip_cli.errors import NumericalError
from bsip_cli.identification.consistent import (
    BASIS,
    Objective,
    are_physical,
    divergences,
    gradient,
    minimise,
    objective_of,
    pseudo_inertias,
    terms_of,
)
from tests.identification.synthetic_identification import (
    noisy_problem,
    problem_of,
    regressor,
    world,
)


def objective(problem, gamma=0.5):
    terms = terms_of(problem)
    return objective_of(terms, np.ones(len(terms.spreads)), gamma)


def noisy(seed=1, samples=500, noise=3.0):
    return noisy_problem(regressor()[:samples], noise, seed)


def test_derivatives_against_finite_differences():
    fit = objective(noisy())
    scale = 1 / np.sqrt(np.diag(fit.hessian(np.zeros_like(fit.linear))))
    rng = np.random.default_rng(1)
    for _ in range(5):
        x = 0.05 * scale * rng.normal(size=len(scale))
        assert np.isfinite(fit.value(x))
        step = 1e-4 * scale * rng.normal(size=len(scale))
        rise = fit.value(x + step) - fit.value(x - step)
        slope = fit.gradient(x)
        assert abs(rise - 2 * slope @ step) < 1e-5 * np.abs(slope * step).sum()
        change = fit.gradient(x + step) - fit.gradient(x - step)
        expected = 2 * fit.hessian(x) @ step
        assert np.abs((change - expected) * scale).max() < 1e-5 * np.abs(expected * scale).max()


def test_optimum_is_stationary_in_few_steps():
    fit = objective(noisy())
    optimum = minimise(fit)
    step = optimum.covariance @ fit.gradient(optimum.x)
    assert np.abs(step / np.sqrt(np.diag(optimum.covariance))).max() < 1e-6
    assert optimum.steps <= 12
    assert are_physical(fit.phi(optimum.x))
    product = fit.hessian(optimum.x) @ optimum.covariance
    np.testing.assert_allclose(np.diag(product), 1.0, rtol=1e-3)
    again = minimise(fit, optimum.x)
    assert again.steps <= 1


def scaled_triangle(matrices):
    """Upper triangles, column by column, off-diagonals times sqrt 2: clarabel's PSD cone."""
    size = matrices.shape[-1]
    pairs = [(i, j) for j in range(size) for i in range(j + 1)]
    return np.stack(
        [matrices[..., i, j] * (1.0 if i == j else np.sqrt(2.0)) for i, j in pairs], axis=-1
    )


def by_clarabel(fit):
    """The same optimum in conic form, and its value.

    log det J >= sum log z_k where [[J, Z], [Z^T, diag(Z)]] >= 0 with Z lower triangular and z its
    diagonal (Ben-Tal and Nemirovski); log z_k >= t_k is an exponential cone. Variables are steps
    in units in which the Hessian at the table has a unit diagonal, then Z (10) and t (4) of each
    segment.
    """
    count, size = len(fit.table) // 10, len(fit.linear)
    scale = 1 / np.sqrt(np.diag(fit.hessian(np.zeros(size))))
    total = size + 14 * count
    P = np.zeros((total, total))
    P[:size, :size] = fit.quadratic * np.outer(scale, scale)
    q = np.zeros(total)
    q[:size] = -fit.linear * scale
    low = [(i, j) for i in range(4) for j in range(i + 1)]
    blocks, offsets, cones = [], [], []
    for s in range(count):
        part = slice(10 * s, 10 * s + 10)
        start = pseudo_inertias(fit.table[part])[0]
        root = np.linalg.inv(np.linalg.cholesky(start))  # J seen in the table's own units
        J = np.einsum("ai,mij,bj,mk->kab", root, BASIS, root, fit.shown[part] * scale)
        q[:size] += fit.gamma * np.einsum("kaa->k", J)
        first = size + 14 * s
        rows = np.zeros((36, total))
        big = np.zeros((size, 8, 8))
        big[:, :4, :4] = J
        rows[:, :size] = -scaled_triangle(big).T
        for k, (i, j) in enumerate(low):
            E = np.zeros((8, 8))
            E[i, 4 + j] = E[4 + j, i] = 1.0
            if i == j:
                E[4 + i, 4 + i] = 1.0
            rows[:, first + k] = -scaled_triangle(E)
        constant = np.zeros((8, 8))
        constant[:4, :4] = np.eye(4)
        blocks.append(rows)
        offsets.append(scaled_triangle(constant))
        cones.append(clarabel.PSDTriangleConeT(8))
        for d in range(4):  # (t, 1, z): exp(t) <= z
            rows = np.zeros((3, total))
            rows[0, first + 10 + d] = -1.0
            rows[2, first + low.index((d, d))] = -1.0
            blocks.append(rows)
            offsets.append(np.array([0.0, 1.0, 0.0]))
            cones.append(clarabel.ExponentialConeT())
            q[first + 10 + d] = -fit.gamma
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-13
    # Without more refinement how far it gets depends on the processor.
    settings.iterative_refinement_max_iter = 50
    settings.iterative_refinement_reltol = settings.iterative_refinement_abstol = 1e-15
    solution = clarabel.DefaultSolver(
        sparse.csc_matrix(np.triu(P)),
        q,
        sparse.csc_matrix(np.vstack(blocks)),
        np.concatenate(offsets),
        cones,
        settings,
    ).solve()
    return scale * np.array(solution.x)[:size], solution.obj_val


@pytest.mark.parametrize(("gamma", "samples"), [(0.5, 500), (6.0, 500), (0.1, 40)])
def test_equals_the_conic_solver(gamma, samples):
    """The value to 9 digits; the parameters, which move by the root of its error, to 6."""
    fit = objective(noisy(samples=samples), gamma)
    ours = minimise(fit)
    x, value = by_clarabel(fit)
    assert ours.value == pytest.approx(value, rel=1e-9)
    assert ours.value <= fit.value(x) + 1e-11 * abs(value)
    spread = np.linalg.norm(world().prior.root, axis=1)
    mine, theirs = (fit.phi(each) / spread for each in (ours.x, x))
    assert np.linalg.norm(mine - fit.table / spread) > 1
    np.testing.assert_allclose(mine, theirs, rtol=0, atol=2e-6 * np.abs(mine).max())


def nasty(seed):
    """Few samples, forces that belong to no body, wild weights: whatever a bad trial brings."""
    rng = np.random.default_rng(seed)
    rows = regressor()[rng.integers(0, 400) :][: rng.integers(1, 60)]
    clean = rows @ world().phi_true
    wrong = [
        -clean,
        np.zeros_like(clean),
        rng.normal(0, 10 ** rng.uniform(0, 5), clean.shape),
        clean + 1e4,
        rng.permutation(clean.ravel()).reshape(clean.shape),
    ]
    return problem_of(rows, wrong[seed % 5], 10 ** rng.uniform(-3, 2))


@pytest.mark.parametrize("seed", range(20))
def test_physical_whatever_the_data(seed):
    gamma = 10 ** np.random.default_rng(seed + 100).uniform(-2, 1.5)
    fit = objective(nasty(seed), gamma)
    optimum = minimise(fit)
    assert are_physical(fit.phi(optimum.x))
    assert optimum.value <= fit.value(np.zeros_like(optimum.x)) + 1e-9
    assert np.all(np.diag(optimum.covariance) > 0)


def test_values_that_are_not_finite_are_named():
    fit = objective(noisy())
    broken = Objective(fit.quadratic * np.nan, fit.linear, fit.shown, fit.table, fit.gamma)
    with pytest.raises(NumericalError, match="normal equations"):
        minimise(broken)


# --- segments as pseudo-inertias ------------------------------------------------------------------


def table():
    return world().prior.phi


def test_matrix_is_that_of_point_masses():
    """Second moments, first moments and mass, summed over points."""
    rng = np.random.default_rng(1)
    points, masses = rng.normal(size=(30, 3)), rng.uniform(0.1, 1.0, 30)
    ones = np.column_stack([points, np.ones(30)])
    com = masses @ points / masses.sum()
    away = points - com
    tensor = np.einsum("n,nij->ij", masses, (away**2).sum(1)[:, None, None] * np.eye(3)) - (
        masses * away.T @ away
    )
    phi = Inertia(float(masses.sum()), com, tensor).phi()
    np.testing.assert_allclose(pseudo_inertias(phi)[0], masses * ones.T @ ones)


def test_physical_means_positive_definite():
    assert are_physical(table())
    bodies = [from_phi(table()[10 * i : 10 * i + 10]) for i in range(15)]
    assert all(body.is_physical() for body in bodies)
    for k in (0, 4):  # no mass; a moment that is too small for the other two
        broken = table().copy()
        broken[k] = 0.0
        assert not are_physical(broken)
        assert np.isinf(divergences(broken, table())).all()


def test_divergence_is_zero_at_the_table_and_positive_elsewhere():
    np.testing.assert_allclose(divergences(table(), table()), 0.0, atol=1e-9)
    np.testing.assert_allclose(gradient(table(), table()), 0.0, atol=1e-6)
    assert np.all(divergences(world().phi_true, table()) > 0.01)
    # A body of twice the mass everywhere: 4 (2 - 1 - log 2), whatever its shape.
    np.testing.assert_allclose(divergences(2 * table(), table()), 4 * (1 - np.log(2)), rtol=1e-9)


def test_divergence_does_not_depend_on_the_frame():
    """Seen from another origin, two bodies are as far apart as before."""
    shift = np.array([0.3, -0.2, 0.1])
    pair = [x[10:20] for x in (world().phi_true, table())]
    moved = [from_phi(x).moved(shift).phi() for x in pair]
    np.testing.assert_allclose(divergences(*moved), divergences(*pair), rtol=1e-8)
