"""Which movement would tell most: with outcomes that are known beforehand."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bsip_cli.dynamics.regressor import wrench_regressor
from bsip_cli.identification.equations import even_noise
from bsip_cli.identification.estimator import Problem
from bsip_cli.identification.movement_gain import DURATION_S, advice, load_movements, motion_of
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
        parts.append(wrench_regressor(model, model.createData(), q, v, a, reference))
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


def test_who_moved_the_arms_is_asked_for_legs():
    found = advise(problem_after(ARMS))
    assert not any(moves(gain, UPPER) for gain in (*found.together, *found.alone[:6]))
    assert all(moves(gain, LOWER) for gain in found.together[:2])


def test_who_moved_the_legs_is_asked_for_arms():
    found = advise(problem_after(LEGS))
    assert not any(moves(gain, LOWER) for gain in (*found.together, *found.alone[:6]))
    assert all(moves(gain, UPPER) for gain in found.together[:2])


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
