import numpy as np
import pytest
from scipy.optimize import minimize

from bsip_cli.dynamics.ground_wrench import predicted_wrench
from bsip_cli.identification.hansen2017 import estimate
from bsip_cli.identification.uncertainty import excitation, readable
from tests.identification.synthetic_identification import (
    MASS_KG,
    distance,
    motion,
    problem_of,
    regressor,
    without_segment,
    world,
)


@pytest.fixture(scope="module")
def rich():
    rows = regressor()
    problem = problem_of(rows, rows @ world().phi_true, 1e-4)
    return rows, problem, estimate(problem)


def test_rich_noise_free_data_are_reproduced(rich):
    rows, problem, found = rich
    measured = rows @ world().phi_true
    assert np.abs(rows @ found.phi - measured).max() < 1e-6 * np.abs(measured).max()
    assert np.all(found.phi[::10] > 0)
    assert "128 of 128" in found.note
    assert found.residual_rms(problem).max() < 1e-3


def test_another_motion_is_predicted(rich):
    *_, found = rich
    q, v, a = motion(3.0, seed=9)
    phi = np.stack([found.phi, world().phi_true, world().prior.phi], axis=1)
    wrench = predicted_wrench(world().model, q, v, a, phi, np.zeros(3))
    scale = np.abs(wrench).max()
    assert np.abs(wrench[..., 0] - wrench[..., 1]).max() < 1e-6 * scale
    assert np.abs(wrench[..., 2] - wrench[..., 1]).max() > 0.01 * scale


def test_nothing_with_the_same_base_parameters_is_nearer_to_rm(rich):
    *_, found = rich
    combine = world().basis.combine
    null = np.linalg.svd(combine)[2][128:].T  # (150, 22)
    assert np.abs(combine @ null).max() < 1e-9
    best = distance(found.phi)
    # First-order condition: RM lies across the null space, seen in the prior's metric.
    along = np.linalg.solve(world().prior.root, null)
    slope = along.T @ best / np.linalg.norm(along, axis=0)
    assert np.abs(slope).max() < 1e-5 * np.linalg.norm(best)
    rng = np.random.default_rng(1)
    for size in (0.01, 0.1, 1.0):
        for _ in range(50):
            step = along @ rng.normal(size=22)
            step *= size / np.linalg.norm(step)
            assert np.linalg.norm(best + step) > np.linalg.norm(best)


def forced_negative():
    """True base parameters whose nearest segment parameters to RM have a hand of negative mass."""
    prior, basis = world().prior, world().basis
    Q = np.linalg.qr((basis.combine @ prior.root).T)[0]  # what data can show, in prior spreads
    hand = 10 * world().person.skeleton.index("hand_l")
    shown = Q @ (Q.T @ prior.root[hand])
    size = -1.5 * prior.phi[hand] / (prior.root[hand] @ shown)
    return prior.phi + prior.root @ (size * shown), hand


def test_masses_stay_positive_where_the_nearest_would_not_be():
    phi, hand = forced_negative()
    assert phi[hand] < -0.2 * world().prior.phi[hand]
    rows = regressor()
    problem = problem_of(rows, rows @ phi, 1e-3)
    found = estimate(problem)
    assert np.all(found.phi[::10] > 0)
    assert found.phi[hand] >= 0.05 * world().prior.phi[hand] * (1 - 1e-4)
    assert "positive" in found.note
    measured = rows @ phi
    error = np.abs(rows @ found.phi - measured).max()
    assert error < 1e-4 * np.abs(measured).max()  # the data are still met
    # Nearest to RM among those: against an independent optimiser on the null space.
    null = np.linalg.svd(world().basis.combine)[2][128:].T
    along = np.linalg.solve(world().prior.root, null)
    start = distance(phi)
    floor = 0.05 * world().prior.phi[::10]
    best = minimize(
        lambda x: 0.5 * ((start + along @ x) ** 2).sum(),
        np.zeros(22),
        jac=lambda x: along.T @ (start + along @ x),
        constraints={
            "type": "ineq",
            "fun": lambda x: (phi + null @ x)[::10] - floor,
            "jac": lambda x: null[::10],
        },
        method="SLSQP",
        options={"maxiter": 500, "ftol": 1e-12},
    )
    assert best.success
    theirs = np.linalg.norm(start + along @ best.x)
    assert np.linalg.norm(distance(found.phi)) == pytest.approx(theirs, rel=1e-4)


