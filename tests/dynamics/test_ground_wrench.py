"""The regressor against Pinocchio's inverse dynamics and against Newton's and Euler's laws."""

import numpy as np
import pinocchio as pin
import pytest

from bsip_cli.body.anthropometry import regress
from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.body.person import load_parameters
from bsip_cli.dynamics.ground_wrench import (
    move_moments,
    pinocchio_model,
    predicted_wrench,
    rotations_of,
    skew,
    wrench_regressor,
)
from tests.body.standing_person import (
    joint_frames,
    parameters_of,
    random_states,
    standing,
    tilted_person,
)
from tests.body.test_inertia import random_body
from tests.dynamics.newton_euler import driving_wrench
from tests.dynamics.test_joint_moments import STEP_S, G, motion, newton_euler, phi_of

ORIGIN = np.zeros(3)
INNER = slice(8, -8)  # differences at the ends are wrong


def random_phi(seed):
    """(150,) parameters of fifteen clouds of points."""
    rng = np.random.default_rng(seed)
    return np.concatenate([random_body(rng)[0].phi() for _ in range(15)])


def with_inertias(model, phi):
    """The model as Pinocchio computes with it: inertias in its joints."""
    full = model.copy()
    for i, row in enumerate(phi.reshape(-1, 10)):
        full.inertias[i + 1] = pin.Inertia.FromDynamicParameters(row)
    return full


def rnea_wrench(model, phi, q, v, a, reference):
    """(N, 6) force and moment on the base by inverse dynamics, world axes, about a point."""
    full = with_inertias(model, phi)
    data = full.createData()
    rows = []
    for one in zip(q, v, a, strict=True):
        force = pin.Force(pin.rnea(full, data, *one)[:6])
        pin.forwardKinematics(full, data, one[0])
        at_reference = pin.SE3(np.eye(3), -reference) * data.oMi[1]
        rows.append(at_reference.act(force).vector)
    return np.array(rows)


@pytest.mark.parametrize("reference", [(0.0, 0.0, 0.0), (1.3, -0.4, 0.2)])
def test_regressor_equals_inverse_dynamics(reference):
    model = pinocchio_model(tilted_person())
    phi = random_phi(1)
    q, v, a = random_states(model, 20, seed=2)
    rows = wrench_regressor(model, q, v, a, np.array(reference))
    expected = rnea_wrench(model, phi, q, v, a, np.array(reference))
    np.testing.assert_allclose(rows @ phi, expected, rtol=0, atol=1e-10 * np.abs(expected).max())


@pytest.mark.parametrize("girdle", [False, True])
def test_the_wrench_is_that_of_newton_and_euler(girdle):
    """Summed over the bodies from their places alone: no velocity or acceleration enters."""
    body, q, v, a = motion(girdle)
    expected = sum(newton_euler(body, q)[2].values())[INNER]
    found = predicted_wrench(pinocchio_model(body.person), q, v, a, phi_of(body), ORIGIN)
    weight = sum(inertia.mass_kg for inertia in body.inertias) * GRAVITY_M_S2
    scale = np.linalg.norm(expected[:, 3:], axis=1).min()
    off = np.abs(found[INNER, :, 0] - expected)
    assert np.abs(expected[:, :2]).max() > 20
    assert off[:, :3].max() < 1e-5 * weight and off[:, 3:].max() < 1e-5 * scale


@pytest.mark.parametrize("segment", ["lower_torso", "upper_torso", "forearm_r", "foot_l"])
def test_the_wrench_of_a_load_is_newtons(segment):
    body, q, v, a = motion()
    person, mass_kg, place_m = body.person, 2.0, np.array([0.04, -0.1, 0.02])
    i = person.skeleton.index(segment)
    R, p = joint_frames(person, q)
    path = p[:, i] + R[:, i] @ (place_m + person.origin_in_joint_m[i])
    expected = driving_wrench(R[:, i], path, mass_kg, np.zeros((3, 3)), G, STEP_S)
    phi = load_parameters([(segment, mass_kg, place_m)], person)[:, None]
    found = predicted_wrench(pinocchio_model(person), q, v, a, phi, ORIGIN)[..., 0]
    np.testing.assert_allclose(found[INNER], expected[INNER], rtol=0, atol=1e-5)


def test_a_person_at_rest_presses_down_below_the_centre_of_mass():
    person = standing().person
    model = pinocchio_model(person)
    phi = parameters_of(person, regress(person, "F", 60.0).inertias)
    zero = np.zeros((1, model.nv))
    wrench = predicted_wrench(model, standing().q[None], zero, zero, phi[:, None], np.zeros(3))
    full = with_inertias(model, phi)
    com = pin.centerOfMass(full, full.createData(), standing().q)
    weight = 60.0 * GRAVITY_M_S2
    expected = [0, 0, weight, com[1] * weight, -com[0] * weight, 0]
    np.testing.assert_allclose(wrench[0, :, 0], expected, atol=1e-10)


def test_blocks_change_nothing():
    model = pinocchio_model(standing().person)
    q, v, a = random_states(model, 13, seed=4)
    phi = np.stack([random_phi(seed) for seed in (5, 6)], axis=1)
    whole = predicted_wrench(model, q, v, a, phi, np.ones(3), block=100)
    parts = predicted_wrench(model, q, v, a, phi, np.ones(3), block=5)
    np.testing.assert_array_equal(whole, parts)
    assert whole.shape == (13, 6, 2)


def test_moved_moments_are_those_of_the_regressor():
    model = pinocchio_model(standing().person)
    q, v, a = random_states(model, 6, seed=8)
    phi = random_phi(9)[:, None]
    reference = np.array([0.4, -1.2, 0.3])
    about_origin = predicted_wrench(model, q, v, a, phi, np.zeros(3))[..., 0]
    about_point = predicted_wrench(model, q, v, a, phi, reference)[..., 0]
    before = about_origin.copy()
    np.testing.assert_allclose(move_moments(about_origin, reference), about_point, atol=1e-9)
    np.testing.assert_array_equal(about_origin, before)


def test_rotations_and_skew():
    rng = np.random.default_rng(10)
    quaternions = rng.normal(size=(5, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1)[:, None]
    theirs = [pin.Quaternion(one).toRotationMatrix() for one in quaternions]
    np.testing.assert_allclose(rotations_of(quaternions), theirs, atol=1e-14)
    a, b = rng.normal(size=(2, 5, 3))
    np.testing.assert_allclose((skew(a) @ b[..., None])[..., 0], np.cross(a, b), atol=1e-14)
