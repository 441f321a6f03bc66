"""A vertical gain and the body's mass are told apart by the stated mass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bsip_cli.diagnosis.detection import limits_of
from bsip_cli.diagnosis.explanation import Explanation, explanation_of, fit_of, fit_together
from bsip_cli.diagnosis.fair_sizes import fairly_sized, goes_with_mass
from bsip_cli.diagnosis.intervals import drawn_explanations
from bsip_cli.diagnosis.selection import select
from bsip_cli.diagnosis.signatures import signatures_of
from bsip_cli.diagnosis.together import Evidence, together
from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.effects.scene import Plate, Scene
from tests.diagnosis.noisy_trial import SEGMENTS, all_of, noisy, part_of_moving, shown, with_effect
from tests.effects.moving_scene import CORNERS

GAIN = EFFECTS["plate_gain"]
HIDDEN, LACKING = 0.03, 0.25
TRUSTED = 0.008  # standard deviation of the stated mass, part of it


def two_trials(on_one_plate: bool = True) -> Evidence:
    """Plate 1 reads too much; of the horizontal forces and moments the simulation shows too much,
    as skin that slides makes it."""
    parts = [part_of_moving(8 * k, 8, 1.2) for k in range(2)]
    if on_one_plate:
        parts = [replace(p, plates=(Plate("1", CORNERS, p.predicted),)) for p in parts]
    scenes = (with_effect(less_sideways(p), GAIN, "1 fz", HIDDEN) for p in parts)
    return all_of(*(noisy(scene, 3 + k) for k, scene in enumerate(scenes)))


def less_sideways(scene: Scene) -> Scene:
    change = -LACKING * scene.predicted
    change[:, 2] = 0.0
    return shown(scene, change)


def weighed(evidence: Evidence) -> Evidence:
    """Of a person whose mass is stated."""
    heavier = np.ones(len(SEGMENTS)) / np.sqrt(len(SEGMENTS))
    known = {"heavier": heavier, "mass_sd": TRUSTED}
    trials = (replace(t, filtered=replace(t.filtered, **known)) for t in evidence.trials)
    return together(tuple(trials))


def gain_of(evidence: Evidence, *trials: int, target: str = "1 fz") -> Explanation:
    scene = evidence.trials[0].scene
    return explanation_of(GAIN, target, np.array([0.01]), scene, trials)


def test_it_is_sized_beside_the_stated_mass():
    evidence = weighed(two_trials())
    fit = fit_together(evidence, (gain_of(evidence, 0, 1),))
    naive = fit.explanations[0].values[0]
    fair = fairly_sized(evidence, fit).explanations[0].values[0]
    assert abs(fair - HIDDEN) < 0.5 * abs(naive - HIDDEN)


def test_it_is_put_to_the_plate_that_leaves_least():
    evidence = weighed(two_trials(on_one_plate=False))
    other = fit_together(evidence, (gain_of(evidence, 0, 1, target="2 fz"),))
    (found,) = fairly_sized(evidence, other).explanations
    assert found.target == "1 fz"
    assert found.values[0] == pytest.approx(HIDDEN, abs=0.01)


def test_it_is_known_no_better_than_the_stated_mass():
    evidence = weighed(two_trials())
    fit = fairly_sized(evidence, fit_together(evidence, (gain_of(evidence, 0, 1),)))
    draws = drawn_explanations(evidence, fit, 0, np.random.default_rng(0))
    assert np.std([one.values[0] for one in draws]) > 0.9 * TRUSTED


@pytest.mark.parametrize("in_all", [True, False])
def test_without_a_stated_mass_or_in_one_trial_it_stays_as_it_is(in_all):
    evidence = two_trials() if in_all else weighed(two_trials())
    one = gain_of(evidence, *((0, 1) if in_all else (0,)))
    fit = fit_of(evidence, (one,))
    assert not goes_with_mass(evidence, one.place)
    assert fairly_sized(evidence, fit) is fit


def test_two_gains_stay_those_of_two_plates():
    evidence = weighed(two_trials(on_one_plate=False))
    both = tuple(gain_of(evidence, 0, 1, target=target) for target in ("1 fz", "2 fz"))
    found = fairly_sized(evidence, fit_together(evidence, both)).explanations
    assert len({one.target for one in found}) == 2


def test_what_a_scale_cannot_tell_might_go_unseen():
    limits = {}
    for name, evidence in (("stated", weighed(two_trials())), ("unstated", two_trials())):
        selection = select(signatures_of(evidence, [GAIN]), np.random.default_rng(0))
        limits[name] = {one.place.trials: one.size for one in limits_of(selection)}
    assert limits["stated"][0, 1] > 3 * TRUSTED > limits["unstated"][0, 1]
    assert limits["stated"][(0,)] < 3 * TRUSTED
