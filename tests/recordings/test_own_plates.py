"""Which plate bears which foot: feet that stand still at known places, loads beneath them."""

from __future__ import annotations

import numpy as np
import pytest

from bsip_cli.recordings.contacts import Reading, foot_forces, plate_noise

COUNT, RATE_HZ = 200, 100.0
LEFT, RIGHT = np.array([0.0, 0.1, 0.0]), np.array([0.0, -0.1, 0.0])
OUTLINE = np.array([[0.3, 0.2, 0.0], [-0.3, 0.2, 0.0], [-0.3, -0.2, 0.0], [0.3, -0.2, 0.0]])
ASIDE, AHEAD = np.array([0.0, 0.2, 0.0]), np.array([1.0, 0.0, 0.0])
YES = np.ones(COUNT, bool)


def foot(at: np.ndarray) -> np.ndarray:
    """Heel, toe and ankle (N, 3, 3)."""
    points = at + np.array([[-0.08, 0.0, 0.02], [0.12, 0.0, 0.02], [-0.04, 0.0, 0.08]])
    return np.tile(points, (COUNT, 1, 1))


def load(at: np.ndarray, newton=300.0) -> np.ndarray:
    force = np.zeros((COUNT, 3))
    force[:, 2] = newton
    return np.hstack([force, np.cross(at, force)])


FEET = {"l": foot(LEFT), "r": foot(RIGHT)}
BOTH = {"l": YES, "r": YES}


def told(plates, on_ground=BOTH, on_plate=BOTH):
    return foot_forces(plates, FEET, on_ground, on_plate, RATE_HZ)


def test_each_foot_gets_the_wrench_of_its_own_plate():
    left, right = load(LEFT, 400.0), load(RIGHT, 300.0)
    shift = np.array([0.0, 0.2, 0.0])
    found = told([Reading(left, OUTLINE + shift), Reading(right, OUTLINE - shift)])
    np.testing.assert_allclose(found.wrench["l"], left)
    np.testing.assert_allclose(found.wrench["r"], right)


def test_a_foot_on_two_plates_gets_both():
    halves = [
        Reading(load(LEFT + x * AHEAD, 200.0), OUTLINE + ASIDE + y * AHEAD)
        for x, y in ((-0.05, -0.3), (0.05, 0.3))
    ]
    found = told([*halves, Reading(load(RIGHT), OUTLINE - ASIDE)])
    np.testing.assert_allclose(found.wrench["l"][:, 2], 400.0)
    np.testing.assert_allclose(found.wrench["r"][:, 2], 300.0)


@pytest.mark.parametrize("outline", [OUTLINE, None])
def test_a_plate_under_both_feet_tells_of_neither(outline):
    found = told([Reading(load((LEFT + RIGHT) / 2, 700.0), outline)])
    assert np.isnan(found.wrench["l"]).all() and np.isnan(found.wrench["r"]).all()
    words = (
        "both feet are on one plate"
        if outline is not None
        else ("no foot is clearly under a plate's load")
    )
    assert found.unknown["l"][words].all()


def test_weight_that_shifts_over_a_plate_without_outline_is_no_foots():
    """Now over the left foot, now over the right one: both stand on it."""
    course = load(LEFT, 700.0)
    course[COUNT // 2 :] = load(RIGHT, 700.0)[COUNT // 2 :]
    found = told([Reading(course, None)])
    assert np.isnan(found.wrench["l"]).all() and np.isnan(found.wrench["r"]).all()


def test_plates_without_outline_are_told_by_their_loads():
    left, right = load(LEFT, 400.0), load(RIGHT, 300.0)
    found = told([Reading(right, None), Reading(left, None)])
    np.testing.assert_allclose(found.wrench["l"], left)
    np.testing.assert_allclose(found.wrench["r"], right)


def test_a_foot_in_the_air_bears_nothing_and_one_beside_is_unknown():
    air = {"l": YES, "r": ~YES}
    plate = Reading(load(LEFT, 700.0), OUTLINE + ASIDE)
    found = told([plate], air, air)
    assert (found.wrench["r"] == 0.0).all() and np.isfinite(found.wrench["l"]).all()
    beside = told([plate], BOTH, air)
    assert np.isnan(beside.wrench["r"]).all() and np.isfinite(beside.wrench["l"]).all()
    assert np.isnan(told([], BOTH, BOTH).wrench["l"]).all()


def test_a_broken_sample_is_not_zero():
    wrench = load(LEFT, 700.0)
    wrench[50] = np.nan
    found = told([Reading(wrench, OUTLINE + ASIDE)], {"l": YES, "r": ~YES}, BOTH)
    assert np.isnan(found.wrench["l"][50]).all() and np.isfinite(found.wrench["l"][60]).all()


def test_noise_of_a_loaded_plate_is_its_white_noise():
    sd = np.array([1.0, 2.0, 3.0, 0.1, 0.2, 0.3])
    at = np.array([0.5, 0.4, 0.0])
    t = np.arange(20000) / 1000.0
    wrench = np.random.default_rng(2).normal(size=(len(t), 6)) * sd
    wrench[:, 2] += 700 + 100 * np.sin(2 * np.pi * t)
    wrench[:, 3:] += np.cross(at, wrench[:, :3])
    np.testing.assert_allclose(plate_noise(Reading(wrench, None), at), sd, rtol=0.05)
