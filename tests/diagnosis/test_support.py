"""What lies beside the plates: hands that hold on to something, and a stated mass that is wrong."""

from __future__ import annotations

import json
from dataclasses import asdict, replace

import numpy as np
import pytest

from bsip_cli.diagnosis.findings import Finding
from bsip_cli.diagnosis.support import (
    CLASS,
    Support,
    agreed_share,
    held_by,
    loaded_plate,
    stated_mass_findings,
    support_of,
    weight_share,
)
from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.effects.scene import Scene
from tests.diagnosis.noisy_trial import noisy, part_of_moving, with_effect
from tests.effects.moving_scene import MASS_KG, moving, standing_still

WEIGHT_N = 650.0
TIMES_S = np.arange(1000) / 100.0
FORCE_N = np.array([5.0, 20.0, 45.0])


def path(moves_m: float, seed: int) -> np.ndarray:
    """(n, 3) of something that sways by so much, root mean square."""
    rng = np.random.default_rng(seed)
    phases = 2 * np.pi * (0.4 * TIMES_S[:, None] + rng.uniform(size=3))
    return moves_m * np.sqrt(2 / 3) * np.sin(phases)


def missing(force_N: np.ndarray) -> np.ndarray:
    """(n, 3) a mean force with swings and noise."""
    rng = np.random.default_rng(5)
    swing = 8 * np.sin(2 * np.pi * 0.4 * TIMES_S)[:, None]
    return force_N + swing + rng.normal(0, 3, (len(TIMES_S), 3))


def held(left_m: float, right_m: float, trunk_m: float, force_N: np.ndarray) -> Support | None:
    hands = {"hand_l": path(left_m, 1), "hand_r": path(right_m, 2)}
    return held_by(hands, path(trunk_m, 3), missing(force_N), TIMES_S, WEIGHT_N)


def test_both_hands_on_a_rail_are_named_with_the_mean_force():
    found = held(0.001, 0.001, 0.016, FORCE_N)
    assert found is not None
    finding = found.finding("trial")
    assert (finding.effect, finding.target) == ("unmeasured_contact", "hand_l+hand_r")
    assert finding.verdict == "named" and finding.p_value < 1e-6
    assert finding.gain[0] > 50
    numbers = {number.name: number for number in finding.numbers}
    assert abs(numbers["force"].value - np.linalg.norm(FORCE_N)) < 2
    for axis, true in zip("xyz", FORCE_N, strict=True):
        number = numbers[f"force_{axis}"]
        assert number.low < true < number.high
    assert "within 1 mm while the trunk moves by 16 mm" in finding.sentence


def test_one_hand_on_a_rail():
    found = held(0.10, 0.001, 0.016, FORCE_N)
    assert found is not None and found.hands == ("hand_r",)


@pytest.mark.parametrize(
    ("hands_m", "trunk_m", "force_N"),
    [(0.001, 0.016, 0 * FORCE_N), (0.02, 0.02, FORCE_N), (0.004, 0.005, FORCE_N)],
    ids=["still hands alone", "a missing force alone", "who stands still altogether"],
)
def test_what_is_no_hand_that_holds_on(hands_m, trunk_m, force_N):
    assert held(hands_m, hands_m, trunk_m, force_N) is None


def test_who_moves_freely_does_not_hold_on_whatever_the_plates_say():
    scene = moving()
    heavier = replace(scene, wrench=1.1 * scene.predicted)
    assert support_of(scene) is None
    assert support_of(heavier) is None


def test_too_few_measured_seconds_tell_nothing():
    scene = moving()
    for count in (0, 1, 150):
        assert support_of(replace(scene, valid=np.arange(len(scene.valid)) < count)) is None


def test_what_was_found_survives_being_written():
    found = held(0.001, 0.10, 0.016, FORCE_N)
    assert found is not None
    again = Support(**json.loads(json.dumps(asdict(found))))
    assert again.finding("trial") == found.finding("trial") and again.words() == found.words()


# --- the stated mass ---

MASS_SD = 0.008


def told(share: float, mass_sd: float = MASS_SD) -> tuple[Finding, ...]:
    """Of plates that read so much more than the stated mass weighs."""
    scene = standing_still()
    scene = replace(scene, wrench=(1 + share) * scene.predicted)
    said = (None, ("standing",), "in quiet stance")
    return stated_mass_findings(weight_share(scene), scene.mass_kg, mass_sd, *said)


@pytest.mark.parametrize("share", [0.06, -0.04])
def test_plates_that_read_otherwise_make_a_class(share):
    found = told(share)
    sizes = {one.effect: one.numbers[0].value for one in found}
    assert abs(sizes["plate_gain"] - share) < 1e-9
    assert abs(sizes["plate_zero"] - share * MASS_KG * 9.81) < 0.05
    if share > 0:
        assert abs(sizes["added_mass"] - share * MASS_KG) < 1e-6
    else:
        assert "added_mass" not in sizes  # nobody wears a negative mass
    assert all((one.verdict, one.class_id) == ("ambiguous", CLASS) for one in found)
    assert all(one.p_value < 1e-5 and np.isnan(one.gain[0]) for one in found)
    assert all("the stated mass is wrong" in one.sentence for one in found)


def test_plates_that_agree_say_nothing():
    assert told(0.01) == ()


def test_only_one_plate_carries_the_person_or_none_does_alone():
    scene = standing_still()
    assert loaded_plate([scene]) is None
    first, second = scene.plates
    alone = replace(second, wrench=0 * second.wrench)
    on_one = replace(scene, plates=(first, alone))
    assert loaded_plate([on_one, on_one]) == "1"
    assert loaded_plate([on_one, scene]) is None


def on_one_plate(gain: float, first_s: float) -> Scene:
    """A moving trial on the first of two plates, whose vertical channel is off."""
    scene = part_of_moving(first_s, 4.0)
    first, second = scene.plates
    plates = (
        replace(first, wrench=scene.predicted),
        replace(second, wrench=0 * scene.predicted),
    )
    alone = replace(scene, plates=plates)
    return noisy(with_effect(alone, EFFECTS["plate_gain"], "1 fz", gain), round(first_s))


def test_moving_trials_that_agree_tell_what_the_plates_read():
    scenes = [on_one_plate(0.05, 0), on_one_plate(0.05, 4)]
    assert agreed_share(scenes, MASS_SD) == pytest.approx(0.05 / 1.05, abs=0.003)


@pytest.mark.parametrize("gains", [(0.05, -0.05), (0.01, 0.01)])
def test_moving_trials_that_disagree_or_are_near_say_nothing(gains):
    assert agreed_share([on_one_plate(gains[0], 0), on_one_plate(gains[1], 4)], MASS_SD) is None


def test_a_scale_that_errs_more_says_less():
    assert told(0.03, 2 * MASS_SD) == ()
    assert told(0.03)[0].numbers[0].high < (0.03 + 2 * MASS_SD) * MASS_KG
    scenes = [on_one_plate(0.03, 0), on_one_plate(0.03, 4)]
    assert agreed_share(scenes, MASS_SD) == pytest.approx(0.03 / 1.03, abs=0.003)
    assert agreed_share(scenes, 2 * MASS_SD) is None
