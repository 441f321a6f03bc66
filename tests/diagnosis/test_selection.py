"""From a recording to what is said of it: causes found, sized, and told from one another."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from bsip_cli.diagnosis import detection, intervals, judging, selection
from bsip_cli.diagnosis.channel_patterns import with_play
from bsip_cli.diagnosis.detection import Limit, limits_of
from bsip_cli.diagnosis.explanation import NEGLIGIBLE, fit_together
from bsip_cli.diagnosis.findings import Finding, findings_of
from bsip_cli.diagnosis.held_out import gain_of
from bsip_cli.diagnosis.intervals import has_size
from bsip_cli.diagnosis.judging import ALPHA
from bsip_cli.diagnosis.patterns import PATTERNS
from bsip_cli.diagnosis.rounds import Selection
from bsip_cli.diagnosis.selection import select
from bsip_cli.diagnosis.settling import settled
from bsip_cli.diagnosis.signatures import signatures_of
from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.effects.scene import Plate, Scene
from bsip_cli.stages.diagnosis_rows import rows_of
from tests.diagnosis.noisy_trial import all_of, late, noisy, part_of_moving, shown, with_effect
from tests.diagnosis.noisy_trial import null as null_of
from tests.effects.moving_scene import CORNERS

NAMES = (
    "sync_offset",
    "clock_drift",
    "plate_gain",
    "plate_zero",
    "plate_drift",
    "gravity_tilt",
    "added_mass",
    "released_object",
)
OFFSET_N, DELAY_S = 8.0, 0.010
MASS = ("added_mass", "mass")


def selection_of(*scenes: Scene) -> Selection:
    effects = [*(EFFECTS[name] for name in NAMES), *PATTERNS]
    return select(signatures_of(all_of(*scenes), effects), np.random.default_rng(0))


def said_of(selection: Selection) -> list[Finding]:
    """What is not rejected."""
    findings = findings_of(selection, np.random.default_rng(1))
    return [one for one in findings if one.verdict != "rejected"]


def number_of(finding: Finding, name: str):
    return next(one for one in finding.numbers if one.name == name)


@cache
def late_with_offset() -> Selection:
    scene = late(part_of_moving(0, 12), DELAY_S)
    return selection_of(noisy(with_effect(scene, EFFECTS["plate_zero"], "1 fx", OFFSET_N), 4))


@cache
def null(seconds: float = 12) -> Selection:
    return selection_of(noisy(part_of_moving(0, seconds), 2))


def test_in_white_noise_nothing_is_found():
    found = [said_of(selection_of(noisy(part_of_moving(0, 8), seed))) for seed in range(10, 16)]
    assert sum(bool(one) for one in found) <= 1


def test_a_delay_is_found_with_its_size():
    (one,) = said_of(selection_of(noisy(late(part_of_moving(0, 12), DELAY_S), 3)))
    assert (one.effect, one.trials, one.verdict, one.class_id) == (
        "sync_offset",
        ("a",),
        "named",
        "",
    )
    delay = number_of(one, "delay")
    assert delay.low < DELAY_S < delay.high
    assert 0 < delay.high - delay.low < 1.5e-3
    assert one.p_value < 0.01
    gain, low, high = one.gain
    assert 0 < low < gain < high
    assert "10.0 ms after the markers" in one.sentence and "95 % interval" in one.sentence


def test_a_second_cause_in_the_same_trial_is_found_too():
    found = {one.effect: one for one in said_of(late_with_offset())}
    assert set(found) == {"sync_offset", "plate_zero"}
    delay, offset = (
        number_of(found[name], part).value
        for name, part in (("sync_offset", "delay"), ("plate_zero", "offset"))
    )
    assert delay == pytest.approx(DELAY_S, abs=2e-4)
    assert found["plate_zero"].target == "1 fx"
    assert offset == pytest.approx(OFFSET_N, abs=0.5)


@cache
def pushed() -> Selection:
    push = np.array([0.0, 0.0, 300.0, 6.0, 4.0])
    effect = EFFECTS["unmeasured_contact"]
    scene = part_of_moving(0, 12)
    change = effect.change(scene, "hand_r", push)
    return select(signatures_of(all_of(noisy(shown(scene, change), 4)), [effect]), rng())


def rng() -> np.random.Generator:
    return np.random.default_rng(0)


def test_nothing_is_left_over_of_no_cause():
    """Whatever the largest residuals are cut to."""
    first = pushed().rounds[0]
    assert first.kept is not None and not any(one.is_leftover for one in first.tried)


def test_a_moment_is_no_size(monkeypatch):
    (one,) = said_of(pushed())
    assert one.effect == "unmeasured_contact"
    monkeypatch.setattr(intervals, "SCALE_ERROR", 2.0)
    (one,) = said_of(pushed.__wrapped__())
    assert one.effect == "unexplained" and "may as well have no size" in one.sentence


def test_what_may_as_well_have_no_size_has_no_name(monkeypatch):
    """It explains more than what is told without a name must."""
    monkeypatch.setattr(intervals, "SCALE_ERROR", 2.0)
    chosen = late_with_offset.__wrapped__()
    assert chosen.fit.explanations == ()
    assert [one.effect for one in said_of(chosen)] == ["unexplained"]
    rejected = findings_of(chosen, np.random.default_rng(1))[1:3]
    assert [one.effect for one in rejected] == ["sync_offset", "plate_zero"]
    assert all("its size may as well be none" in one.sentence for one in rejected)


def test_slight_things_without_a_size_are_not_told(monkeypatch):
    monkeypatch.setattr(intervals, "SCALE_ERROR", 2.0)
    monkeypatch.setattr(judging, "NAMELESS_WORTH", 1.0)
    assert said_of(late_with_offset.__wrapped__()) == []


def test_of_two_that_take_each_others_size_the_stronger_is_told_with_its_own():
    """Let go at 6 s, found at 6 s and at 5.95 s: together neither has a size for sure."""
    effect = EFFECTS["released_object"]
    scene = with_effect(part_of_moving(0, 12), effect, "hand_r", 1.2, 6.0)
    signatures = signatures_of(all_of(noisy(scene, 3)), [effect])
    alone = select(signatures, rng())
    (only,) = (one for one in alone.rounds if one.kept)
    other = replace(
        only.kept, explanation=null_of(effect, "hand_r", (5.95,)), score=0.5 * only.kept.score
    )
    rounds = (only, replace(only, kept=other, tried=(other,)))
    found = (*alone.fit.explanations, other.explanation)
    together = fit_together(alone.signatures.evidence, found)
    assert not any(
        has_size(alone.signatures.evidence, together, number, rng()) for number in range(2)
    )
    both = settled(alone.signatures, rounds, found, rng())
    (told,) = both.fit.explanations
    assert told.values == pytest.approx(alone.fit.explanations[0].values, rel=0.02)
    assert [one.kept is not None for one in both.rounds] == [True, False]


def test_what_a_large_cause_leaves_behind_is_no_other_cause():
    """No linear course of a delay of 30 ms is quite that of the delay."""
    scene = with_effect(late(part_of_moving(0, 12), 0.030), EFFECTS["plate_zero"], "1 fx", 2.0)
    selection = selection_of(noisy(scene, 4))
    (one,) = said_of(selection)
    assert one.effect == "sync_offset"
    rare = [t for r in selection.rounds for t in r.tried if t.p_value <= 0.05]
    left = [t for t in rare if t.is_leftover]
    assert left and not any(t.is_good for t in left)
    rejected = findings_of(selection, np.random.default_rng(1))
    assert any("what a larger cause leaves behind" in one.sentence for one in rejected)


def test_every_round_says_what_was_tried():
    rounds = late_with_offset().rounds
    assert [one.kept is not None for one in rounds] == [True, True, False]
    for one in rounds:
        scores = [tried.score for tried in one.tried]
        assert scores == sorted(scores, reverse=True)
    first, second = (one.kept for one in rounds[:2])
    assert len(first.fit.explanations) == 1 and len(second.fit.explanations) == 2
    assert late_with_offset().fit.residual.std() == pytest.approx(1.0, abs=0.15)


def test_what_lasts_is_one_cause_of_both_trials():
    first, second = part_of_moving(0, 8), part_of_moving(8, 8)
    (one,) = said_of(selection_of(noisy(late(first, 0.008), 5), noisy(late(second, 0.008), 6)))
    assert one.effect == "sync_offset" and one.trials == ("a", "b")
    assert number_of(one, "delay").value == pytest.approx(0.008, abs=2e-4)


def test_trials_whose_delays_differ_have_a_delay_each():
    first, second = part_of_moving(0, 8), part_of_moving(8, 8)
    found = said_of(selection_of(noisy(late(first, 0.006), 5), noisy(late(second, 0.014), 6)))
    sizes = {one.trials: number_of(one, "delay").value for one in found}
    assert {one.effect for one in found} == {"sync_offset"}
    assert sizes == {("a",): pytest.approx(0.006, abs=3e-4), ("b",): pytest.approx(0.014, abs=3e-4)}


def spoilt(channel: int, error: np.ndarray) -> Scene:
    """Twelve seconds of movement whose plates err by (N,) in one component."""
    change = np.zeros((len(error), 6))
    change[:, channel] = error
    return noisy(shown(part_of_moving(0, 12), change), 2)


def test_a_channel_with_play_has_no_name():
    course = part_of_moving(0, 12).predicted[:, 1]
    (one,) = said_of(selection_of(spoilt(1, with_play(course, 16.0) - course)))
    assert one.effect == "unexplained" and "as of play or friction" in one.sentence
    error = number_of(one, "error")
    assert error.low < 8.0 < error.high


def test_a_channel_that_comes_late_alone_has_no_name():
    course = part_of_moving(0, 12).predicted[:, 1]
    (one,) = said_of(
        selection_of(spoilt(1, np.interp(np.arange(1200) - 2, np.arange(1200), course) - course))
    )
    assert one.effect == "unexplained" and "which alone comes" in one.sentence
    assert number_of(one, "delay").value == pytest.approx(0.02, abs=0.003)


def test_a_gain_that_changes_has_no_name():
    course, part = part_of_moving(0, 12).predicted[:, 0], np.linspace(-0.5, 0.5, 1200)
    (one,) = said_of(selection_of(spoilt(0, 0.8 * part * course)))
    assert one.effect == "unexplained" and "through the trial" in one.sentence
    assert number_of(one, "change_of_gain").value == pytest.approx(0.8, abs=0.05)


def test_an_elastic_from_the_wall_has_no_name():
    """Most of its pull is always there, as of a tilt."""
    scene = part_of_moving(0, 12)
    pelvis = scene.q[:, :3]
    away = pelvis - (pelvis[0] + [-1.2, 0.1, 0.3])
    length = np.linalg.norm(away, axis=1, keepdims=True)
    push = 100.0 * (length - length[0] + 0.1) * away / length
    change = np.hstack([push, np.cross(pelvis, push)])
    (one,) = said_of(selection_of(noisy(shown(scene, change), 2)))
    assert one.effect == "unexplained" and "as of an elastic" in one.sentence
    assert number_of(one, "stiffness").value == pytest.approx(100.0, abs=20.0)


def jumped(scene: Scene, delay_s: float, after_s: float) -> Scene:
    """The forces come later from a moment on."""
    after = scene.times_s[:, None] >= after_s
    plates = tuple(
        replace(one, wrench=np.where(after, other.wrench, one.wrench))
        for one, other in zip(scene.plates, late(scene, delay_s).plates, strict=True)
    )
    return replace(scene, plates=plates)


def test_a_clock_that_jumps_in_every_trial_is_none_that_drifts():
    """A drift shared by all trials explains more than the jump in any one of them."""
    moments = {0: 4.3, 12: 7.7, 24: 6.0}
    scenes = [
        noisy(jumped(part_of_moving(first, 12), 0.06, moment), seed)
        for seed, (first, moment) in enumerate(moments.items())
    ]
    found = said_of(selection_of(*scenes))
    assert {one.effect for one in found} == {"unexplained"}
    sizes = {one.trials: number_of(one, "jump").value for one in found}
    assert sizes == {(name,): pytest.approx(0.06, abs=0.004) for name in "abc"}


def test_a_clock_that_jumps_has_no_name():
    (one,) = said_of(selection_of(noisy(jumped(part_of_moving(0, 12), 0.03, 7.0), 3)))
    assert one.effect == "unexplained" and "as if frames were lost" in one.sentence
    assert number_of(one, "jump").value == pytest.approx(0.03, abs=0.002)
    assert number_of(one, "from_time").value == pytest.approx(7.0, abs=0.3)


def on_plates_from(scene: Scene, start_s: float) -> Scene:
    """Before that the person is not yet on a plate."""
    return replace(scene, valid=scene.valid & (scene.times_s >= start_s))


def test_a_clock_that_has_jumped_before_anything_is_seen():
    """Alone it is a delay; where another trial shows the jump, nobody knows which of the two."""
    unseen = noisy(on_plates_from(jumped(part_of_moving(0, 12), 0.03, 3.0), 4.0), 3)
    (alone,) = said_of(selection_of(unseen))
    assert (alone.effect, alone.verdict) == ("sync_offset", "named")
    found = said_of(selection_of(noisy(jumped(part_of_moving(12, 12), 0.03, 7.0), 4), unseen))
    told = {(one.effect, one.trials, one.verdict) for one in found}
    unknown = {(effect, ("b",), "ambiguous") for effect in ("unexplained", "sync_offset")}
    assert told == {("unexplained", ("a",), "named"), *unknown}


def test_beside_what_may_have_a_name_more_is_told():
    """The second trial's delay may be a jump without a name, and its channel has an offset."""
    unseen = on_plates_from(jumped(part_of_moving(0, 12), 0.03, 3.0), 4.0)
    offset = noisy(with_effect(unseen, EFFECTS["plate_zero"], "1 fx", OFFSET_N), 3)
    found = said_of(selection_of(noisy(jumped(part_of_moving(12, 12), 0.03, 7.0), 4), offset))
    told = {one.effect for one in found if one.trials == ("b",)}
    assert {"unexplained", "sync_offset", "plate_zero"} <= told


