"""The wrench that a load needs is Newton's: mass times acceleration less gravity, at its place."""

import numpy as np
import pinocchio as pin
import pytest

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.body.person import load_parameters
from bsip_cli.dynamics.ground_wrench import pinocchio_model, predicted_wrench
from tests.body.standing_person import Swing, standing


@pytest.mark.parametrize("segment", ["lower_torso", "upper_torso", "forearm_r", "foot_l"])
def test_wrench_of_a_load(segment):
    person = standing().person
    model = pinocchio_model(person)
    swing = Swing(model, standing().q, seed=5, amplitude=0.5)
    i = person.skeleton.index(segment)
    mass_kg, position_m = 2.0, np.array([0.04, -0.1, 0.02])
    data, h = model.createData(), 1e-3

    def place(t):
        pin.forwardKinematics(model, data, swing.q(t))
        return data.oMi[i + 1].act(position_m + person.origin_in_joint_m[i])

    phi = load_parameters([(segment, mass_kg, position_m)], person)[:, None]
    times, q, v, a = swing.sampled(0.5, 20.0)
    found = predicted_wrench(model, q, v, a, phi, np.zeros(3))[..., 0]
    stencil = np.array([-1.0, 16.0, -30.0, 16.0, -1.0]) / (12 * h * h)
    for t, wrench in zip(times, found, strict=True):
        acceleration = stencil @ np.array([place(t + k * h) for k in (-2, -1, 0, 1, 2)])
        force = mass_kg * (acceleration + np.array([0.0, 0.0, GRAVITY_M_S2]))
        expected = [*force, *np.cross(place(t), force)]
        np.testing.assert_allclose(wrench, expected, rtol=0, atol=1e-5)
