"""Faults hidden in noisy forces: what is named, with what size, and what is not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bsip_cli.diagnosis import fault_search
from bsip_cli.diagnosis.fault_model import Hypothesis, corrected, fitted
from bsip_cli.diagnosis.fault_scores import library_of, limits_of, smallest
from bsip_cli.diagnosis.fault_search import Found, search
from bsip_cli.diagnosis.findings import Finding, findings_of
from bsip_cli.diagnosis.held_out import held_out, unevenness
from bsip_cli.effects.catalogue import CATALOGUE, EFFECTS
from bsip_cli.effects.nameless import NAMELESS, UNEXPLAINED
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
ASKED = (*(EFFECTS[name] for name in OF_THE_LAB), *NAMELESS)
SEEDS = (1, 2)


def movement(seed: int, first_s: float = 0.0) -> Scene:
    return noisy(part_of_moving(first_s, 8.0), seed)


def found_in(*scenes: Scene, asked: Sequence = ASKED) -> Found:
    trials = session(*scenes)
    library = library_of(trials, asked, range(len(scenes)), ODDS)
    return search(library, NAMED_FROM)


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


def test_an_offset_of_all_trials_is_looked_for_where_ingest_has_not_taken_it_off():
    a, b = (
        with_effect(movement(seed, first_s), EFFECTS["plate_zero"], "1 fx", 12.0)
        for seed, first_s in ((1, 0.0), (11, 8.0))
    )
    c = movement(21, 4.0)
    c = replace(c, plates=tuple(replace(one, zeroed=True) for one in c.plates))
    assert {(x.effect, x.target, x.trials) for x in told(found_in(a, b, c))} == {
        ("plate_zero", "1 fx", ("a", "b"))
    }


def test_a_fault_gains_on_seconds_that_did_not_size_it():
    held = held_out(two_faults().fit)
    for number in range(2):
        assert held.gain(number).percent > 2 * held.gain(number).error_percent > 0
        spread = held.values(number).std(axis=0)
        size = np.abs(two_faults().fit.faults[number].values)
        assert 0 < spread.max() < 0.2 * size.max()


@pytest.mark.parametrize("size", [0.03, 0.06])
def test_the_plate_that_reads_too_much_is_named(size):
    wrong = with_effect(movement(4), EFFECTS["plate_gain"], "1 fz", size)
    (one,) = told(found_in(wrong, asked=CATALOGUE))
    assert (one.effect, one.target) == ("plate_gain", "1 fz")


def test_a_group_holds_95_per_cent_of_all_and_not_of_what_is_there(monkeypatch):
    """Where a fault is there with 96 %, so do its candidates together."""
    among: list[float] = []

    def smallest_of(shares, least):
        among.append(sum(shares.values()))
        return smallest(shares, least)

    monkeypatch.setattr(fault_search, "expit", lambda log_odds: 0.96)
    monkeypatch.setattr(fault_search, "smallest", smallest_of)
    found_in(late(movement(1), 0.012))
    assert among and among == pytest.approx([0.96] * len(among))


def test_what_looks_alike_is_a_group_that_holds_the_truth():
    """Four hundred grams on a forearm: so might six hundred be on the upper arm."""
    loaded = with_effect(movement(4), EFFECTS["added_mass"], "forearm_r", 0.4, 0.0, 0.0, 0.0)
    findings = told(found_in(loaded, movement(14, 8.0), asked=CATALOGUE))
    assert len(findings) > 1 and {one.class_id for one in findings} == {"A"}
    assert {one.verdict for one in findings} == {"ambiguous"}
    assert (findings[0].effect, findings[0].target) == ("added_mass", "forearm_r")
    assert sum(one.probability for one in findings) >= NAMED_FROM
    assert all("to distinguish them" in one.sentence for one in findings)


def half_late(seed: int) -> Scene:
    """Late by 30 ms from the middle on."""
    scene = movement(seed)
    plates = tuple(
        replace(one, wrench=np.where(scene.times_s[:, None] > 4.0, late_one.wrench, one.wrench))
        for one, late_one in zip(scene.plates, late(scene, 0.03).plates, strict=True)
    )
    return replace(scene, plates=plates)


def unevenness_of_a_delay(*scenes: Scene) -> float:
    """Of the delay that a search has found which asks for nothing else."""
    trials = session(*scenes)
    library = library_of(trials, [EFFECTS["sync_offset"]], range(len(scenes)), ODDS)
    found = search(library, NAMED_FROM)
    (number,) = (k for k, one in enumerate(found.fit.faults) if one.effect.name == "sync_offset")
    return unevenness(found.fit, number, np.ones(len(scenes)))


def test_a_delay_of_the_second_half_is_uneven_and_one_throughout_is_not():
    assert unevenness_of_a_delay(late(movement(2), 0.015)) < 0
    assert unevenness_of_a_delay(half_late(2)) > 10


@pytest.mark.parametrize("seed", SEEDS)
def test_plates_that_are_moved_in_the_middle_of_two_trials_are_uneven(seed):
    shift = EFFECTS["plate_translation"]
    trials = (movement(seed), movement(seed + 10, 8.0))

    def moved_from(moment_s: float) -> float:
        scenes = [
            shown(
                x,
                shift.change(x, "all", np.array([0.016, 0, 0])) * (x.times_s >= moment_s)[:, None],
            )
            for x in trials
        ]
        both = session(*scenes)
        one = Hypothesis(shift, "all", (0, 1), np.array([0.008, 0, 0]), both)
        return unevenness(corrected(fitted(both, [one])), 0, np.ones(2))

    assert moved_from(-1.0) < 0
    assert moved_from(4.9) > 5


@pytest.mark.parametrize("target, size_n", [("1 fz", 40.0), ("1 fx", 15.0)])
def test_a_zero_is_even_however_much_less_one_trial_counts(target, size_n):
    """What several trials share is weighed as the trials are; else 40 N of each was uneven."""
    zero, size = EFFECTS["plate_zero"], np.array([size_n])
    trials = (movement(1), movement(11, 8.0))
    both = session(*(shown(x, zero.change(x, target, size)) for x in trials))
    fit = corrected(fitted(both, [Hypothesis(zero, target, (0, 1), size, both)]))
    for inflation in ([1.0, 1.0], [1.0, 4.0], [4.0, 1.0]):
        assert unevenness(fit, 0, np.array(inflation)) < 0


def test_a_drift_of_all_trials_is_one_fault_with_its_size():
    drift, trials = EFFECTS["plate_drift"], (movement(1), movement(11, 8.0))
    scenes = [shown(x, drift.change(x, "1 fz", np.array([1.5]))) for x in trials]
    (one,) = told(found_in(*scenes, asked=(*ASKED, drift)))
    assert (one.effect, one.target, one.trials) == ("plate_drift", "1 fz", ("a", "b"))
    (rate,) = one.numbers
    assert one.verdict == "named" and rate.low < 1.5 < rate.high < 1.7


def test_files_that_say_where_plates_lie_and_others_are_searched_together():
    first, second = late(movement(1), 0.012), late(movement(11, 8.0), 0.012)
    unplaced = tuple(replace(one, is_placed=False) for one in second.plates)
    found = told(found_in(first, replace(second, plates=unplaced)))
    assert [(one.effect, one.trials) for one in found] == [("sync_offset", ("a", "b"))]


def test_what_is_uneven_and_moves_another_fault_is_neither(monkeypatch):
    """A drift takes a delay out of its interval, a plate's zero does not; both are said to be of
    another size in every second."""

    def unevenness_of(fit, number, inflation):
        return -10.0 if fit.faults[number].effect.name == "sync_offset" else 10.0

    monkeypatch.setattr(fault_search, "unevenness", unevenness_of)
    scene = movement(1)
    zero = with_effect(late(scene, 0.03), EFFECTS["plate_zero"], "1 fx", 6.0)
    asked = [EFFECTS[name] for name in ("sync_offset", "clock_drift", "plate_zero")]
    one, other = told(found_in(zero, asked=asked))
    assert {one.effect, other.effect} == {"sync_offset", UNEXPLAINED}
    drifting = replace(
        scene,
        plates=tuple(
            replace(a, wrench=a.wrench + (b.wrench - a.wrench) * scene.times_s[:, None] / 8.0)
            for a, b in zip(late(scene, 0.01).plates, late(scene, 0.03).plates, strict=True)
        ),
    )
    (delay,) = told(found_in(drifting, asked=asked))
    assert (delay.effect, delay.verdict) == ("sync_offset", "named")
    assert 0.017 < delay.numbers[0].value < 0.023


def pulled(scene: Scene, mean_N: float, varying_N: float) -> Scene:
    """By a force on the pelvis along x that hangs on its height."""
    height = scene.q[:, 2] - scene.q[scene.valid, 2].mean()
    force = np.zeros((len(height), 3))
    force[:, 0] = mean_N + varying_N * height / height[scene.valid].std()
    return shown(scene, np.hstack([force, np.cross(scene.q[:, :3], force)]))


@pytest.mark.parametrize("seed", SEEDS)
def test_what_an_error_without_a_name_is_on_average_has_no_name(seed):
    """Neither a tilt nor a plate's zero is sure beside a pull that hangs on where the pelvis is."""
    findings = told(found_in(pulled(movement(seed), 12.0, 12.0)))
    assert findings and {one.effect for one in findings if one.verdict == "named"} <= {UNEXPLAINED}


