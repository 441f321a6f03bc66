"""Clavicles without mass: what they change in the forces, and that they add no parameters."""

from __future__ import annotations

import numpy as np
import pytest

from bsip_cli.body.anthropometry import regress
from bsip_cli.dynamics.base_parameters import expressions, find_basis
from bsip_cli.dynamics.ground_wrench import (
    bodies_of,
    pinocchio_model,
    predicted_wrench,
    wrench_regressor,
    wrench_response,
)
from bsip_cli.dynamics.segment_motion import segment_motion
from tests.body.standing_person import Swing, parameters_of, standing, with_girdle

GIRDLE = with_girdle().person
RODS = [i for i, name in enumerate(GIRDLE.skeleton.segments) if name.startswith("clavicle")]


def moving(person, q, seed=3):
    return Swing(pinocchio_model(person), q, seed, 0.4).sampled(2.0, 25.0)[1:]


def table_phi(person):
    return parameters_of(person, regress(person, "M", 72.0).inertias)


def test_parameters_are_those_of_the_fifteen():
    model = pinocchio_model(GIRDLE)
    assert model.njoints - 1 == 17 and len(bodies_of(model)) == 15
    assert set(range(1, 18)) - set(bodies_of(model)) == {i + 1 for i in RODS}
    q, v, a = moving(GIRDLE, with_girdle().q)
    rows = wrench_regressor(model, q, v, a, np.zeros(3))
    assert rows.shape == (len(q), 6, 150)
    inertias = regress(GIRDLE, "M", 72.0).inertias
    assert len(inertias) == 15 and sum(i.mass_kg for i in inertias) == pytest.approx(72.0)


def test_arms_that_move_against_the_trunk_show_their_mass():
    """Two combinations more than the 128 of shoulders that are fixed to it: a mass each."""
    basis = find_basis(pinocchio_model(GIRDLE))
    assert basis.rank == 130
    names = [name for name, _, _ in expressions(basis, GIRDLE.skeleton.body_names)]
    fixed = find_basis(pinocchio_model(standing().person))
    before = [n for n, _, _ in expressions(fixed, standing().person.skeleton.body_names)]
    assert set(names) - set(before) == {"m upper_arm_l", "m upper_arm_r"}


def test_still_clavicles_are_none():
    """The wrench of the 15 segments, whose shoulders are fixed to the trunk."""
    plain = standing()
    q, v, a = moving(plain.person, plain.q)
    wide, skeleton = with_girdle().q, GIRDLE.skeleton
    q17 = np.zeros((len(q), len(wide)))
    v17, a17 = np.zeros((2, len(q), len(skeleton.v_names)))
    own = [skeleton.q_names.index(name) for name in plain.person.skeleton.q_names]
    q17[:, own] = q
    for i in RODS:
        q17[:, skeleton.q_starts[i] + 3] = 1.0
    own = [skeleton.v_names.index(name) for name in plain.person.skeleton.v_names]
    v17[:, own], a17[:, own] = v, a
    phi = table_phi(plain.person)[:, None]
    expected = predicted_wrench(pinocchio_model(plain.person), q, v, a, phi, np.zeros(3))
    found = predicted_wrench(pinocchio_model(GIRDLE), q17, v17, a17, phi, np.zeros(3))
    np.testing.assert_allclose(found, expected, atol=1e-8)


def test_the_wrench_is_the_sum_over_the_bodies():
    """By Newton and Euler for each segment on its own, from where it moves in the world."""
    model, phi = pinocchio_model(GIRDLE), table_phi(GIRDLE)
    q, v, a = moving(GIRDLE, with_girdle().q)
    motion = segment_motion(model, q, v, a)
    alone = [
        motion.wrenches(i) @ part
        for i, part in zip(GIRDLE.skeleton.bodies, phi.reshape(-1, 10), strict=True)
    ]
    found = predicted_wrench(model, q, v, a, phi[:, None], np.zeros(3))[..., 0]
    np.testing.assert_allclose(found, sum(alone), atol=1e-8)


def test_the_response_to_the_clavicles_motion():
    """Derivative of the wrench by the accelerations, against differences."""
    model, phi = pinocchio_model(GIRDLE), table_phi(GIRDLE)
    q, v, a = (x[:3] for x in moving(GIRDLE, with_girdle().q))
    response = wrench_response(GIRDLE, phi, q, v, a, 25.0)
    for at in (GIRDLE.skeleton.v_starts[i] for i in RODS):
        turned = a.copy()
        turned[:, at] += 1.0
        after, before = (
            predicted_wrench(model, q, v, x, phi[:, None], np.zeros(3))[..., 0] for x in (turned, a)
        )
        np.testing.assert_allclose(response.to_acceleration[:, :, at], after - before, atol=1e-8)
        assert np.abs(after - before).max() > 0.1