def test_a_fault_of_one_trial_is_not_put_on_the_other():
    first, second = part_of_moving(0, 8), part_of_moving(8, 8)
    zero = EFFECTS["plate_zero"]
    spoilt = noisy(with_effect(second, zero, "2 fx", OFFSET_N), 8)
    (one,) = said_of(selection_of(noisy(first, 7), spoilt))
    assert (one.effect, one.target, one.trials) == ("plate_zero", "2 fx", ("b",))


def test_a_rival_of_two_causes_makes_a_class_with_each():
    """Neither is named for certain because the other's class has told the rival already."""
    zero = EFFECTS["plate_zero"]
    offset = with_effect(part_of_moving(0, 8), zero, "1 fx", OFFSET_N)
    chosen = selection_of(noisy(offset, 0), noisy(late(part_of_moving(8, 8), DELAY_S), 1))
    causes = {one.kept.explanation.effect for one in chosen.rounds if one.kept is not None}
    tried = (t for one in chosen.rounds for t in one.tried)
    rival = next(t for t in tried if t.explanation.effect not in causes)
    both = (
        one if one.kept is None else replace(one, kept=replace(one.kept, rivals=(rival,)))
        for one in chosen.rounds
    )
    found = said_of(replace(chosen, rounds=tuple(both)))
    assert len({one.class_id for one in found}) == 2 and len(found) == 4
    assert all(one.verdict == "ambiguous" for one in found)


