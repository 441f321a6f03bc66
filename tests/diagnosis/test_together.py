"""Trials of one person, whose parameters are the same in all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bsip_cli.diagnosis.together import Evidence, clipped, together
from bsip_cli.effects.segment_inertia import SegmentInertia
from tests.diagnosis.noisy_trial import (
    MASS_SD_KG,
    SEGMENTS,
    all_of,
    noisy,
    part_of_moving,
    with_effect,
)


def trials(extra_kg: float = 0.0):
    """Two trials of a person whose thigh is so much heavier than the table has it."""
    scenes = (noisy(part_of_moving(0, 6), 1), noisy(part_of_moving(6, 8), 2))
    values = np.array([extra_kg, *[0.0] * 9])
    return all_of(*(with_effect(s, SegmentInertia(), "thigh_r", *values) for s in scenes))


def weighed(evidence: Evidence, sd_kg: float) -> Evidence:
    """The same of a person whose mass a scale has told to a standard deviation."""
    heavier = np.full(len(SEGMENTS), MASS_SD_KG / sd_kg)
    return together(
        tuple(
            replace(one, filtered=replace(one.filtered, heavier=heavier)) for one in evidence.trials
        )
    )


def test_rows_follow_one_another():
    evidence = trials()
    first, second = (len(one.residual) for one in evidence.trials)
    assert evidence.rows(0) == slice(0, first)
    assert evidence.rows(1) == slice(first, first + second) and first + second == len(
        evidence.residual
    )
    part = np.ones((second, 1))
    columns = evidence.white({1: part})
    bare = np.concatenate([np.zeros((first, 1)), part])
    np.testing.assert_allclose(columns, evidence.turned(bare))


def test_blocks_are_counted_through_all_trials():
    evidence = trials()
    blocks = evidence.blocks()
    assert (np.diff(blocks) >= 0).all() and set(np.diff(blocks)) == {0, 1}
    assert blocks[evidence.rows(0)].max() + 1 == evidence.first_block(1)
    for t, one in enumerate(evidence.trials):
        at = one.rows_s()
        assert blocks[evidence.rows(t)].max() - evidence.first_block(t) == int(at[-1] - at[0])


def test_the_same_nuisance_in_both_trials_goes():
    """Four standard deviations of a mass: large alone, and known from both once they are joined."""
    evidence = trials(2.0)
    alone = np.concatenate([one.residual for one in evidence.trials])
    column = np.concatenate([one.shared[:, SEGMENTS.index("thigh_r")] for one in evidence.trials])
    assert abs(column @ alone) / np.linalg.norm(column) > 20
    turned = evidence.turned(column[:, None])[:, 0]
    assert abs(turned @ evidence.residual) / np.linalg.norm(turned) < 6
    assert evidence.residual.std() == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("extra_kg", [0.0, 2.0])
def test_how_far_the_likeliest_body_is_from_the_stated_mass(extra_kg):
    evidence = weighed(trials(extra_kg), 0.25)
    assert evidence.beyond_stated(evidence.residual) == pytest.approx(4 * extra_kg, abs=0.8)
    assert trials(extra_kg).beyond_stated(evidence.residual) == 0.0


def test_what_differs_between_the_trials_stays():
    """A mass in one trial alone is no parameter of the person."""
    evidence = trials()
    one = evidence.trials[0].shared[:, 1:2]
    both = np.concatenate([trial.shared[:, 1:2] for trial in evidence.trials])
    kept = np.linalg.norm(evidence.white({0: one})) / np.linalg.norm(one)
    gone = np.linalg.norm(evidence.turned(both)) / np.linalg.norm(both)
    assert gone < 0.1 < 0.5 < kept


def test_outliers_count_as_four():
    assert clipped(np.array([-9.0, -3.0, 5.0])).tolist() == [-4.0, -3.0, 4.0]
