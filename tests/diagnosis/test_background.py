"""A cause must explain more than what remains beside all causes."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from bsip_cli.diagnosis import settling
from bsip_cli.diagnosis.background import background_of, new_places
from bsip_cli.diagnosis.clock_pattern import ClockJump
from bsip_cli.diagnosis.explanation import fit_together
from bsip_cli.diagnosis.findings import Finding, findings_of
from bsip_cli.diagnosis.judging import DROWNED
from bsip_cli.diagnosis.likely_noise import noise_beside_fit
from bsip_cli.diagnosis.refitting import start_at
from bsip_cli.diagnosis.rounds import Selection
from bsip_cli.diagnosis.selection import select
from bsip_cli.diagnosis.signatures import Signatures, signatures_of
from bsip_cli.effects.catalogue import EFFECTS
from tests.diagnosis.noisy_trial import all_of, late, noisy, part_of_moving, shown, with_effect

NAMES = ("sync_offset", "plate_gain", "plate_zero", "added_mass")
EFFECTS_ASKED = [EFFECTS[name] for name in NAMES]
DELAY_S, OFFSET_N = 0.010, 8.0
LONG_S, BLUR_S2 = 0.03, 4e-4


def rng() -> np.random.Generator:
    return np.random.default_rng(0)


@cache
def signatures() -> Signatures:
    """A late trial, and one that is fine."""
    delayed, fine = late(part_of_moving(0, 10), DELAY_S), part_of_moving(10, 10)
    return signatures_of(all_of(noisy(delayed, 3), noisy(fine, 4)), EFFECTS_ASKED)


@cache
def selected() -> Selection:
    return select(signatures(), rng())


@cache
def two_causes() -> Signatures:
    scene = late(part_of_moving(0, 12), DELAY_S)
    scene = with_effect(scene, EFFECTS["plate_zero"], "1 fx", OFFSET_N)
    return signatures_of(all_of(noisy(scene, 4)), EFFECTS_ASKED)


def named_in(chosen: Selection) -> list[Finding]:
    findings = findings_of(chosen, np.random.default_rng(1))
    return [one for one in findings if one.verdict == "named"]


def test_the_rest_of_a_cause_is_no_other_cause():
    chosen = selected()
    assert [one.effect.name for one in chosen.fit.explanations] == ["sync_offset"]
    places = [chosen.signatures.places[k] for k in new_places(chosen.signatures, chosen.fit)]
    again = {place.trials for place in places if place.candidate.effect.name == "sync_offset"}
    assert again == {(1,)}
    nothing = fit_together(signatures().evidence, ())
    assert len(new_places(signatures(), nothing)) == len(signatures().places)


def test_what_nobody_has_found_remains_where_it_is():
    before = background_of(signatures(), fit_together(signatures().evidence, ()))
    after = selected().background
    assert before.keys() == after.keys() == {(0,), (1,), ()}
    assert before[0,] > 10 * after[0,]
    assert before[0,] > 10 * before[1,]


def test_a_cause_that_stands_out_is_named():
    chosen = selected()
    (kept,) = (one.kept for one in chosen.rounds if one.kept)
    assert kept.score > 5 * chosen.background[0,]
    assert [one.effect for one in named_in(chosen)] == ["sync_offset"]


@pytest.mark.parametrize("rest", [{}, {(0,): 0.0, (1,): 0.0, (): 0.0}])
def test_where_nothing_remains_a_cause_stands_out(monkeypatch, rest):
    monkeypatch.setattr(settling, "background_of", in_groups(rest))
    assert [one.effect for one in named_in(select(signatures(), rng()))] == ["sync_offset"]


def test_what_does_not_stand_out_has_no_name(monkeypatch):
    monkeypatch.setattr(settling, "background_of", remaining(1e4))
    chosen = select(signatures(), rng())
    assert chosen.fit.explanations == ()
    (unnamed,) = named_in(chosen)
    assert (unnamed.effect, unnamed.target, unnamed.trials) == ("unexplained", "", ("a",))
    assert "explains less than it leaves over (the forces were" in unnamed.sentence
    (number,) = unnamed.numbers
    assert 100 * number.value == pytest.approx(unnamed.gain[0])
    findings = findings_of(chosen, np.random.default_rng(1))
    drowned = next(one for one in findings if one.effect == "sync_offset" and one.trials == ("a",))
    assert drowned.verdict == "rejected" and "remains without a cause" in drowned.sentence


def test_each_trial_is_without_a_name_once(monkeypatch):
    """Two causes that do not stand out in one trial: the one that came nearer is told."""
    strong, weak = (one.kept for one in select(two_causes(), rng()).rounds if one.kept)
    monkeypatch.setattr(settling, "background_of", remaining(1e6))
    chosen = select(two_causes(), rng())
    assert sum(one.given_up is DROWNED for each in chosen.rounds for one in each.tried) == 2
    (unnamed,) = named_in(chosen)
    assert strong.score > weak.score
    assert "(the forces were" in unnamed.sentence
    assert strong.explanation.effect.name == "sync_offset"


def test_of_a_cause_in_two_trials_the_one_without_another_is_told(monkeypatch):
    scenes = [late(part_of_moving(start, 8), DELAY_S) for start in (0, 8)]
    first = with_effect(scenes[0], EFFECTS["plate_zero"], "1 fx", 60.0)
    both = signatures_of(all_of(noisy(first, 4), noisy(scenes[1], 5)), EFFECTS_ASKED)
    found = {
        one.kept.explanation.effect.name: one.kept for one in select(both, rng()).rounds if one.kept
    }
    assert found["sync_offset"].trials == (0, 1) and found["plate_zero"].trials == (0,)
    monkeypatch.setattr(settling, "background_of", in_groups({(0,): 1.0, (1,): 1.0, (): 1e6}))
    said = {(one.effect, one.trials) for one in named_in(select(both, rng()))}
    assert said == {("plate_zero", ("a",)), ("unexplained", ("b",))}


def in_groups(scores):
    return lambda signatures, fit: scores


def test_beside_a_named_cause_what_is_weaker_than_the_rest_is_left_out(monkeypatch):
    strong, weak = (one.kept for one in select(two_causes(), rng()).rounds if one.kept)
    assert strong.score > 1.15 * weak.score
    monkeypatch.setattr(settling, "background_of", remaining(1.1 * weak.score))
    (named,) = named_in(select(two_causes(), rng()))
    assert named.effect == strong.explanation.effect.name


def remaining(score: float):
    def background(signatures, fit):
        return dict.fromkeys(background_of(signatures, fit), score)

    return background


def test_no_short_delay_remains_beside_a_long_one():
    """Their signatures differ, so one alone would seem to explain what the simulation lacks."""
    scene = late(part_of_moving(0, 12, amplitude=0.8), LONG_S)
    blurred = shown(
        scene, BLUR_S2 * np.gradient(np.gradient(scene.measured, axis=0), axis=0) * scene.rate_hz**2
    )
    asked = signatures_of(all_of(noisy(blurred, 4)), [EFFECTS["sync_offset"], ClockJump()])
    delay = next(k for k, p in enumerate(asked.places) if p.candidate.effect.name == "sync_offset")
    start = start_at(asked.evidence, asked.places[delay], np.array([5.0]))
    signatures, fit = noise_beside_fit(asked, fit_together(asked.evidence, (start,)))
    scores, _ = signatures.scores(fit.residual[:, None], fit.tangent)
    linear = max(scores[k, 0] for k in new_places(signatures, fit))
    assert linear > 40
    assert background_of(signatures, fit)[0,] < 0.2 * linear