def test_what_turns_out_to_be_no_cause_does_not_hide_another_trial(monkeypatch):
    """The delay, which makes far higher scores, is let pay off nowhere: the offset is found."""

    def gain_but_in_b(evidence, trials, *others):
        gain = gain_of(evidence, trials, *others)
        return replace(gain, blocks=-gain.blocks) if 1 in trials else gain

    monkeypatch.setattr(judging, "gain_of", gain_but_in_b)
    offset = with_effect(part_of_moving(0, 8), EFFECTS["plate_zero"], "1 fx", OFFSET_N)
    delay = late(part_of_moving(8, 8), DELAY_S)
    chosen = selection_of(noisy(offset, 0), noisy(delay, 1))
    first = chosen.rounds[0]
    assert first.tried[0].explanation.place.trials == (1,) and first.tried[0].p_value <= ALPHA
    assert first.kept.score < selection.WORTH_A_TRY * first.tried[0].score
    assert [(one.effect, one.trials) for one in said_of(chosen)] == [("plate_zero", ("a",))]


def test_what_goes_along_with_far_more_that_is_no_cause_is_not_named(monkeypatch):
    """The delay is let be no cause; less of it is explained by others, by which it is not named."""
    true = judging.Tried.is_good.fget

    def good_but_for_delays(tried):
        return tried.explanation.effect.name != "sync_offset" and true(tried)

    monkeypatch.setattr(judging.Tried, "is_good", property(good_but_for_delays))
    scene = noisy(late(part_of_moving(0, 12), 3 * DELAY_S), 3)
    assert said_of(selection_of(scene)) == []
    monkeypatch.setattr(selection, "OVERSHADOWS", np.inf)
    assert said_of(selection_of(scene)) != []