@pytest.mark.parametrize("seed", SEEDS)
def test_a_zero_far_larger_than_what_has_no_name_keeps_its_name(seed):
    scene = with_effect(pulled(movement(seed), 0.0, 2.0), EFFECTS["plate_zero"], "1 fx", 25.0)
    named = {(one.effect, one.target) for one in told(found_in(scene)) if one.verdict == "named"}
    assert ("plate_zero", "1 fx") in named


@pytest.mark.parametrize("seed", SEEDS)
def test_a_fault_of_some_seconds_is_not_what_is_so_throughout(seed):
    """No delay, and no clock that drifts."""
    asked = [EFFECTS[name] for name in ("clock_drift", *OF_THE_LAB)]
    findings = told(found_in(half_late(seed), movement(seed + 10, 8.0), asked=asked))
    assert findings and {one.effect for one in findings} == {"unexplained"}
    assert "not evenly" in findings[0].sentence


def test_what_was_asked_and_is_not_there_is_rejected_with_a_small_probability():
    found = found_in(movement(1), movement(11, 8.0))
    findings = findings_of(found, held_out(found.fit), NAMED_FROM, np.random.default_rng(0))
    assert {one.effect for one in findings} & set(OF_THE_LAB)
    assert all(one.verdict == "rejected" and one.probability < 0.5 for one in findings)


