"""Errors without a name: effects like any other, wherever the lab has its origin."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bsip_cli.effects.nameless import NAMELESS, Course, Mean, in_channel, signal_of
from bsip_cli.effects.plates import CHANNELS
from bsip_cli.effects.scene import Scene, place_of_stance_m
from tests.diagnosis.noisy_trial import part_of_moving
from tests.effects.moving_scene import some, values_of

EVERY = [pytest.param(one, id=type(one).__name__) for one in NAMELESS]
AWAY_M = np.array([3.0, -2.0, 0.0])


@pytest.fixture(scope="module")
def scene() -> Scene:
    whole = part_of_moving(0, 6)
    limited = tuple(replace(p, wrench=0.98 * p.wrench) for p in whole.plates)
    return replace(whole, plates=limited)


@pytest.mark.parametrize("pattern", EVERY)
def test_a_size_is_seen_and_a_step_below_the_least_is_still_finite(pattern, scene):
    """As derivatives by scanned values ask, which step by a tenth of the typical size."""
    for target in some(pattern, scene):
        change = pattern.change(scene, target, values_of(pattern, scene, target, 1.0))
        assert np.abs(change).max() > 0.1
    target = pattern.targets(scene)[0]
    parameters = pattern.parameters(scene, target)
    values = values_of(pattern, scene, target, 1.0)
    for k, p in enumerate(parameters):
        below = values.copy()
        below[k] = p.least - 0.1 * p.typical
        assert np.isfinite(pattern.change(scene, target, below)).all()


@pytest.mark.parametrize(
    "target", ["fx by load", "mx by rate", "mz by moment_y", "all by pelvis_x"]
)
def test_where_the_lab_has_its_origin_says_nothing(target, scene):
    """The same person elsewhere: the same signal about the place where they stand."""
    q = scene.q.copy()
    q[:, :3] += AWAY_M
    elsewhere = replace(scene, q=q)
    values = values_of(Course(), scene, target, 1.0)
    for channel in Course.channels(target):
        here, there = (
            signal_of(one, Course().change(one, target, values), channel)
            for one in (scene, elsewhere)
        )
        assert np.abs(here).max() > 0
        np.testing.assert_allclose(there, here, atol=1e-6 * np.abs(here).max())


def test_a_moment_is_about_where_the_valid_frames_stand(scene):
    part = replace(scene, valid=scene.times_s > 3)
    place = place_of_stance_m(part)
    np.testing.assert_allclose(place, [*part.q[part.valid, :2].mean(axis=0), 0])
    pushed = Course().change(part, "fz by load", np.array([10.0, 0, 0, 0]))
    np.testing.assert_allclose(signal_of(part, pushed, "mx"), 0, atol=1e-9)


def _saturated(scene: Scene) -> np.ndarray:
    load = scene.predicted[:, 2]
    return -0.05 * load * (load / 1000) ** 2


def _late(scene: Scene) -> np.ndarray:
    return -0.02 * np.gradient(scene.predicted[:, 2]) * scene.rate_hz


def _braked(scene: Scene) -> np.ndarray:
    speed = np.gradient(scene.q[:, 2]) * scene.rate_hz
    return -50 * np.abs(speed) * speed


def _drifting(scene: Scene) -> np.ndarray:
    return 8 * np.sin(np.pi * scene.times_s / scene.times_s[-1]) ** 2


@pytest.mark.parametrize(
    ("error", "along", "least"),
    [
        (_saturated, "load", 0.99),
        (_late, "rate", 0.95),
        (_braked, "speed_z", 0.95),
        (_drifting, "time", 0.99),
    ],
)
def test_a_course_follows_what_nobody_has_described(error, along, least, scene):
    """Its columns explain an error of another form, beyond its mean; those of another quantity,
    less."""
    true = in_channel(scene, "fz", error(scene))[:, 2]
    true = true - true[scene.valid].mean()
    left = {}
    for quantity in ("load", "rate", "speed_z", "time"):
        target = f"fz by {quantity}"
        columns = Course().tangent(scene, target, np.zeros(4))[:, 2]
        found = columns @ np.linalg.lstsq(columns, true, rcond=None)[0]
        left[quantity] = float(((true - found) ** 2).sum() / (true**2).sum())
    assert left[along] < 1 - least
    assert min(left, key=left.__getitem__) == along


def test_a_zero_is_no_regularity(scene):
    for target in ("fz by load", "mx by time", "all by bend"):
        columns = Course().tangent(scene, target, np.zeros(1))[scene.valid]
        about = np.stack(
            [
                [signal_of(scene, whole, c).mean() for c in CHANNELS]
                for whole in np.moveaxis(columns, 2, 0)
            ]
        )
        np.testing.assert_allclose(about, 0, atol=1e-9)


def test_what_an_error_goes_along_with_is_said(scene):
    one = Course().words(scene, "fz by load", np.array([10.0, 0, 0, 0])).what
    assert one.endswith("N (RMS) that goes along with the load")
    (name, unit, size), _ = Course().reported(scene, "all by time", np.ones(24))
    assert (name, unit) == ("force", "N") and size > 1


def test_a_mean_is_constant_about_where_the_person_stands(scene):
    mean = Mean({"fx": 5.0, "my": 2.0})
    change = mean.change(scene, Mean.target_of("all by load"), np.array([3.0, -4.0]))
    for channel, size in {"fx": 3.0, "fz": 0.0, "my": -4.0, "mz": 0.0}.items():
        np.testing.assert_allclose(signal_of(scene, change, channel), size, atol=1e-9)


def test_a_mean_in_words(scene):
    one = Mean({"mz": 2.0})
    said = one.words(scene, "mz by mean", np.array([-3.0])).what
    assert said.startswith("of unknown cause: a constant error of") and "-3.0 N m" in said