def swinging(hertz: float) -> Scene:
    scene = part_of_moving(0, 12)
    swing = 20.0 * np.sin(2 * np.pi * hertz * scene.times_s)[:, None] * np.eye(6)[2]
    return noisy(shown(scene, swing), 6)


@pytest.mark.parametrize("hertz", [3.0, 5.0])
def test_a_swing_that_no_effect_knows_has_no_name(hertz):
    (one,) = said_of(selection_of(swinging(hertz)))
    assert (one.effect, one.target) == ("unexplained", "fz")
    frequency = number_of(one, "frequency")
    assert frequency.value == pytest.approx(hertz, abs=0.01)
    assert number_of(one, "amplitude").value == pytest.approx(20.0, abs=2.0)
    assert "without a name" in one.sentence and f"{hertz:.2f} times per second" in one.sentence


def test_something_slight_without_a_name_is_not_told_and_hides_no_other_trial(monkeypatch):
    """The swing is let count as slight; what explains less of its trial is not named instead."""
    monkeypatch.setattr(judging, "NAMELESS_WORTH", 0.9)
    offset = noisy(with_effect(part_of_moving(12, 8), EFFECTS["plate_zero"], "2 fx", OFFSET_N), 8)
    chosen = selection_of(swinging(3.0), offset)
    assert [(one.effect, one.trials) for one in said_of(chosen)] == [("plate_zero", ("b",))]
    findings = findings_of(chosen, np.random.default_rng(1))
    swing = next(one for one in findings if (one.effect, one.target) == ("unexplained", "fz"))
    assert swing.verdict == "rejected" and "it has no name and explains less" in swing.sentence


