"""Shares of RM's error: they add up, and find the segment that was made wrong."""

import numpy as np
import pytest

from bsip_cli.body.inertia import Inertia, from_phi
from bsip_cli.diagnosis.attribution import (
    COMPONENTS,
    GROUPS,
    Ground,
    attributions,
    parameter_steps,
)
from bsip_cli.dynamics.cop import centre_of_pressure
from bsip_cli.dynamics.regressor import predicted_wrench
from tests.effects.moving_scene import moving

GROUND = Ground(0.0, np.array([0.6, 0.8]), 50.0)


def bodies(phi):
    return tuple(from_phi(part) for part in phi.reshape(-1, 10))


def changed(body, mass=0.0, com=(0.0, 0.0, 0.0), turning=0.0):
    return Inertia(
        body.mass_kg + mass, body.com_m + np.array(com), body.tensor_kgm2 + turning * np.eye(3)
    )


def phi_of(people):
    return np.concatenate([body.phi() for body in people])


def wrench_of(scene, phi):
    """(N, 6) or, for columns, (N, 6, k)."""
    columns = phi if phi.ndim == 2 else phi[:, None]
    found = predicted_wrench(scene.model, scene.q, scene.v, scene.a, columns, np.zeros(3))
    return found if phi.ndim == 2 else found[..., 0]


@pytest.fixture(scope="module")
def scene():
    return moving()


@pytest.fixture(scope="module")
def people(scene):
    """RM, and OM with another head and another lower torso."""
    rm = list(bodies(scene.phi))
    om = list(rm)
    om[2] = changed(rm[2], mass=0.8, com=(0.01, 0.0, 0.0), turning=0.01)
    om[0] = changed(rm[0], mass=-0.8, com=(0.021, 0.004, 0.0))
    return tuple(rm), tuple(om)


def found_in(scene, rm, om, noise):
    rng = np.random.default_rng(3)
    measured = wrench_of(scene, phi_of(om)) + noise * rng.normal(size=(len(scene.q), 6))
    steps = wrench_of(scene, parameter_steps(rm, om))
    judged = np.ones(len(scene.q), dtype=bool)
    table = wrench_of(scene, phi_of(rm))
    return measured, table, steps, attributions(measured, table, steps, judged, GROUND)


def test_steps_lead_from_one_to_the_other(people):
    rm, om = people
    np.testing.assert_allclose(
        phi_of(rm) + parameter_steps(rm, om).sum(axis=1), phi_of(om), atol=1e-12
    )


def test_each_step_changes_its_group_alone(people):
    """Only the mass differs: the other groups' steps are zero, and the mass's leaves the centre."""
    rm = people[0]
    om = tuple(changed(body, mass=0.5) if k == 4 else body for k, body in enumerate(rm))
    steps = parameter_steps(rm, om).reshape(10 * len(rm), len(rm), len(GROUPS))
    assert np.abs(steps[:, 4, 0]).max() > 0.4
    assert np.abs(np.delete(steps.reshape(10 * len(rm), -1), 12, axis=1)).max() == 0.0


def test_shares_and_rest_are_all_of_the_error(scene, people):
    measured, table, steps, found = found_in(scene, *people, noise=2.0)
    assert [one.component for one in found] == list(COMPONENTS)
    for one in found:
        assert one.shares.sum() + one.rest == pytest.approx(1.0, abs=1e-9)
        assert one.samples == len(scene.q)
    before, after = (
        centre_of_pressure(measured, 0.0, 50.0) - centre_of_pressure(w, 0.0, 50.0)
        for w in (table, table + steps.sum(axis=2))
    )
    ap = found[COMPONENTS.index("cop_ap")]
    assert ap.rmse == pytest.approx(np.sqrt(np.mean((before @ GROUND.anterior) ** 2)))
    rest = np.mean((after @ GROUND.anterior) ** 2) / np.mean((before @ GROUND.anterior) ** 2)
    assert ap.rest == pytest.approx(rest)


def test_without_noise_nothing_is_left_and_only_the_wrong_segments_share(scene, people):
    *_, found = found_in(scene, *people, noise=0.0)
    for one in found:
        assert one.rest == pytest.approx(0.0, abs=1e-9)
        assert np.abs(np.delete(one.shares, [0, 2], axis=0)).max() == 0.0


def test_a_single_wrong_centre_takes_it_all(scene, people):
    rm = people[0]
    om = tuple(changed(b, com=(-0.02, 0, 0)) if k == 0 else b for k, b in enumerate(rm))
    *_, found = found_in(scene, rm, om, noise=0.0)
    for one in found:
        assert one.shares[0, GROUPS.index("centre_of_mass")] == pytest.approx(1.0)


def test_the_share_is_the_mean_over_both_orders(scene, people):
    """Two players: Shapley's value by hand, for the vertical force."""
    rm, om = people
    measured, table, steps, found = found_in(scene, rm, om, noise=2.0)
    error = (measured - table)[:, 2]
    players = steps[:, 2].reshape(len(error), len(rm), -1).sum(axis=2)[:, [0, 2]].T
    whole = np.mean(error**2)

    def goes(*taken):
        return whole - np.mean((error - sum(taken)) ** 2)

    first, second = players
    value = (goes(first) + goes(first, second) - goes(second)) / 2 / whole
    assert found[2].shares[0].sum() == pytest.approx(value)


def test_nothing_to_judge_gives_nothing(scene, people):
    measured, table, steps, _ = found_in(scene, *people, noise=0.0)
    none = np.zeros(len(scene.q), dtype=bool)
    assert attributions(measured, table, steps, none, GROUND) == ()


def test_moments_do_not_hang_on_the_worlds_origin(scene, people):
    """The same lab, its origin 3 m away."""
    measured, table, steps, found = found_in(scene, *people, noise=1.0)
    away = np.array([3.0, -2.0, 0.0])

    def moved(wrench):
        result = wrench.copy()
        result[:, 3:] += np.cross(away, wrench[:, :3], axisb=1, axisc=1)
        return result

    judged = np.ones(len(measured), dtype=bool)
    again = attributions(moved(measured), moved(table), moved(steps), judged, GROUND)
    for one, other in zip(found, again, strict=True):
        np.testing.assert_allclose(one.shares, other.shares, atol=1e-8)
