"""Which movement would tell most: with outcomes that are known beforehand."""

from dataclasses import replace
from functools import cache

import numpy as np
import pinocchio as pin
import pytest

from bsip_cli.dynamics.ground_wrench import wrench_regressor
from bsip_cli.identification.movement_gain import (
    DURATION_S,
    RATE_HZ,
    advice,
    load_movements,
    motion_of,
    possible,
)
from bsip_cli.identification.problem import Problem, even_noise
from bsip_cli.identification.uncertainty import beforehand, excitation
from tests.identification.synthetic_identification import equations_of, regressor, world

BY_NAME = {movement.name: movement for movement in load_movements()}
ARMS = ("arms_forward", "arms_sideways", "arm_circles_l", "arm_circles_r", "elbows", "throw_l")
LEGS = (
    *(f"leg_circles_{side}" for side in "lr"),
    *(f"kicks_{side}" for side in "lr"),
    *(f"leg_turns_{side}" for side in "lr"),
    "squats",
)
UPPER, LOWER = ("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle")
NOISE = np.array([4.0, 4.0, 4.0, 2.0, 2.0, 2.0])


@cache
def rows_of(names: tuple[str, ...]) -> np.ndarray:
    """(n, 6, 150) regressor of the movements, moments about the ground below the pelvis."""
    model, parts = world().model, []
    for name in names:
        q, v, a = motion_of(BY_NAME[name], world().person, model)
        reference = np.append(q[:, :2].mean(axis=0), 0.0)
        parts.append(wrench_regressor(model, q, v, a, reference))
    return np.concatenate(parts)


def problem_after(names: tuple[str, ...]) -> Problem:
    """Independent samples at a fixed noise, the movements' duration behind them."""
    rows = rows_of(names)
    equations = equations_of(rows, rows @ world().phi_true)
    equations = replace(equations, duration_s=DURATION_S * len(names))
    noise = even_noise(NOISE, len(rows))
    return Problem(equations, noise, world().prior, world().basis, 1.0)


def advise(problem: Problem):
    return advice(problem, world().person, world().model)


def moves(gain, joints: tuple[str, ...]) -> bool:
    return any(swing.joint.startswith(joints) for swing in gain.movement.swings)


@pytest.mark.parametrize(("moved", "own", "other"), [(ARMS, UPPER, LOWER), (LEGS, LOWER, UPPER)])
def test_who_moved_arms_or_legs_is_asked_for_the_others(moved, own, other):
    found = advise(problem_after(moved))
    assert not any(moves(gain, own) for gain in (*found.together, *found.alone[:6]))
    assert all(moves(gain, other) for gain in found.together[:2])


def test_what_was_done_on_one_side_is_asked_for_on_the_other():
    left = tuple(name for name in (*ARMS, *LEGS) if name.endswith("_l"))
    gains = {gain.movement.name: gain.share for gain in advise(problem_after(left)).alone}
    for name in left:
        assert gains[f"{name[:-2]}_r"] > 2 * gains[name]


@pytest.mark.parametrize("name", ["squats", "throw_r", "head_turns"])
def test_the_gain_is_what_the_joined_recordings_have(name):
    """The promise (from every second frame), against the excitation once it is recorded."""
    before, after = problem_after(("trunk_bends",)), problem_after(("trunk_bends", name))
    promised = next(gain for gain in advise(before).alone if gain.movement.name == name)
    gained = excitation(after).segment_share - excitation(before).segment_share
    np.testing.assert_allclose(promised.segments, gained, rtol=0.02, atol=1e-5)
    assert promised.share == pytest.approx(gained.mean(), rel=0.01)
    assert promised.best_segment == np.argmax(gained)


def test_together_counts_what_was_advised_before():
    found = advise(problem_after(("trunk_bends",)))
    alone = {gain.movement.name: gain.share for gain in found.alone}
    shares = [gain.share for gain in found.alone]
    assert shares == sorted(shares, reverse=True)
    assert found.together[0] is found.alone[0]
    for gain in found.together[1:]:  # variances do not always fall less the second time
        assert gain.share < 1.02 * alone[gain.movement.name]
    names = tuple(gain.movement.name for gain in found.together)
    assert len(set(names)) == 3
    gained = (
        excitation(problem_after(("trunk_bends", *names))).segment_share
        - excitation(problem_after(("trunk_bends",))).segment_share
    )
    assert sum(gain.share for gain in found.together) == pytest.approx(gained.mean(), rel=0.01)


def test_no_movement_is_advised_without_joints_to_see():
    person = replace(world().person, held=np.ones(15, dtype=bool))
    found = advice(problem_after(("squats",)), person, world().model)
    assert found.alone == found.together == ()


def test_little_is_left_to_gain_after_much():
    rows = regressor()
    equations = replace(equations_of(rows, rows @ world().phi_true), duration_s=20.0)
    noise = even_noise(NOISE / 100, len(rows))
    rich = Problem(equations, noise, world().prior, world().basis, 1.0)
    assert advise(rich).alone[0].share < 0.1 * advise(problem_after(("squats",))).alone[0].share


def test_forces_become_known_where_the_wrench_is_known():
    """Part of the unknown variance of the wrench, against the covariance of what it sees."""
    before, after = problem_after(("trunk_bends",)), problem_after(("trunk_bends", "squats"))
    promised = next(g for g in advise(before).alone if g.movement.name == "squats")
    names = tuple(gain.movement.name for gain in advise(before).alone)
    motion, _ = problem_after(names).equations.weighted(1 / NOISE**2)
    left = []
    for problem in (before, after):
        seen = beforehand(problem).seen
        known, _ = problem.equations.weighted(problem.noise.weights())
        covariance = np.linalg.inv(known + np.linalg.inv(seen @ seen.T))
        left.append(np.trace(motion @ covariance))
    assert promised.wrench == pytest.approx(1 - left[1] / left[0], rel=0.02)
    assert 0.1 < promised.wrench < 1


# --- the movements that people may be asked for, as motions of a person ---------------------------


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


def test_joints_that_no_marker_shows_or_the_skeleton_lacks_are_not_asked_for():
    person = world().person
    held = np.array([joint == "wrist_l" for joint in person.skeleton.joints])
    joints = tuple(name.replace("neck", "nape") for name in person.skeleton.joints)
    without_neck = replace(person, skeleton=replace(person.skeleton, joints=joints))
    of_the_head = {"head_nods", "head_turns", "head_tilts", "head_circles"}
    for other, lost in ((replace(person, held=held), {"wrists_l"}), (without_neck, of_the_head)):
        names = {name for name, movement in BY_NAME.items() if possible(movement, other)}
        assert set(BY_NAME) - names == lost