def test_beside_something_slight_without_a_name_a_cause_of_the_same_trial_is_told(monkeypatch):
    """The swing explains more, and nothing of what the offset does."""
    monkeypatch.setattr(judging, "NAMELESS_WORTH", 0.9)
    scene = with_effect(swinging(3.0), EFFECTS["plate_zero"], "1 mx", 2.0)
    assert {(one.effect, one.target) for one in said_of(selection_of(scene))} == {
        ("plate_zero", "1 mx"),
        ("plate_zero", "2 mx"),
    }


def test_a_plate_that_is_right_in_standing_only_is_found():
    scene = part_of_moving(0, 12)
    load = scene.predicted[:, 2] / (scene.mass_kg * 9.80665)
    bent = shown(scene, (150.0 * load * (load - 1))[:, None] * np.eye(6)[2])
    (one,) = said_of(selection_of(noisy(bent, 5)))
    assert (one.effect, one.target) == ("unexplained", "fz")
    error = number_of(one, "nonlinearity")
    assert error.low < 150.0 * 1.2 * 0.2 < error.high
    assert "N at 1.2 times the body weight, none in standing" in one.sentence


def test_a_channel_at_its_limit_is_found():
    scene = part_of_moving(0, 12)
    limit = np.percentile(scene.predicted[:, 2], 80.0)
    over = np.maximum(scene.predicted[:, 2] - limit, 0.0)
    (one,) = said_of(selection_of(noisy(shown(scene, -over[:, None] * np.eye(6)[2]), 5)))
    assert (one.effect, one.target) == ("unexplained", "fz")
    assert number_of(one, "lacking").value == pytest.approx(over.max(), rel=0.15)
    assert "as of a channel at its limit" in one.sentence


