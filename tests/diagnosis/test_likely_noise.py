"""The noise of a trial must not hold its causes, before these are known."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from bsip_cli.diagnosis.candidates import Candidate
from bsip_cli.diagnosis.explanation import Explanation, Fit, fit_together
from bsip_cli.diagnosis.likely_noise import likely_columns, noise_beside_fit, with_likely_noise
from bsip_cli.diagnosis.signatures import Signatures, signatures_of
from bsip_cli.effects.catalogue import EFFECTS
from bsip_cli.effects.scene import Scene
from tests.diagnosis.noisy_trial import all_of, late, noisy, part_of_moving, with_effect

EFFECTS_ASKED = [EFFECTS[name] for name in ("sync_offset", "plate_drift", "unmeasured_contact")]
LEANING = ("hand_l", 0.0, 10.0, 60.0, 4.0, 4.0)


def asked(*scenes: Scene) -> tuple[Signatures, Fit]:
    signatures = signatures_of(all_of(*scenes), EFFECTS_ASKED)
    return signatures, fit_together(signatures.evidence, ())


@cache
def clean() -> tuple[Signatures, Fit]:
    return asked(noisy(part_of_moving(0, 10), 1), noisy(part_of_moving(10, 10), 2))


@cache
def wrong() -> tuple[Signatures, Fit]:
    """The first trial is 8 ms late, in the second the person leans on something."""
    first, second = part_of_moving(0, 10), part_of_moving(10, 10)
    leaning = with_effect(second, EFFECTS["unmeasured_contact"], *LEANING)
    return asked(noisy(late(first, 0.008), 1), noisy(leaning, 2))


def spread_of(signatures: Signatures, trial: int) -> np.ndarray:
    """(6,) mean noise."""
    return signatures.evidence.trials[trial].whitening.spread.mean(axis=0)


@pytest.mark.parametrize("trial", [0, 1])
def test_each_trial_has_the_noise_beside_its_own_cause(trial):
    expected = spread_of(clean()[0], trial)
    before = spread_of(wrong()[0], trial)
    found, _ = with_likely_noise(*wrong())
    too_large = (before / expected).mean() - 1
    assert too_large > 0.4
    assert abs((spread_of(found, trial) / expected).mean() - 1) < 0.5 * too_large


def test_nothing_is_likely_in_a_null():
    signatures, fit = clean()
    assert likely_columns(signatures, fit).shape == (len(fit.residual), 0)
    likely, _ = with_likely_noise(signatures, fit)
    alone, _ = noise_beside_fit(signatures, fit)
    np.testing.assert_array_equal(spread_of(likely, 0), spread_of(alone, 0))


def test_what_is_likely_explains_the_residual():
    signatures, fit = with_likely_noise(*wrong())
    columns, residual = likely_columns(signatures, fit), signatures.evidence.residual
    size = np.linalg.lstsq(columns, residual, rcond=None)[0]
    assert np.std(residual - columns @ size) < 0.5 * np.std(residual)


def test_a_known_cause_gives_way_to_what_is_likely():
    """An offset is known where a channel drifts: too large at first, and then too small."""
    scene, channel = part_of_moving(0, 10), "1 fx"
    effects = [EFFECTS[name] for name in ("plate_zero", "plate_drift")]
    drifting = noisy(with_effect(scene, EFFECTS["plate_drift"], channel, 3.0), 1)
    signatures = signatures_of(all_of(drifting), effects)
    place = next(p for p in signatures.places if p.candidate == Candidate(effects[0], channel, ()))
    fit = fit_together(signatures.evidence, (Explanation(place, np.array([10.0])),))
    expected = spread_of(signatures_of(all_of(noisy(scene, 1)), effects), 0)
    alone, _ = noise_beside_fit(signatures, fit)
    found, _ = with_likely_noise(signatures, fit)
    before, after = (spread_of(one, 0)[0] / expected[0] for one in (alone, found))
    assert before > 1.5 and after < 1.15
