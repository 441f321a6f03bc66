"""Hands that hold on to something: both signs are needed, and the force is what the plates miss."""

from __future__ import annotations

import json
from dataclasses import asdict, replace

import numpy as np

from bsip_cli.diagnosis.support import Support, held_by, support_of
from tests.effects.moving_scene import moving

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


def test_still_hands_alone_are_no_contact():
    assert held(0.001, 0.001, 0.016, np.zeros(3)) is None


def test_a_missing_force_alone_is_no_hand():
    assert held(0.02, 0.02, 0.02, FORCE_N) is None


def test_who_stands_still_altogether_does_not_hold_on():
    assert held(0.004, 0.004, 0.005, FORCE_N) is None


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
