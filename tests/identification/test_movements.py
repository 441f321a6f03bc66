"""The movements that people may be asked for, as motions of a person."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from bsip_cli.identification.movement_gain import (
    DURATION_S,
    RATE_HZ,
    load_movements,
    motion_of,
    possible,
)
from tests.identification.synthetic_identification import world

BY_NAME = {movement.name: movement for movement in load_movements()}
FORWARD, RIGHT, UP = (1, 0, 0), (0, -1, 0), (0, 0, 1)  # the person faces the world's X


def motion(name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return motion_of(BY_NAME[name], world().person, world().model)


def places(q: np.ndarray, segment: str) -> np.ndarray:
    """(N, 3) middle of a segment's markers [m] over the motion."""
    person, model = world().person, world().model
    at = person.skeleton.index(segment)
    middle = person.markers_in_joint_m()[person.marker_segments == at].mean(axis=0)
    data, found = model.createData(), []
    for row in q:
        pin.forwardKinematics(model, data, row)
        found.append(data.oMi[at + 1].act(middle))
    return np.array(found)


@pytest.mark.parametrize("name", sorted(BY_NAME))
def test_the_stance_foot_stays_and_standing_begins_and_ends(name):
    q, v, a = motion(name)
    foot = places(q, f"foot_{BY_NAME[name].stance}")
    np.testing.assert_allclose(foot, foot[:1] + np.zeros_like(foot), atol=1e-9)
    np.testing.assert_allclose(q[0], q[-1], atol=1e-9)
    assert np.abs(v[[0, -1]]).max() < 0.02
    assert len(q) == len(v) == len(a) == round(DURATION_S * RATE_HZ) + 1
    assert places(q, "head")[0, 2] > 1.5  # above the ground


def test_velocity_and_acceleration_follow_the_angle():
    _, v, a = motion("elbows")
    swing = BY_NAME["elbows"].swings[0]
    fine = np.linspace(0, DURATION_S, 40 * round(DURATION_S * RATE_HZ) + 1)
    speed = np.gradient(swing.angle_rad(fine), fine, edge_order=2)
    rise = np.gradient(speed, fine, edge_order=2)
    skeleton = world().person.skeleton
    column = skeleton.v_names.index("elbow_l_angle")
    assert np.abs(v[:, column] - speed[::40]).max() < 0.04 * np.abs(speed).max()
    assert np.abs(a[:, column] - rise[::40]).max() < 0.04 * np.abs(rise).max()


@pytest.mark.parametrize(
    ("name", "segment", "direction", "least_m"),
    [
        ("arms_forward", "hand_l", UP, 0.5),
        ("arms_forward", "hand_r", FORWARD, 0.4),
        ("arms_sideways", "hand_l", (0, 1, 0), 0.4),
        ("arms_sideways", "hand_r", RIGHT, 0.4),
        ("elbows", "hand_r", UP, 0.2),
        ("trunk_bends", "head", FORWARD, 0.3),
        ("bows", "head", FORWARD, 0.4),
        ("squats", "lower_torso", (0, 0, -1), 0.2),
        ("leg_swings_forward_r", "foot_r", FORWARD, 0.4),
        ("leg_swings_sideways_l", "foot_l", (0, 1, 0), 0.3),
        ("leg_swings_sideways_r", "foot_r", RIGHT, 0.3),
        ("knee_lifts_l", "shank_l", UP, 0.3),
        ("kicks_r", "foot_r", UP, 0.2),
    ],
)
def test_limbs_go_where_the_words_say(name, segment, direction, least_m):
    path = places(motion(name)[0], segment)
    along = (path - path[0]) @ direction
    assert along.max() > least_m
    assert -along.min() < 0.6 * along.max()


@pytest.mark.parametrize(
    "name",
    ["squats", "bounces", "bows", "weight_shifts", "leaning", "pelvis_turns", "pelvis_circles"],
)
def test_the_other_foot_stays_down_too(name):
    """It may slide aside by some centimetres: knees do not bend exactly about Z."""
    foot = places(motion(name)[0], "foot_l")
    assert np.ptp(foot[:, 2]) < 0.02
    assert np.ptp(foot, axis=0).max() < 0.10


def test_each_side_has_its_own_words():
    assert BY_NAME["kicks_l"].text.startswith("stand on the right leg, hold the left thigh")
    assert BY_NAME["kicks_l"].stance == "r"
    assert not any("{" in movement.text + movement.name for movement in BY_NAME.values())


def test_joints_that_no_marker_shows_are_not_asked_for():
    person = world().person
    held = np.array([joint == "wrist_l" for joint in person.skeleton.joints])
    blind = replace(person, held=held)
    names = {name for name, movement in BY_NAME.items() if possible(movement, blind)}
    assert set(BY_NAME) - names == {"wrists_l"}


def test_joints_that_the_skeleton_lacks_are_not_asked_for():
    person = world().person
    joints = tuple(name.replace("neck", "nape") for name in person.skeleton.joints)
    other = replace(person, skeleton=replace(person.skeleton, joints=joints))
    names = {name for name, movement in BY_NAME.items() if possible(movement, other)}
    assert set(BY_NAME) - names == {
        "head_nods",
        "head_turns",
        "head_tilts",
        "head_circles",
    }
