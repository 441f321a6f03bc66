"""Regularities without a name: effects like any other, wherever the lab has its origin."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bsip_cli.diagnosis.patterns import (
    PATTERNS,
    Band,
    Bow,
    Curve,
    Drag,
    Lag,
    Play,
    Spring,
    Warming,
    signal_of,
)
from bsip_cli.effects.scene import Scene, place_of_stance_m
from tests.diagnosis.noisy_trial import part_of_moving
from tests.effects.every_effect import assert_tangent_is_the_derivative, some, values_of

EVERY = [pytest.param(one, id=type(one).__name__) for one in PATTERNS]
AWAY_M = np.array([3.0, -2.0, 0.0])


@pytest.fixture(scope="module")
def scene() -> Scene:
    whole = part_of_moving(0, 6)
    limited = tuple(replace(p, wrench=0.98 * p.wrench) for p in whole.plates)
    return replace(whole, plates=limited)


@pytest.mark.parametrize("pattern", EVERY)
def test_nothing_at_the_null_and_more_with_the_size(pattern, scene):
    for target in some(pattern, scene):
        none, one = (
            pattern.change(scene, target, values_of(pattern, scene, target, k)) for k in (0, 1)
        )
        np.testing.assert_allclose(none, 0, atol=1e-8)
        assert np.abs(one).max() > 0.1


@pytest.mark.parametrize("pattern", EVERY)
@pytest.mark.parametrize("size", [0.0, 1.0])
def test_the_tangent_is_the_derivative(pattern, scene, size):
    assert_tangent_is_the_derivative(pattern, scene, size)


@pytest.mark.parametrize("pattern", EVERY)
def test_a_step_below_the_least_size_is_still_finite(pattern, scene):
    """As derivatives by scanned values ask, which step by a tenth of the typical size."""
    target = pattern.targets(scene)[0]
    parameters = pattern.parameters(scene, target)
    values = values_of(pattern, scene, target, 1.0)
    for k, p in enumerate(parameters):
        below = values.copy()
        below[k] = p.least - 0.1 * p.typical
        assert np.isfinite(pattern.change(scene, target, below)).all()


@pytest.mark.parametrize("pattern", [Curve(), Play(), Lag(), Warming(), Bow()])
@pytest.mark.parametrize("channel", ["fx", "mx", "mz"])
def test_where_the_lab_has_its_origin_says_nothing(pattern, channel, scene):
    """The same person elsewhere: the same signal about the place where they stand."""
    q = scene.q.copy()
    q[:, :3] += AWAY_M
    elsewhere = replace(scene, q=q)
    values = values_of(pattern, scene, channel, 1.0)
    here, there = (
        signal_of(one, pattern.change(one, channel, values), channel) for one in (scene, elsewhere)
    )
    assert np.abs(here).max() > 0
    np.testing.assert_allclose(there, here, atol=1e-6 * np.abs(here).max())


def test_a_moment_is_about_where_the_valid_frames_stand(scene):
    part = replace(scene, valid=scene.times_s > 3)
    place = place_of_stance_m(part)
    np.testing.assert_allclose(place, [*part.q[part.valid, :2].mean(axis=0), 0])
    pushed = Curve().change(part, "fz", np.array([10.0]))
    np.testing.assert_allclose(signal_of(part, pushed, "mx"), 0, atol=1e-9)


@pytest.mark.parametrize(
    ("pattern", "target", "size", "said"),
    [
        (Curve(), "fz", -12.0, "grows with the square of the load (-12.0 N at body weight)"),
        (Bow(), "my", 3.0, "goes to +3.0 N m by the middle and comes back"),
        (Spring(), "x by x", 80.0, "back to its mean place, as of an elastic or a rope: 80 N"),
        (Spring(), "x by x", -80.0, "away from its mean place"),
        (Spring(), "x by z", 80.0, "a force on the pelvis along the lab's X axis: 80 N per metre"),
        (Drag(), "y", 25.0, "against its velocity along the lab's Y axis: 25 N per m/s"),
        (Drag(), "y", -25.0, "with its velocity"),
        (Band(), "hand_l", 30.0, "a pull on the left hand back to its mean place"),
        (Band(), "hand_l", -30.0, "a pull on the left hand away from its mean place"),
    ],
)
def test_signs_in_words(pattern, target, size, said, scene):
    assert said in pattern.sentence(scene, target, np.array([size]))


def test_what_holds_the_person_back_shows_in_the_plates(scene):
    """An elastic that pulls the pelvis back is balanced by the ground, and so is a drag."""
    pelvis = scene.q[:, :3]
    apart = pelvis[:, 0] - pelvis[:, 0].mean()
    pulled = Spring().change(scene, "x by x", np.array([50.0]))
    np.testing.assert_allclose(pulled[:, 0], 50.0 * apart)
    np.testing.assert_allclose(pulled[:, 3:], np.cross(pelvis, pulled[:, :3]))
    dragged = Drag().change(scene, "x", np.array([50.0]))
    speed = np.gradient(pelvis[:, 0]) * scene.rate_hz
    np.testing.assert_allclose(dragged[:, 0], 50.0 * speed)
    hand = scene.point("hand_l", scene.centre_of("hand_l")).position_m
    held = Band().change(scene, "hand_l", np.array([50.0]))
    np.testing.assert_allclose(held[:, :3], 50.0 * (hand - hand.mean(axis=0)))
