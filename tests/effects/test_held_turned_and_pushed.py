"""What hands hold, turned cameras and constant forces against mechanics written out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bsip_cli.body.inertia import Inertia
from bsip_cli.effects.loads import CENTRE_M, ExternalForce, Implement, ObjectHandled, centre_m
from bsip_cli.effects.plates import CameraFrame
from bsip_cli.effects.scene import Scene
from tests.effects.moving_scene import moving, phi_with, rms, standing_still

G = 9.80665
CLUB = np.array([0.25, 1.0, 0.4, -0.3, 4 / 3])  # 0.33 kg, 0.75 m from the hand


def test_an_implement_is_another_body_of_the_hand():
    scene = moving()
    hand = scene.person.skeleton.index("hand_r")
    axis, distance = centre_m(CLUB) / 0.75, 0.75
    place = scene.person.origin_in_joint_m[hand] + scene.centre_of("hand_r") + distance * axis
    mass = CLUB[0] / distance
    tensor = mass * distance**2 / 3 * (np.eye(3) - np.outer(axis, axis))
    heavier = phi_with(scene, "hand_r", Inertia(mass, place, tensor).phi())
    expected = scene.wrench_of(heavier) - scene.predicted
    np.testing.assert_allclose(Implement().change(scene, "hand_r", CLUB), expected, atol=1e-8)
    told = {name: value for name, _, value in Implement().reported(scene, "hand_r", CLUB)}
    assert told["mass"] == pytest.approx(1 / 3)
    assert told["centre"] == pytest.approx(0.75)
    assert told["inertia"] == pytest.approx(mass * distance**2 * 4 / 3)


def test_the_plates_do_not_tell_an_implements_shape():
    scene = moving()
    one = Implement().change(scene, "hand_l", CLUB)
    others = Implement().alike(scene, "hand_l", CLUB)
    np.testing.assert_allclose(others[0], CLUB)
    centres = others[:, 1] / others[:, 4]
    assert centres.min() == pytest.approx(0.5) and centres.max() == pytest.approx(CENTRE_M)
    place = scene.centre("hand_l")
    for other in others:
        mass = other[0] / (other[1] / other[4]) - 1 / 3
        change = Implement().change(scene, "hand_l", other) - one
        np.testing.assert_allclose(change, mass * place.carrying_wrench(), atol=1e-8)


def test_in_both_hands_it_weighs_between_them():
    scene = standing_still()
    assert Implement().targets(scene) == ("hand_l", "hand_r")  # they are at the person's sides
    points = [scene.centre(h).position_m[0] for h in ("hand_l", "hand_r")]
    left = scene.motion.rotation[0, scene.person.skeleton.index("hand_l")]
    x, y, _ = np.mean(points, axis=0) + left @ centre_m(CLUB)
    change = Implement().change(scene, "hand_l+hand_r", CLUB)[10]
    np.testing.assert_allclose(change, np.array([0, 0, 1, y, -x, 0]) * G / 3, atol=1e-8)


def test_hands_that_touch_throughout_may_hold_one_thing():
    scene = standing_still()
    apart = [scene.centre(h).position_m[0] for h in ("hand_l", "hand_r")]
    origins = scene.person.origin_in_joint_m.copy()
    right = scene.person.skeleton.index("hand_r")
    turn = scene.motion.rotation[0, right]
    # The same person with a right hand whose origin lies 5 cm beside the left hand's centre.
    origins[right] += turn.T @ (apart[0] - apart[1] + [0.0, 0.0, 0.05])
    moment = scene.phi[10 * right] * (origins - scene.person.origin_in_joint_m)[right]
    phi = phi_with(scene, "hand_r", np.concatenate([[0.0], moment, np.zeros(6)]))
    near = replace(scene, phi=phi, person=replace(scene.person, origin_in_joint_m=origins))
    assert Implement().targets(near)[-1] == "hand_l+hand_r"


def turned(scene: Scene, turn: Rotation) -> Scene:
    """The same motion seen by cameras that turn it about the world's origin."""
    q = scene.q.copy()
    q[:, :3] = turn.apply(q[:, :3])
    q[:, 3:7] = (turn * Rotation.from_quat(q[:, 3:7])).as_quat()
    return replace(scene, q=q)


def test_turned_cameras_turn_the_motion_but_not_its_weight():
    scene = moving()
    values = np.array([0.02, -0.03])
    seen = turned(scene, Rotation.from_rotvec([*values, 0.0]))
    assert rms(seen.predicted - scene.predicted).max() > 5.0
    change = CameraFrame().change(seen, "", values)
    np.testing.assert_allclose(seen.predicted + change, scene.predicted, atol=1e-6)


def test_a_constant_force_is_missing_from_the_plates():
    scene, force = standing_still(), np.array([5.0, -10.0, 60.0])
    place = scene.centre("upper_torso").position_m
    change = ExternalForce().change(scene, "upper_torso", force)
    np.testing.assert_allclose(change[:, :3], np.tile(-force, (len(change), 1)))
    np.testing.assert_allclose(change[:, 3:], np.cross(place, -force), atol=1e-9)


def test_an_object_weighs_between_picking_up_and_putting_down():
    effect, scene = ObjectHandled(), moving()
    change, times = effect.change(scene, "hand_l", np.array([1.5, 2.0, 3.5])), scene.times_s
    held = (times > 2.02) & (times < 3.48)
    weight = 1.5 * scene.centre("hand_l").carrying_wrench()
    np.testing.assert_allclose(change[held], weight[held], atol=1e-9)
    assert not change[(times < 1.98) | (times > 3.52)].any()
    assert effect.possible(scene, "hand_l", np.array([1.5, 2.0, 3.5]))
    for start, end in ((0.5, 3.0), (2.0, 5.9), (3.5, 2.0), (2.0, 2.1)):
        assert not effect.possible(scene, "hand_l", np.array([1.5, start, end]))
    windows = list(effect.scans(scene, "hand_l"))
    assert windows and all(effect.possible(scene, "hand_l", np.array([1.0, *w])) for w in windows)