def test_a_swing_between_the_regular_frequencies_is_found_in_a_long_trial():
    hertz, scene = 3.07, part_of_moving(0, 40)
    swing = 6.0 * np.sin(2 * np.pi * hertz * scene.times_s)[:, None] * np.eye(6)[2]
    places = signatures_of(all_of(noisy(shown(scene, swing), 6)), PATTERNS).places
    asked = [
        p.candidate.scanned[0] for p in places if p.candidate.target == "fz" and p.candidate.scanned
    ]
    assert min(abs(f - hertz) for f in asked) < 0.01
    clean = signatures_of(all_of(noisy(scene, 6)), PATTERNS).places
    regular = [
        p.candidate.scanned[0] for p in clean if p.candidate.target == "fz" and p.candidate.scanned
    ]
    assert min(abs(f - hertz) for f in regular) > 0.02 and len(regular) < len(asked)


def gained_in(*trials: int) -> list[Finding]:
    """Four trials on one plate, which reads 1.8 % too much in some of them."""
    parts = [on_one_plate(part_of_moving(8 * k, 8, 0.05)) for k in range(4)]
    for t in trials:
        parts[t] = with_effect(parts[t], EFFECTS["plate_gain"], "1 fz", 0.018)
    return said_of(selection_of(*(noisy(scene, 9 + k) for k, scene in enumerate(parts))))


def on_one_plate(scene: Scene) -> Scene:
    return replace(scene, plates=(Plate("1", CORNERS, scene.predicted),))


def test_what_half_of_the_trials_show_may_be_another_cause_in_each():
    found = gained_in(0, 2)
    assert {one.class_id for one in found} == {"A"}
    assert found[0].effect == "plate_gain" and found[0].trials == ("a", "c")
    masses = {one.trials for one in found if one.effect == "added_mass"}
    assert masses == {("a",), ("c",)}


def test_what_most_trials_show_is_of_the_lab():
    found = gained_in(0, 1, 2)
    assert found[0].effect == "plate_gain"
    assert {one.trials for one in found} == {("a", "b", "c")}


# --- causes that look alike, and the rows of the artifact ---------------------------------------


@cache
def alike() -> Selection:
    """The centres of the plates lie side by side: a force along y is the same on either."""
    scene = with_effect(part_of_moving(0, 12), EFFECTS["plate_zero"], "2 fy", OFFSET_N)
    return selection_of(noisy(scene, 9))


