"""How large a score chance brings."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from bsip_cli.diagnosis.chance import Chance, chance_of, flipped
from bsip_cli.diagnosis.signatures import Signatures, signatures_of
from bsip_cli.effects.catalogue import EFFECTS
from tests.diagnosis.noisy_trial import all_of, noisy, part_of_moving

SEEDS = 80
NAMES = ("sync_offset", "gravity_tilt", "plate_zero", "added_mass")


@cache
def signatures(*names: str) -> Signatures:
    scenes = (noisy(part_of_moving(0, 10), 1), noisy(part_of_moving(10, 10), 2))
    return signatures_of(all_of(*scenes), [EFFECTS[name] for name in names or NAMES])


def nothing(residual: np.ndarray) -> np.ndarray:
    return np.zeros((len(residual), 0))


def chance_in(found: Signatures, residual: np.ndarray, seed: int) -> Chance:
    courses = flipped(found.evidence, residual, np.random.default_rng(seed))
    return chance_of(found.scores(courses, nothing(residual))[0], found.places)


def least_p(found: Signatures, residual: np.ndarray, seed: int) -> float:
    """Of all places."""
    scores = found.scores(residual[:, None], nothing(residual))[0][:, 0]
    chance = chance_in(found, residual, seed)
    return min(
        chance.p_value(score, place.trials)
        for score, place in zip(scores, found.places, strict=True)
    )


def test_in_white_noise_small_p_values_are_rare():
    """The least p-value of all places is below x in about x of cases; never far more often."""
    found = signatures()
    rng = np.random.default_rng(7)
    size = len(found.evidence.residual)
    p_values = np.array([least_p(found, rng.normal(size=size), seed) for seed in range(SEEDS)])
    assert (p_values < 0.05).sum() <= 10  # four are expected; more than ten once in a thousand
    assert (p_values < 0.5).mean() < 0.7
    assert (p_values < 0.5).mean() > 0.1  # and chance is not made larger than it is


def test_no_cause_that_lasts_survives_the_flips():
    found = signatures()
    place = next(k for k, p in enumerate(found.places) if p.candidate.effect.name == "sync_offset")
    trial = found.places[place].trials[0]
    column = found.white(trial, found.places[place].candidate)
    cause = found.evidence.white({trial: column})[:, 0]
    noise = np.random.default_rng(3).normal(size=len(cause))
    residual = noise + 25 * cause / np.linalg.norm(cause)
    logs, _ = found.scores(residual[:, None], nothing(residual))
    turned = flipped(found.evidence, residual, np.random.default_rng(4))
    others, _ = found.scores(turned, nothing(residual))
    assert logs[place, 0] > 200
    assert np.median(others[place]) < 0.15 * logs[place, 0]
    assert chance_in(found, residual, 4).p_value(logs[place, 0], (trial,)) < 1e-3


def test_flips_turn_whole_stretches():
    found = signatures()
    residual = found.evidence.residual
    turned = flipped(found.evidence, residual, np.random.default_rng(1))
    np.testing.assert_array_equal(np.abs(turned), np.abs(residual)[:, None] + 0 * turned)
    signs = np.sign(turned / residual[:, None])
    blocks = found.evidence.blocks()
    for block in (0, 7, blocks.max()):
        assert (np.ptp(signs[blocks == block], axis=0) == 0).all()
    assert 0.4 < (signs[blocks == 3][0] > 0).mean() < 0.6


@pytest.mark.parametrize("trials", [(0,), (1,), (0, 1)])
def test_the_limit_is_the_score_of_that_p_value(trials):
    found = signatures()
    chance = chance_in(found, found.evidence.residual, 2)
    assert chance.p_value(chance.limit(trials, 0.05), trials) == pytest.approx(0.05)
    assert chance.limit(trials, 0.001) > chance.limit(trials, 0.05)


def test_one_restless_trial_hides_nothing_in_another():
    """Of what has nothing to do with the parameters that they share."""
    found = signatures("sync_offset", "plate_crosstalk")
    rng = np.random.default_rng(5)
    residual = rng.normal(size=len(found.evidence.residual))
    calm = chance_in(found, residual, 1)
    residual[found.evidence.rows(1)] *= 4
    restless = chance_in(found, residual, 1)
    assert restless.limit((0,), 0.05) < 1.5 * calm.limit((0,), 0.05)
    assert restless.limit((1,), 0.05) > 8 * calm.limit((1,), 0.05)
