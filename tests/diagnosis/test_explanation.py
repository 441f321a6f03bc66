"""Effects fitted to the evidence: sizes by steps, moments by search."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bsip_cli.diagnosis.candidates import candidates_of
from bsip_cli.diagnosis.explanation import fit_together, refined
from bsip_cli.diagnosis.intervals import SCALE_ERROR, drawn_explanations
from bsip_cli.effects.catalogue import EFFECTS
from tests.diagnosis.noisy_trial import (
    all_of,
    fitted,
    late,
    noisy,
    null,
    part_of_moving,
    with_effect,
)


def test_a_release_is_found_between_the_moments_that_are_tried():
    effect, moment = EFFECTS["released_object"], 6.45
    scene = noisy(with_effect(part_of_moving(0, 12), effect, "hand_r", 1.2, moment), 3)
    evidence = all_of(scene)
    tried = [c.scanned[0] for c in candidates_of(effect, scene) if c.target == "hand_r"]
    nearest = min(tried, key=lambda t: abs(t - moment))
    assert abs(nearest - moment) > 0.1
    start = null(effect, "hand_r", (nearest,))
    found = refined(evidence, start, fit_together(evidence, ()))
    assert found.values[1] == pytest.approx(moment, abs=0.03)
    assert found.place == start.place
    fit = fit_together(evidence, (found,))
    mass, at = fit.explanations[0].values
    assert mass == pytest.approx(1.2, abs=0.05) and at == found.values[1]
    coarse = fit_together(evidence, (start,))
    assert (fit.residual**2).sum() < (coarse.residual**2).sum() - 10


def test_a_size_at_its_bound_leaves_the_others_where_they_fit_best():
    """Held until 7 s: said best by more until 6 s, and by less than nothing until 5 s."""
    effect = EFFECTS["released_object"]
    evidence = all_of(noisy(with_effect(part_of_moving(0, 12), effect, "hand_r", 1.2, 7.0), 3))
    near, far = (null(effect, "hand_r", (t,)) for t in (6.0, 5.0))
    alone, both = (fit_together(evidence, ones) for ones in ((near,), (near, far)))
    assert both.explanations[1].values[0] == 0.0
    assert both.explanations[0].values == pytest.approx(alone.explanations[0].values, rel=1e-6)
    assert (both.residual**2).sum() == pytest.approx((alone.residual**2).sum(), rel=1e-9)


def test_what_a_hinge_does_not_tell_stays_where_it_is():
    """A shift along its axis changes nothing; the rest is fitted, and nothing runs to a bound."""
    effect, scene = EFFECTS["joint_centre"], part_of_moving(0, 12)
    shift = np.array([0.02, -0.01, 0.0])
    evidence = all_of(noisy(with_effect(scene, effect, "knee_r", *shift), 3, 0.01))
    start = replace(null(effect, "knee_r"), values=np.zeros(3))
    (found,) = fit_together(evidence, (start,)).explanations
    untold = np.linalg.svd(found.tangent(evidence))[2][2]
    assert abs(untold @ found.values) < 1e-6
    hidden, seen = (effect.change(scene, "knee_r", x) for x in (shift, found.values))
    assert np.abs(seen - hidden).max() < 0.3 * np.abs(hidden).max()  # the rest passes for noise
    assert found.is_possible(evidence)


def test_what_one_trial_forbids_is_impossible_in_both(monkeypatch):
    scenes = [noisy(part_of_moving(start, 6), start) for start in (0, 6)]
    evidence = all_of(*scenes)
    one = null(EFFECTS["sync_offset"], "", trials=(0, 1))
    assert one.is_possible(evidence)
    second = evidence.trials[1].scene
    monkeypatch.setattr(type(one.effect), "possible", lambda self, scene, *_: scene is not second)
    assert not one.is_possible(evidence)


def test_a_range_is_told_of_the_longest_trial():
    evidence = all_of(noisy(part_of_moving(0, 4), 1), noisy(part_of_moving(4, 8), 1))
    bend = replace(null(EFFECTS["missing_joint"], "upper_torso", trials=(0, 1)), values=np.ones(3))
    scenes = (one.scene for one in evidence.trials)
    short, long = (bend.effect.reported(scene, bend.target, bend.values) for scene in scenes)
    assert bend.reported(evidence) == long != short


def test_without_a_scan_there_is_nothing_to_refine():
    evidence = all_of(noisy(part_of_moving(0, 6), 1))
    one = null(EFFECTS["sync_offset"], "")
    assert refined(evidence, one, fit_together(evidence, ())) is one


@pytest.mark.parametrize("delay", [0.006, 0.06])
def test_a_delay_comes_out_of_the_noise_round_by_round(delay):
    """At first much of it is taken for noise, and of a large one most is clipped."""
    evidence = all_of(noisy(late(part_of_moving(0, 12), delay), 4))
    one = null(EFFECTS["sync_offset"], "")
    first, last = (fitted(evidence, one, rounds=k)[1].explanations[0].values[0] for k in (1, 4))
    assert 0.3 * delay < first < 0.98 * delay
    assert last == pytest.approx(delay, abs=1e-4)


def test_two_causes_are_told_apart():
    zero = EFFECTS["plate_zero"]
    scene = with_effect(late(part_of_moving(0, 12), 0.008), zero, "2 fy", -6.0)
    causes = null(EFFECTS["sync_offset"], ""), null(zero, "2 fy")
    evidence, fit = fitted(all_of(noisy(scene, 5)), *causes)
    delay, offset = (one.values[0] for one in fit.explanations)
    assert delay == pytest.approx(0.008, abs=4e-4)
    assert offset == pytest.approx(-6.0, abs=0.5)
    assert fit.columns(0, evidence) == slice(0, 1) and fit.columns(1, evidence) == slice(1, 2)


def test_values_stay_within_their_bounds():
    evidence = all_of(noisy(part_of_moving(0, 6), 1))
    one = null(EFFECTS["released_object"], "hand_r", (3.0,))
    assert one.moved(evidence, np.array([-3.0])).values.tolist() == [0.0, 3.0]
    assert not one.moved_freely(evidence, np.array([-3.0])).is_possible(evidence)
    assert one.is_negligible(evidence)
    assert one.all_moved(evidence, np.array([2.0, 100.0])).values[1] == pytest.approx(5.98)


def test_intervals_hold_the_truth_and_shrink_with_time():
    widths = []
    for seconds in (5, 24):
        evidence = all_of(noisy(late(part_of_moving(0, seconds), 0.01), 6))
        evidence, fit = fitted(evidence, null(EFFECTS["sync_offset"], ""))
        draws = drawn_explanations(evidence, fit, 0, np.random.default_rng(1))
        delays = [one.values[0] for one in draws]
        assert min(delays) < 0.01 < max(delays)
        widths.append(np.std(delays))
    assert widths[1] < widths[0]  # down to what the motion itself errs by
    assert widths[1] > 0.9 * SCALE_ERROR * 0.01