def test_causes_that_look_alike_share_a_class():
    found = said_of(alike())
    assert {(one.effect, one.target) for one in found} == {
        ("plate_zero", "1 fy"),
        ("plate_zero", "2 fy"),
    }
    assert {one.verdict for one in found} == {"ambiguous"}
    assert {one.class_id for one in found} == {"A"}
    assert all("to tell them apart, step off the plate" in one.sentence for one in found)
    for one in found:
        offset = number_of(one, "offset")
        assert offset.low < OFFSET_N < offset.high


def rows(selection: Selection):
    findings = findings_of(selection, np.random.default_rng(1))
    return rows_of(findings, tuple(one.name for one in selection.signatures.evidence.trials))


def test_the_rows_of_a_class():
    table = rows(alike())
    assert (table["class_id"][:2] == "A").all() and table["rank"][:2].tolist() == [1, 2]
    assert (table["effect"] != "none").all()
    said = table[table["verdict"] == "ambiguous"]
    assert (said["ci_low"] <= said["estimate"]).all() and (
        said["estimate"] <= said["ci_high"]
    ).all()
    assert (table.loc[table["verdict"] == "rejected", "class_id"] == "").all()


def test_the_row_of_nothing():
    table = rows(null())
    first = table.iloc[0]
    assert (first["rank"], first["effect"], first["verdict"]) == (1, "none", "named")
    assert first["trials"] == "a" and np.isnan(first["estimate"])
    assert (table["verdict"][1:] == "rejected").all()
    assert (table["rank"][1:] > 1).all()


def test_a_named_cause_needs_no_row_of_nothing():
    table = rows(late_with_offset())
    assert table.iloc[0]["effect"] == "sync_offset" and table.iloc[0]["rank"] == 1
    rejected = table[table["verdict"] == "rejected"]
    assert rejected["sentence"].str.startswith("not so: ").all()


# --- detection limits ---------------------------------------------------------------------------


def limits(selection: Selection) -> dict[tuple[str, str, str], Limit]:
    return {
        (one.place.candidate.effect.name, one.place.candidate.target, one.parameter): one
        for one in limits_of(selection)
    }


def in_typical_sizes(selection: Selection) -> dict[tuple[str, str, str], float]:
    scene = selection.signatures.evidence.trials[0].scene
    sizes = {}
    for key, limit in limits(selection).items():
        typical = {p.name: p.typical for p in limit.place.candidate.free(scene)}
        sizes[key] = limit.size / typical[limit.parameter]
    return sizes


def test_a_shift_along_a_hinge_would_not_be_found():
    evidence = all_of(noisy(part_of_moving(0, 8), 2))
    signatures = signatures_of(evidence, [EFFECTS["joint_centre"]])
    found = limits(select(signatures, np.random.default_rng(0)))
    sizes = {
        joint: [found["joint_centre", joint, f"shift_{axis}"].size for axis in "xyz"]
        for joint in ("knee_l", "hip_l")
    }
    assert sizes["knee_l"][2] == np.inf
    assert np.isfinite(sizes["hip_l"]).all()


def test_a_joint_does_not_lie_elsewhere_in_one_trial_alone():
    scenes = [noisy(part_of_moving(start, 6), start) for start in (0, 6)]
    effects = [EFFECTS[name] for name in ("joint_centre", "added_mass")]
    selection = select(signatures_of(all_of(*scenes), effects), np.random.default_rng(0))
    trials: dict[str, set[tuple[int, ...]]] = {}
    for limit in limits_of(selection):
        place = limit.place
        trials.setdefault(place.candidate.effect.name, set()).add(place.trials)
    assert trials == {"joint_centre": {(0, 1)}, "added_mass": {(0,), (1,), (0, 1)}}


