"""Joint moments of a model with a named cause: of tilted axes, and of a load in two hands."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bsip_cli.diagnosis.cause import Cause
from bsip_cli.dynamics.joint_moments import Ground, joint_loads
from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.effects.loads import Implement
from bsip_cli.effects.scene import Scene
from bsip_cli.stages.joints import in_true_axes, other_loads, sharing
from tests.dynamics.test_joint_moments import KNOWN, feet, motion, phi_of
from tests.effects.moving_scene import unwritable

SOME = slice(0, 1000, 25)


def cause(effect: str, target: str, *values: float) -> Cause:
    return Cause(EFFECTS[effect], target, ("one",), np.array(values), np.array([values]))


@pytest.mark.parametrize("effect", ["gravity_tilt", "camera_frame"])
def test_tilted_axes_leave_the_moments_as_they_are(effect):
    body, q, v, a = (x if k == 0 else x[SOME] for k, x in enumerate(motion()))
    ground = {k: Ground(g.wrench[SOME], g.noise[SOME], g.noise_at_m) for k, g in feet(1000).items()}
    truth = joint_loads(body.person, q, v, a, phi_of(body), ground, KNOWN)
    turn = Rotation.from_rotvec([0.02, -0.01, 0.0])
    base = (turn * Rotation.from_quat(q[:, 3:7])).as_quat()
    seen, on_feet = np.hstack([turn.apply(q[:, :3]), base, q[:, 7:]]), ground
    if effect == "gravity_tilt":
        on_feet = {
            foot: Ground(
                np.hstack([turn.apply(x) for x in np.hsplit(g.wrench, 2)]), g.noise, g.noise_at_m
            )
            for foot, g in ground.items()
        }
    wrong = joint_loads(body.person, seen, v, a, phi_of(body), on_feet, KNOWN)
    assert np.abs(wrong.moment_Nm - truth.moment_Nm).max() > 1.0
    on_feet = {k: Ground(unwritable(g.wrench), g.noise, g.noise_at_m) for k, g in on_feet.items()}
    upright, on_feet = in_true_axes(unwritable(seen), on_feet, [cause(effect, "", 0.02, -0.01)])
    right = joint_loads(body.person, upright, v, a, phi_of(body), on_feet, KNOWN)
    assert np.abs(right.moment_Nm - truth.moment_Nm).max() < 1e-6


def test_what_two_hands_hold_loads_the_waist_whole():
    body, q, v, a = (x if k == 0 else x[SOME] for k, x in enumerate(motion()))
    person, phi = body.person, phi_of(body)
    valid = np.ones(len(q), bool)
    scene = Scene(np.arange(len(q)) / 40.0, person, q, v, a, phi[:, 0], (), valid)
    both = cause("implement", "hand_l+hand_r", 0.4, 1.0, 0.3, 0.2, 4 / 3)
    touched = other_loads(scene, {}, [both])
    needs = Implement().change(scene, both.target, both.values)
    assert np.abs(touched["hand_l"].wrench + touched["hand_r"].wrench + needs).max() < 1e-9
    names = np.array(person.skeleton.joints[1:])
    assert set(names[sharing(person, [both])]) == {
        f"{joint}_{side}" for joint in ("shoulder", "elbow", "wrist") for side in "lr"
    }
    assert not sharing(person, [cause("added_mass", "hand_l", 1.0, 0.0, 0.0, 0.0)]).any()
