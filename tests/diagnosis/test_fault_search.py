"""Faults hidden in noisy forces: what is named, with what size, and what is not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bsip_cli.diagnosis.detection import limits_of
from bsip_cli.diagnosis.fault_scores import library_of
from bsip_cli.diagnosis.fault_search import Found, search
from bsip_cli.diagnosis.findings import Finding, findings_of
from bsip_cli.diagnosis.held_out import held_out
from bsip_cli.diagnosis.patterns import PATTERNS
from bsip_cli.effects.catalogue import CATALOGUE, EFFECTS
from bsip_cli.effects.scene import Scene
from tests.diagnosis.noisy_trial import (
    late,
    noisy,
    part_of_moving,
    session,
    shown,
    with_effect,
)

NAMED_FROM, ODDS = 0.95, 0.1
OF_THE_LAB = ("sync_offset", "plate_gain", "plate_zero", "gravity_tilt")
ASKED = (*(EFFECTS[name] for name in OF_THE_LAB), *PATTERNS)
SEEDS = (1, 2, 3)


def movement(seed: int, first_s: float = 0.0) -> Scene:
    return noisy(part_of_moving(first_s, 8.0), seed)


def found_in(*scenes: Scene, asked: Sequence = ASKED) -> Found:
    trials = session(*scenes)
    library = library_of(trials, asked, range(len(scenes)), ODDS)
    return search(trials, library, NAMED_FROM)


def told(found: Found) -> list[Finding]:
    """What is not rejected."""
    findings = findings_of(found, held_out(found.fit), NAMED_FROM, np.random.default_rng(0))
    return [one for one in findings if one.verdict != "rejected"]


@pytest.mark.parametrize("seed", SEEDS)
def test_nothing_is_named_where_nothing_is_wrong(seed):
    assert told(found_in(movement(seed), movement(seed + 10, 8.0))) == []


@pytest.mark.parametrize("seed", SEEDS)
def test_a_delay_of_all_trials_is_named_once_with_its_size(seed):
    scenes = [late(movement(seed), 0.012), late(movement(seed + 10, 8.0), 0.012)]
    (one,) = told(found_in(*scenes))
    assert (one.effect, one.trials, one.verdict) == ("sync_offset", ("a", "b"), "named")
    (delay,) = one.numbers
    assert delay.low < 0.012 < delay.high and delay.high - delay.low < 0.006
    assert one.probability > NAMED_FROM and one.p_value == 1 - one.probability
    assert one.scope == "laboratory" and one.rms_change > 1.0
    assert one.gain[0] > 0


@cache
def two_faults() -> Found:
    first = with_effect(movement(1), EFFECTS["plate_zero"], "1 fx", 12.0)
    return found_in(first, late(movement(11, 8.0), 0.02))


def test_two_faults_of_two_trials_are_both_named():
    names = {(one.effect, one.target, one.trials) for one in told(two_faults())}
    assert names == {("plate_zero", "1 fx", ("a",)), ("sync_offset", "", ("b",))}


def test_a_fault_gains_on_seconds_that_did_not_size_it():
    held = held_out(two_faults().fit)
    for number in range(2):
        assert held.gain(number).percent > 2 * held.gain(number).error_percent > 0
        spread = held.values(number).std(axis=0)
        size = np.abs(two_faults().fit.faults[number].values)
        assert 0 < spread.max() < 0.2 * size.max()


def gained(scene: Scene) -> Scene:
    """Plate 1 reads its vertical force 6 % too large."""
    first, second = scene.plates
    wrench = first.wrench.copy()
    wrench[:, 2] *= 1.06
    return replace(scene, plates=(replace(first, wrench=wrench), second))


def test_what_looks_alike_is_a_group_that_holds_the_truth():
    """Beside a body of unknown mass, gain of one plate, of both, an offset and a tilt compete."""
    findings = told(found_in(gained(movement(4)), asked=CATALOGUE))
    assert "plate_gain" in {one.effect for one in findings}
    for class_id in {one.class_id for one in findings} - {""}:
        mine = [one for one in findings if one.class_id == class_id]
        assert len(mine) > 1 and {one.verdict for one in mine} == {"ambiguous"}
        assert sum(one.probability for one in mine) >= NAMED_FROM
        assert all("to tell them apart" in one.sentence for one in mine)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_fault_of_some_seconds_is_not_what_is_so_throughout(seed):
    """Late by 30 ms from the middle on: no delay, and no clock that drifts."""
    scene = movement(seed)
    plates = tuple(
        replace(one, wrench=np.where(scene.times_s[:, None] > 4.0, late_one.wrench, one.wrench))
        for one, late_one in zip(scene.plates, late(scene, 0.03).plates, strict=True)
    )
    asked = [EFFECTS[name] for name in ("clock_drift", *OF_THE_LAB)]
    half_late = replace(scene, plates=plates)
    findings = told(found_in(half_late, movement(seed + 10, 8.0), asked=asked))
    assert findings and {one.effect for one in findings} == {"unexplained"}
    assert "not evenly" in findings[0].sentence


@pytest.mark.parametrize("seed", SEEDS)
def test_a_residual_of_another_kind_is_no_gain(seed):
    """Forces that are a tenth larger in a part that the motion does not hold: the plates' own
    reading explains them, what is simulated does not."""
    scene = movement(seed)
    slow = np.random.default_rng(seed).normal(size=(len(scene.times_s) // 25 + 2, 2))
    course = np.repeat(slow, 25, axis=0)[: len(scene.times_s)]
    smooth = np.apply_along_axis(lambda x: np.convolve(x, np.hanning(60) / 30, "same"), 0, course)
    more = np.zeros((len(course), 6))
    more[:, :2] = 0.3 * smooth * scene.measured[:, :2].std(axis=0)
    findings = told(found_in(shown(scene, more), movement(seed + 10, 8.0)))
    assert "plate_gain" not in {one.effect for one in findings}


def least_delay(times: float) -> float:
    trials = session(
        noisy(part_of_moving(0.0, 8.0), 5, times), noisy(part_of_moving(8.0, 8.0), 6, times)
    )
    library = library_of(trials, ASKED, (0, 1), ODDS)
    found = search(trials, library, NAMED_FROM)
    (limit,) = (
        one.size
        for one in limits_of(trials, library, found, NAMED_FROM)
        if one.place.candidate.effect.name == "sync_offset" and len(one.place.trials) == 2
    )
    return limit


def test_a_limit_is_what_is_just_named():
    limit = least_delay(1.0)
    assert 0.0005 < limit < 0.01
    assert least_delay(10.0) > 1.5 * limit
    scenes = movement(7), movement(17, 8.0)
    large = told(found_in(*(late(one, 2 * limit) for one in scenes)))
    assert [one.effect for one in large] == ["sync_offset"]
    assert told(found_in(*(late(one, limit / 4) for one in scenes))) == []
