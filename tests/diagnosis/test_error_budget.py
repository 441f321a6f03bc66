"""The one model of the error: what is hidden is told, what is usual is not, and all adds up."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bsip_cli.diagnosis.error_budget import (
    COMPONENTS,
    Ground,
    Yardsticks,
    budget_of,
    ground_of,
    large_errors,
)
from bsip_cli.diagnosis.error_model import TrialErrors, error_model
from bsip_cli.diagnosis.filtering import filter_of, slow
from bsip_cli.effects.scene import Scene
from tests.diagnosis.noisy_trial import (
    CUTOFF_HZ,
    NOISE,
    errors_of,
    late,
    noisy,
    part_of_moving,
    shown,
)
from tests.effects.moving_scene import MASS_KG, standing_still

WEIGHT_N = MASS_KG * 9.81
YARDSTICKS = Yardsticks(0.03, 0.05, 0.5, WEIGHT_N)


def with_ground(scene: Scene, name: str = "a") -> tuple[TrialErrors, Ground]:
    errors, fewer = errors_of(scene, name), slow(scene)
    measured = errors.filter.one(fewer.measured)
    seconds = fewer.times_s[errors.filter.frames].astype(int)
    forwards = np.array([1.0, 0.0])
    return errors, ground_of(measured, errors.residual, forwards, 0.2 * WEIGHT_N, seconds)


def budget(*scenes: Scene) -> dict[tuple[str, str], tuple[float, float]]:
    """Share and gain by term and component, of all trials together."""
    trials, grounds = zip(
        *(with_ground(s, n) for s, n in zip(scenes, "abc", strict=False)), strict=True
    )
    model = error_model(trials, 1 if len(trials) > 1 else 5)
    lines = budget_of(model, grounds, range(len(trials)), np.random.default_rng(1))
    return {(x.term, x.component): (x.share, x.gain.percent) for x in lines if not x.target}


def large(scene: Scene) -> tuple:
    trial, ground = with_ground(scene)
    usual = error_model([trial], 1, adapt=False)
    return large_errors(usual, [ground], [0], YARDSTICKS, lambda trials, component: "nothing")


def movement(seed: int = 1, first_s: float = 0.0) -> Scene:
    return noisy(part_of_moving(first_s, 8.0), seed)


def with_heavier(scene: Scene, segment: str, part: float) -> Scene:
    """The plates carry a person one of whose segments weighs more."""
    at = 10 * scene.person.skeleton.index(segment)
    phi = scene.phi.copy()
    phi[at : at + 10] *= 1 + part
    return shown(scene, 0.4 * (scene.wrench_of(phi) - scene.predicted) / 0.4)


def turned(scene: Scene) -> Scene:
    """All plates turned by 180 degrees about the middle between them."""
    sign = np.array([-1.0, -1, 1, -1, -1, 1])
    return replace(
        scene, plates=tuple(replace(one, wrench=sign * one.wrench) for one in scene.plates)
    )


@pytest.fixture(scope="module")
def of_delay():
    return budget(late(movement(), 0.02))


def test_shares_add_up_to_the_whole(of_delay):
    for component in COMPONENTS:
        shares = [s for (term, c), (s, _) in of_delay.items() if c == component and term != "total"]
        assert sum(shares) == pytest.approx(1.0, abs=1e-6)


def test_a_delay_makes_the_error_and_helps_where_it_was_not_sized(of_delay):
    share, gain = of_delay["fault:sync_offset", "fz"]
    assert share > 0.7 and gain > 40
    others = (
        s
        for (t, c), (s, _) in of_delay.items()
        if c == "fz" and t not in ("total", "fault:sync_offset")
    )
    assert max(others) < 0.3


def test_a_heavier_segment_is_a_matter_of_the_parameters():
    found = budget(*(with_heavier(movement(k, 2.0 * k), "upper_torso", 0.15) for k in (1, 2)))
    for component in ("fz", "cop_ap"):
        share, gain = found["inertial_parameters", component]
        assert share > 0.7 and gain > 40


def test_the_segments_add_up_to_the_parameters_and_the_heavier_one_is_the_largest():
    trial, ground = with_ground(with_heavier(movement(), "upper_torso", 0.15))
    model = error_model([trial], 5)
    lines = budget_of(model, [ground], [0], np.random.default_rng(1))
    for component in COMPONENTS:
        mine = [x for x in lines if (x.term, x.component) == ("inertial_parameters", component)]
        (whole,) = (x.share for x in mine if not x.target)
        parts = {x.target: x.share for x in mine if x.target}
        assert sum(parts.values()) == pytest.approx(whole, abs=1e-6)
        if component == "cop_ap":
            assert max(parts, key=parts.__getitem__) == "upper_torso"


def test_noise_alone_is_no_large_error_and_leaves_nothing_unknown():
    assert large(movement()) == ()
    quiet = budget(movement())
    assert quiet["unknown", "fz"][0] < 0.3


def test_a_plate_that_is_turned_is_a_large_error_whatever_could_swallow_it():
    (found,) = large(turned(movement()))
    assert found.effect == "unexplained" and found.verdict == "named"
    assert found.sentence.startswith("large error, cause unknown")
    assert {"a"} == set(found.trials)


@pytest.mark.parametrize(("aside_m", "is_large"), [(0.065, True), (0.01, False)])
def test_ordinary_errors_do_not_stretch_over_a_large_one_that_is_the_same_all_the_time(
    aside_m, is_large
):
    """Of a plate aside under one who stands still, they would leave a third."""
    still = standing_still(6.0)
    moment = np.zeros((len(still.times_s), 6))
    moment[:, 3] = aside_m * still.predicted[:, 2]
    found = large(noisy(shown(still, moment), 3))
    assert [one.words.what[:11] for one in found] == ["large error"] * is_large


def test_terms_add_up_in_the_centre_of_pressure_without_approximation():
    scene = movement()
    low = filter_of(slow(scene), CUTOFF_HZ)
    measured = low.one(slow(scene).measured)
    residual = measured * 0.1 + NOISE
    ground = ground_of(measured, residual, np.array([1.0, 0.0]), 1.0, np.zeros(len(measured)))
    simulated = measured - residual
    cop = [np.stack([-w[:, 4], w[:, 3]], axis=1) / w[:, 2:3] for w in (measured, simulated)]
    apart = ground.seen(residual)[:, 6:] - (cop[0] - cop[1]) * np.array([1.0, -1.0])
    assert np.abs(apart).max() < 1e-12
