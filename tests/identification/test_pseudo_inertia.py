import numpy as np

from bsip_cli.body.inertia import Inertia, from_phi
from bsip_cli.identification import consistent as pseudo_inertia
from tests.identification.synthetic_identification import world

STEP = 1e-6


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
    np.testing.assert_allclose(pseudo_inertia.pseudo_inertias(phi)[0], masses * ones.T @ ones)


def test_physical_means_positive_definite():
    assert pseudo_inertia.are_physical(table())
    bodies = [from_phi(table()[10 * i : 10 * i + 10]) for i in range(15)]
    assert all(body.is_physical() for body in bodies)
    for k in (0, 4):  # no mass; a moment that is too small for the other two
        broken = table().copy()
        broken[k] = 0.0
        assert not pseudo_inertia.are_physical(broken)
        assert np.isinf(pseudo_inertia.divergences(broken, table())).all()


def test_divergence_is_zero_at_the_table_and_positive_elsewhere():
    np.testing.assert_allclose(pseudo_inertia.divergences(table(), table()), 0.0, atol=1e-9)
    np.testing.assert_allclose(pseudo_inertia.gradient(table(), table()), 0.0, atol=1e-6)
    assert np.all(pseudo_inertia.divergences(world().phi_true, table()) > 0.01)
    # A body of twice the mass everywhere: 4 (2 - 1 - log 2), whatever its shape.
    np.testing.assert_allclose(
        pseudo_inertia.divergences(2 * table(), table()), 4 * (1 - np.log(2)), rtol=1e-9
    )


def test_divergence_does_not_depend_on_the_frame():
    """Seen from another origin, two bodies are as far apart as before."""
    shift = np.array([0.3, -0.2, 0.1])
    pair = [x[10:20] for x in (world().phi_true, table())]
    moved = [from_phi(x).moved(shift).phi() for x in pair]
    np.testing.assert_allclose(
        pseudo_inertia.divergences(*moved), pseudo_inertia.divergences(*pair), rtol=1e-8
    )