def test_almost_no_data_leave_rm():
    rows = regressor()[:3]
    found = estimate(problem_of(rows, rows @ world().phi_true, 1e7))
    np.testing.assert_array_equal(found.phi, world().prior.phi)
    read = readable(found, world().prior)
    np.testing.assert_allclose(read.share, 0.0, atol=1e-6)
    np.testing.assert_allclose(read.sd, world().prior.readable_sd, rtol=1e-6)
    assert "0 of 128" in found.note


def test_shares_grow_with_the_data_and_stay_within_bounds():
    rows = regressor()
    rng = np.random.default_rng(2)
    means = []
    for noise in (1e4, 30.0, 1.0, 1e-4):
        measured = rows @ world().phi_true + rng.normal(0, min(noise, 30.0), rows.shape[:2])
        share = readable(estimate(problem_of(rows, measured, noise)), world().prior).share
        assert np.all((share >= 0) & (share <= 1))
        means.append(share.mean())
    assert np.all(np.diff(means) > 0)
    assert means[-1] < 0.999  # the wrench cannot show all, whatever the noise


def test_what_the_wrench_cannot_show_keeps_its_doubt(rich):
    """Noise-free data: base parameters sure, the other 22 directions as uncertain as before."""
    *_, found = rich
    base = world().basis.combine @ found.covariance @ world().basis.combine.T
    mapped = world().basis.combine @ world().prior.root
    assert np.all(np.sqrt(np.diag(base)) < 0.01 * np.sqrt(np.diag(mapped @ mapped.T)))
    unseen = np.linalg.svd(mapped)[2][128:].T  # (150, 22) in spreads of people
    half = np.linalg.solve(world().prior.root, found.covariance)
    left = unseen.T @ np.linalg.solve(world().prior.root, half.T) @ unseen
    np.testing.assert_allclose(left, np.eye(22), atol=1e-6)
    np.testing.assert_allclose(unseen.T @ distance(found.phi), 0.0, atol=1e-6)  # stays with RM
    total = world().phi_true[::10].sum()
    assert found.phi[::10].sum() == pytest.approx(total, rel=1e-8)
    assert abs(total - MASS_KG) > 0.5


def test_the_trust_ratio_leaves_more_to_the_table():
    """A combination counts where the data's sd is below the table's over the ratio."""
    rows = regressor()
    measured = rows @ world().phi_true
    root = world().prior.root
    scaled = root.T @ problem_of(rows, measured, 5.0).equations.weighted(np.full(6, 0.04))[0] @ root
    sd = np.linalg.eigvalsh(scaled)[-128:] ** -0.5
    away = []
    for ratio in (1.0, 4.0, 20.0):
        found = estimate(problem_of(rows, measured, 5.0, ratio))
        assert found.note.startswith(f"{int((sd < 1 / ratio).sum())} of 128")
        away.append(np.linalg.norm(distance(found.phi)))
    assert away[0] > away[1] > away[2] > 0


def test_segments_stray_from_the_truth_as_their_sd_says():
    """People drawn from the prior, a rich noisy motion: errors over sd have variance one."""
    rows = regressor()
    rng = np.random.default_rng(3)
    prior = world().prior
    squares = []
    for _ in range(25):
        true = prior.phi + 0.3 * prior.root @ rng.normal(size=150)  # small: stays linear
        measured = rows @ true + 0.3 * rng.normal(0, 2.0, rows.shape[:2])
        found = estimate(problem_of(rows, measured, 2.0))
        z = distance(found.phi) - distance(true)
        S = np.linalg.solve(prior.root, found.covariance) @ np.linalg.inv(prior.root).T
        squares.append((z / 0.3) ** 2 / np.diag(S))
    assert np.mean(squares) == pytest.approx(1.0, abs=0.15)


def test_excitation_names_what_moved():
    """Arms that hang still behind a moving trunk are excited less than arms that move."""
    rows = regressor()
    lively = excitation(problem_of(rows, rows @ world().phi_true, 5.0))
    assert lively.singular_values.shape == (128,)
    assert np.all(np.diff(lively.singular_values) <= 0)
    assert lively.condition_number == pytest.approx(
        lively.singular_values[0] / lively.singular_values[-1]
    )
    assert np.all((lively.segment_share > 0) & (lively.segment_share < 1))
    arm = world().person.skeleton.index("forearm_l")
    silent = without_segment("forearm_l")
    held = excitation(problem_of(silent, silent @ world().phi_true, 5.0))
    assert held.segment_share[arm] < 0.003  # the masses' sum tells a little
    assert lively.segment_share[arm] > 0.1
    twice = excitation(problem_of(np.concatenate([rows] * 4), np.zeros((4 * len(rows), 6)), 5.0))
    np.testing.assert_allclose(twice.singular_values, 2 * lively.singular_values, rtol=1e-4)
