"""Inertia of bodies: its parametrisations, the nearest physical one, and loads as points."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from bsip_cli.body.inertia import (
    Inertia,
    from_phi,
    from_readable,
    nearest_physical_tensor,
    readable_jacobian,
    second_moments,
)
from bsip_cli.body.person import load_parameters
from tests.body.standing_person import standing


def random_body(rng):
    """A cloud of points: physical by construction; the second moments are known too."""
    points = rng.normal(0, [0.1, 0.2, 0.05], (30, 3)) @ pin.exp3(rng.normal(0, 1, 3))
    mass = rng.uniform(0.5, 20)
    com = rng.normal(0, 0.3, 3)
    around = points - points.mean(axis=0)
    moments = mass * around.T @ around / len(points)
    tensor = np.trace(moments) * np.eye(3) - moments
    return Inertia(mass, com, tensor), moments


@pytest.fixture(params=range(4))
def body(request):
    return random_body(np.random.default_rng(request.param))


def test_round_trips(body):
    """Between parameters in Pinocchio's order and those that people read."""
    inertia, _ = body
    theirs = pin.Inertia(inertia.mass_kg, inertia.com_m, inertia.tensor_kgm2)
    np.testing.assert_allclose(inertia.phi(), theirs.toDynamicParameters(), rtol=1e-13)
    for back in (from_phi(inertia.phi()), from_readable(inertia.readable())):
        assert back.mass_kg == pytest.approx(inertia.mass_kg, rel=1e-14)
        np.testing.assert_allclose(back.com_m, inertia.com_m, rtol=1e-13)
        np.testing.assert_allclose(back.tensor_kgm2, inertia.tensor_kgm2, rtol=0, atol=1e-13)


def test_readable_has_the_order_of_the_tables():
    tensor = np.array([[1.0, 4.0, 5.0], [4.0, 2.0, 6.0], [5.0, 6.0, 3.0]])
    readable = Inertia(7.0, np.array([0.1, 0.2, 0.3]), tensor).readable()
    assert readable.tolist() == [7.0, 0.1, 0.2, 0.3, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]


def test_moved_is_a_change_of_origin(body):
    inertia, _ = body
    origin = np.array([0.3, -0.2, 0.5])
    placement = pin.SE3(np.eye(3), -origin)
    theirs = placement.act(pin.Inertia(inertia.mass_kg, inertia.com_m, inertia.tensor_kgm2))
    moved = inertia.moved(origin)
    np.testing.assert_allclose(moved.phi(), theirs.toDynamicParameters(), rtol=0, atol=1e-12)
    np.testing.assert_allclose(moved.moved(-origin).phi(), inertia.phi(), rtol=0, atol=1e-12)


def test_a_body_without_mass_has_no_centre_of_mass():
    with pytest.raises(ZeroDivisionError):
        from_phi(np.zeros(10))


def test_readable_jacobian_is_the_analytic_one(body):
    inertia, _ = body
    mass, com = inertia.mass_kg, inertia.com_m
    expected = np.zeros((10, 10))
    expected[0, 0] = 1.0
    expected[1:4, 0] = -com / mass
    expected[1:4, 1:4] = np.eye(3) / mass
    tensor_rows = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]
    by_mass = com @ com * np.eye(3) - np.outer(com, com)
    expected[4:, 0] = [by_mass[ij] for ij in tensor_rows]
    for k in range(3):
        e = np.eye(3)[k]
        by_moment = -(2 * com[k] * np.eye(3) - np.outer(e, com) - np.outer(com, e))
        expected[4:, 1 + k] = [by_moment[ij] for ij in tensor_rows]
    pinocchios = [(0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)]
    for k, ij in enumerate(pinocchios):
        expected[4 + tensor_rows.index(ij), 4 + k] = 1.0
    np.testing.assert_allclose(readable_jacobian(inertia.phi()), expected, rtol=1e-6, atol=1e-8)


def test_second_moments(body):
    inertia, moments = body
    np.testing.assert_allclose(second_moments(inertia.tensor_kgm2), moments, rtol=0, atol=1e-14)
    assert inertia.is_physical()


@pytest.mark.parametrize(
    ("principal", "physical"),
    [((1.0, 2.0, 2.9), True), ((1.0, 2.0, 3.1), False), ((-0.1, 1.0, 1.0), False)],
)
def test_triangle_inequality(principal, physical):
    turn = pin.exp3(np.array([0.3, -0.5, 0.2]))
    tensor = turn @ np.diag(principal) @ turn.T
    assert Inertia(1.0, np.zeros(3), tensor).is_physical() is physical
    assert not Inertia(-1.0, np.zeros(3), tensor).is_physical()


def test_a_physical_tensor_with_margin_stays(body):
    inertia, moments = body
    share = np.linalg.eigvalsh(moments) / np.trace(moments)
    assert share[0] > 0.011  # else this test would say nothing
    np.testing.assert_allclose(
        nearest_physical_tensor(inertia.tensor_kgm2), inertia.tensor_kgm2, rtol=1e-12, atol=1e-15
    )


def test_nothing_physical_is_nearer_than_the_nearest():
    """Compared with many tensors that keep the margin the repaired one has."""
    rng = np.random.default_rng(5)
    turn = pin.exp3(rng.normal(0, 1, 3))
    tensor = turn @ np.diag([0.2955, 0.8433, 1.2722]) @ turn.T
    moments = second_moments(tensor)
    floor = 0.01 * np.trace(moments)
    nearest = second_moments(nearest_physical_tensor(tensor))
    assert np.linalg.eigvalsh(nearest)[0] == pytest.approx(floor, rel=1e-9)
    distance = np.linalg.norm(nearest - moments)
    for size in (0.001, 0.01, 0.1):
        for _ in range(200):
            change = rng.normal(0, size, (3, 3))
            candidate = nearest + change + change.T
            values, axes = np.linalg.eigh(candidate)
            candidate = axes @ np.diag(np.maximum(values, floor)) @ axes.T
            assert np.linalg.norm(candidate - moments) >= distance * (1 - 1e-12)


@pytest.mark.parametrize("segment", ["shank_r", "upper_torso"])
def test_parameters_of_a_point_about_the_joint(segment):
    person = standing().person
    torso = person.skeleton.index("upper_torso")
    assert np.linalg.norm(person.origin_in_joint_m[torso]) > 0.3  # its origin is not its joint
    i = person.skeleton.index(segment)
    position_m = np.array([0.02, -0.15, 0.03])
    phi = load_parameters([(segment, 1.5, position_m)], person).reshape(-1, 10)
    x, y, z = r = position_m + person.origin_in_joint_m[i]
    moments = [y * y + z * z, -x * y, x * x + z * z, -x * z, -y * z, x * x + y * y]
    np.testing.assert_allclose(phi[i], 1.5 * np.array([1.0, *r, *moments]), rtol=1e-12)
    assert not np.delete(phi, i, axis=0).any()


def test_loads_add_up():
    person = standing().person
    one = ("hand_l", 0.5, (0.0, -0.05, 0.0))
    two = ("hand_l", 0.3, (0.02, -0.07, 0.01))
    both = load_parameters([one, two], person)
    np.testing.assert_allclose(
        both, load_parameters([one], person) + load_parameters([two], person)
    )
    assert not load_parameters([], person).any()