@pytest.mark.parametrize("seed", SEEDS)
def test_a_residual_of_another_kind_is_no_gain(seed):
    """Forces that are a tenth larger in a part that the motion does not hold: the plates' own
    reading explains them, what is simulated does not."""
    scene = movement(seed)
    slow = np.random.default_rng(seed).normal(size=(len(scene.times_s) // 25 + 2, 2))
    signal = np.repeat(slow, 25, axis=0)[: len(scene.times_s)]
    smooth = np.apply_along_axis(lambda x: np.convolve(x, np.hanning(60) / 30, "same"), 0, signal)
    more = np.zeros((len(signal), 6))
    more[:, :2] = 0.3 * smooth * scene.measured[:, :2].std(axis=0)
    findings = told(found_in(shown(scene, more), movement(seed + 10, 8.0)))
    assert "plate_gain" not in {one.effect for one in findings}


def least_delay(times: float) -> float:
    trials = session(
        noisy(part_of_moving(0.0, 8.0), 5, times), noisy(part_of_moving(8.0, 8.0), 6, times)
    )
    library = library_of(trials, ASKED, (0, 1), ODDS)
    found = search(library, NAMED_FROM)
    (limit,) = (
        one.size
        for one in limits_of(library, found.scores, NAMED_FROM)
        if one.kind.effect.name == "sync_offset" and len(one.kind.trials) == 2
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
