"""One component that is louder than all others let expect."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from bsip_cli.diagnosis.findings import Finding, Number
from bsip_cli.diagnosis.loud_noise import loudest, usual_noise, with_loud_noise
from bsip_cli.diagnosis.selection import select
from bsip_cli.diagnosis.signatures import signatures_of
from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.effects.scene import Scene
from tests.diagnosis.noisy_trial import all_of, noisy, part_of_moving, shown

WANDER_N = 30.0
NOTHING = np.zeros((600, 6))  # at the rate of the evidence


def wandering(component: int) -> Scene:
    """Twelve seconds in which one component errs by WANDER_N within half a second, at random."""
    scene = noisy(part_of_moving(0, 12), 4)
    course = gaussian_filter1d(np.random.default_rng(6).standard_normal(1200), 50.0)
    change = np.zeros((1200, 6))
    change[:, component] = WANDER_N * course / course.std()
    return shown(scene, change)


def loud(scene: Scene):
    return loudest(all_of(scene).trials[0], NOTHING)


def test_clean_plates_are_not_loud():
    assert loud(noisy(part_of_moving(0, 12), 4)) is None


@pytest.mark.parametrize("component", [0, 2])
def test_a_component_that_wanders_is_loud(component):
    found = loud(wandering(component))
    assert found.channel == ("fx", "fy", "fz")[component]
    assert found.noise == pytest.approx(WANDER_N, rel=0.35)
    assert found.louder > 12


def test_nothing_is_asked_where_somebody_lands():
    scene = wandering(2)
    landing = np.zeros((1200, 6))
    landing[600:604, 2] = 1.5 * scene.mass_kg * 9.81
    assert loud(shown(scene, landing)) is None


def test_what_is_known_is_not_loud():
    scene = wandering(2)
    known = NOTHING.copy()
    known[:, 2] = (scene.measured - part_of_moving(0, 12).predicted)[::2, 2]
    assert loudest(all_of(scene).trials[0], known) is None


def test_noise_of_markers_shakes_all_components():
    scene = part_of_moving(0, 12)
    usual = usual_noise(scene, np.zeros(3))
    assert usual.shape == (6,) and (usual > 0).all()
    below = usual_noise(scene, scene.q[0, :3])
    assert below[3] < usual[3]  # moments about the pelvis feel forces less


def test_a_trial_without_a_name_for_it_is_unexplained():
    effects = [EFFECTS[name] for name in ("sync_offset", "plate_gain")]
    signatures = signatures_of(all_of(noisy(part_of_moving(0, 12), 3), wandering(2)), effects)
    (one,) = with_loud_noise(select(signatures, np.random.default_rng(0)), ())
    assert (one.effect, one.target, one.trials) == ("unexplained", "fz", ("b",))
    assert one.verdict == "named" and "standard deviation" in one.sentence
    (number,) = one.numbers
    assert number.low < number.value < number.high and number.unit == "N"
    assert one.p_value < 0.01


@pytest.mark.parametrize(("gain", "verdict"), [(5.0, "rejected"), (20.0, "named")])
def test_a_slight_cause_is_no_name_for_what_is_loud(gain, verdict):
    effects = [EFFECTS["sync_offset"]]
    signatures = signatures_of(all_of(noisy(part_of_moving(0, 12), 3), wandering(2)), effects)
    numbers = (Number("delay", "s", 0.01, 0.009, 0.011),)
    slight = Finding(
        "sync_offset", "", ("b",), "named", "", 1e-9, (gain, 1.0, 30.0), numbers, "it is late"
    )
    elsewhere = replace(slight, trials=("a", "b"))
    selection = select(signatures, np.random.default_rng(0))
    first, both, *loud = with_loud_noise(selection, (slight, elsewhere))
    assert (first.verdict, both.verdict) == (verdict, "named")
    assert len(loud) == (verdict == "rejected")
    assert verdict == "named" or first.sentence == (
        "not so: it is late (a component of the force errs by far more)"
    )


@pytest.mark.parametrize(("target", "verdict"), [("all fz", "rejected"), ("all fx", "named")])
def test_what_wanders_in_one_trial_is_no_constant_gain_in_another(target, verdict):
    effects = [EFFECTS["sync_offset"]]
    signatures = signatures_of(all_of(noisy(part_of_moving(0, 12), 3), wandering(2)), effects)
    numbers = (Number("gain", "1", 0.03, 0.02, 0.04),)
    gain = Finding(
        "plate_gain", target, ("a",), "named", "", 1e-9, (30.0, 1.0, 60.0), numbers, "too large"
    )
    told, loud = with_loud_noise(select(signatures, np.random.default_rng(0)), (gain,))
    assert told.verdict == verdict and (loud.target, loud.trials) == ("fz", ("b",))
    said = "not so: too large (in b the vertical force errs by far more)"
    assert verdict == "named" or told.sentence == said


def test_a_regularity_of_the_same_component_elsewhere_stands():
    """Its target is a component of the lab's, and no plate's channel."""
    effects = [EFFECTS["sync_offset"]]
    signatures = signatures_of(all_of(noisy(part_of_moving(0, 12), 3), wandering(2)), effects)
    swing = Finding("unexplained", "fz", ("a",), "named", "", 1e-9, (30.0, 1.0, 60.0), (), "swings")
    told, loud = with_loud_noise(select(signatures, np.random.default_rng(0)), (swing,))
    assert told == swing and loud.trials == ("b",)


def test_what_looks_like_it_is_no_better_name():
    effects = [EFFECTS["sync_offset"]]
    signatures = signatures_of(all_of(noisy(part_of_moving(0, 12), 3), wandering(2)), effects)
    numbers = (Number("gain", "1", 0.03, 0.02, 0.04),)
    gain = Finding(
        "plate_gain", "1 fz", ("a",), "ambiguous", "A", 1e-9, (30.0, 1.0, 60.0), numbers, "large"
    )
    mass = replace(gain, effect="added_mass", target="head")
    other = replace(mass, class_id="B")
    selection = select(signatures, np.random.default_rng(0))
    verdicts = [one.verdict for one in with_loud_noise(selection, (gain, mass, other))[:3]]
    assert verdicts == ["rejected", "rejected", "ambiguous"]