def test_longer_recordings_show_smaller_causes(monkeypatch):
    """Down to what is too small to matter; least where the parameters do much the same. Where the
    share of the residual that is worth a name sets the limits, and not chance, they stay."""
    monkeypatch.setattr(detection, "WORTH", 0.0)
    short, long = (
        in_typical_sizes(
            nothing_else_in(selection_of(noisy(late(part_of_moving(0, seconds), DELAY_S), 3)))
        )
        for seconds in (3, 12)
    )
    assert short.keys() == long.keys()
    assert "unexplained" not in {name for name, *_ in short}
    assert min(long.values()) == NEGLIGIBLE
    above = [key for key, size in short.items() if size > 2 * NEGLIGIBLE]
    ratios = [long[key] / short[key] for key in above]
    assert len(above) > 5
    assert 0.2 < np.median(ratios) < 0.85 and min(ratios) < 0.75
    assert max(ratios) < 1.0


def test_what_is_not_worth_a_name_goes_unseen(monkeypatch):
    monkeypatch.setattr(detection, "WORTH", 0.0)
    by_chance = in_typical_sizes(nothing_else_in(null()))
    monkeypatch.setattr(detection, "WORTH", 0.5)
    not_worth = in_typical_sizes(nothing_else_in(null()))
    ratios = [not_worth[key] / size for key, size in by_chance.items() if np.isfinite(size)]
    assert min(ratios) >= 1 and max(ratios) > 2


def test_what_remains_hides_as_much(monkeypatch):
    monkeypatch.setattr(detection, "WORTH", 0.0)
    selection = null()
    alone = in_typical_sizes(nothing_else_in(selection))
    beside = in_typical_sizes(replace(selection, background=dict.fromkeys([(0,), ()], 1e3)))
    assert alone.keys() == beside.keys()
    ratios = [beside[key] / size for key, size in alone.items() if np.isfinite(beside[key])]
    least = selection.rounds[-1].chance.limit((0,), ALPHA)
    assert min(ratios) >= 1  # where nothing smaller would be named anyway
    assert max(ratios) == pytest.approx(np.sqrt(1e3 / least), rel=0.3)


def nothing_else_in(selection: Selection) -> Selection:
    """As if nothing remained that no cause explains: chance alone sets the limits."""
    return replace(selection, background={})


def test_no_limit_is_smaller_than_what_would_be_named():
    found = limits(late_with_offset())
    masses = [one.size for (name, _, part), one in found.items() if (name, part) == MASS]
    assert masses and min(masses) == EFFECTS["added_mass"].least_named["mass"]


def test_limits_are_told_though_nothing_was_worth_a_try():
    selection = selection_of(noisy(part_of_moving(0, 8), 11))
    assert [one.tried for one in selection.rounds] == [()]
    assert len(limits(selection)) > 50


def test_what_later_causes_push_to_a_bound_is_not_said(monkeypatch):
    """What is no longer possible beside the others is no finding, and not in the fit."""
    chosen = late_with_offset()
    found = chosen.fit.explanations
    zero = found[1].effect
    monkeypatch.setattr(type(zero), "possible", lambda *_: False)
    pushed = settled(chosen.signatures, chosen.rounds, found, rng())
    assert [one.effect.name for one in pushed.fit.explanations] == [found[0].effect.name]
    assert [one.effect for one in said_of(pushed)] == [found[0].effect.name]
    rejected = next(o for o in findings_of(pushed, rng()) if o.effect == zero.name)
    assert "its size cannot be" in rejected.sentence


def test_what_is_well_above_its_limit_is_found():
    """And the limit is no guess: a cause of a fifth of it is not."""
    limit = limits(late_with_offset())["plate_zero", "1 fy", "offset"]
    assert limit.unit == "N"
    zero = EFFECTS["plate_zero"]

    def found(times: float) -> list[tuple[str, str]]:
        scene = with_effect(part_of_moving(0, 12), zero, "1 fy", times * limit.size)
        return [(one.effect, one.target) for one in said_of(selection_of(noisy(scene, 12)))]

    assert ("plate_zero", "1 fy") in found(1.5)
    assert found(0.2) == []
