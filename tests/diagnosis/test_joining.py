"""What two rounds found is told once where the trials agree on it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bsip_cli.diagnosis.explanation import Explanation, explanation_of, fit_together
from bsip_cli.diagnosis.held_out import gain_of
from bsip_cli.diagnosis.joining import joined
from bsip_cli.diagnosis.judging import Tried
from bsip_cli.diagnosis.signatures import Signatures, signatures_of
from bsip_cli.diagnosis.together import Evidence
from bsip_cli.effects.catalogue import EFFECTS
from tests.diagnosis.noisy_trial import all_of, late, noisy, part_of_moving, with_effect


def trials_late_by(*delays_s: float) -> Evidence:
    scenes = (late(part_of_moving(8 * k, 8), delay) for k, delay in enumerate(delays_s))
    return all_of(*(noisy(scene, 5 + k) for k, scene in enumerate(scenes)))


def signatures(evidence: Evidence) -> Signatures:
    return signatures_of(evidence, [EFFECTS["sync_offset"], EFFECTS["plate_drift"]])


def delay_in(evidence: Evidence, trial: int, delay_s: float) -> Explanation:
    scene = evidence.trials[trial].scene
    return explanation_of(EFFECTS["sync_offset"], "", np.array([delay_s]), scene, (trial,))


def kept(evidence: Evidence, one: Explanation) -> tuple[Tried, Explanation]:
    fit, trials = fit_together(evidence, (one,)), one.place.trials
    gain = gain_of(evidence, trials, evidence.residual, fit.residual, fit.tangent)
    return Tried(one, 100.0, 1e-9, gain, fit, False, True, False), one


def test_trials_that_agree_share_one_cause():
    evidence = trials_late_by(0.008, 0.008)
    found = [kept(evidence, delay_in(evidence, t, 0.008)) for t in (0, 1)]
    (tried, both), later = joined(signatures(evidence), found)
    assert later is None
    assert tried.explanation is both and both.place.trials == (0, 1)
    assert tried.gain.concerned.all() and tried.score == 200.0
    assert tried.gain.blocks == pytest.approx(sum(one.gain.blocks for one, _ in found))


@pytest.mark.parametrize(("in_second", "left"), [(True, 1), (False, 0)])
def test_what_one_trial_tells_from_it_is_no_rival_in_both(in_second, left):
    evidence = trials_late_by(0.008, 0.008)
    found = [kept(evidence, delay_in(evidence, t, 0.008)) for t in (0, 1)]
    drift = EFFECTS["clock_drift"]
    rivals = [
        kept(evidence, explanation_of(drift, "", np.array([1e-4]), one.scene, (t,)))[0]
        for t, one in enumerate(evidence.trials)
    ]
    first, second = (
        (replace(tried, rivals=(rival,) if has else ()), one)
        for (tried, one), rival, has in zip(found, rivals, (True, in_second), strict=True)
    )
    (tried, _), _ = joined(signatures(evidence), [first, second])
    assert len(tried.rivals) == left


def test_trials_that_differ_keep_theirs():
    evidence = trials_late_by(0.006, 0.014)
    found = [kept(evidence, delay_in(evidence, t, s)) for t, s in ((0, 0.006), (1, 0.014))]
    assert joined(signatures(evidence), found) == found


def test_what_does_not_last_is_another_cause_in_every_trial():
    drift, target, size = EFFECTS["plate_drift"], "1 fz", 2.0
    parts = (with_effect(part_of_moving(8 * k, 8), drift, target, size) for k in range(2))
    evidence = all_of(*(noisy(scene, 5 + k) for k, scene in enumerate(parts)))
    causes = (
        explanation_of(drift, target, np.array([size]), one.scene, (t,))
        for t, one in enumerate(evidence.trials)
    )
    found = [kept(evidence, one) for one in causes]
    assert joined(signatures(evidence), found) == found
