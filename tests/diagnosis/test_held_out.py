"""A cause pays off on stretches that did not help to find its size; a chance course does not."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from bsip_cli.diagnosis.explanation import Explanation, Fit, fit_together
from bsip_cli.diagnosis.held_out import FOLDS, gain_of, values_without
from bsip_cli.diagnosis.together import Evidence
from bsip_cli.effects.catalogue import EFFECTS
from tests.diagnosis.noisy_trial import all_of, fitted, late, noisy, null, part_of_moving

DELAY_S = 0.006


@cache
def both() -> tuple[Evidence, Fit]:
    """The first trial's forces are late, the second's are not; and the delay as it is found."""
    first, second = part_of_moving(0, 12), part_of_moving(12, 8)
    evidence = all_of(noisy(late(first, DELAY_S), 1), noisy(second, 2))
    return fitted(evidence, null(EFFECTS["sync_offset"], ""))


def evidence() -> Evidence:
    return both()[0]


def fit() -> Fit:
    return both()[1]


def test_a_real_cause_gains_in_its_trial():
    before = fit_together(evidence(), ())
    gain = gain_of(evidence(), (0,), before.residual, fit().residual, fit().tangent)
    rows = evidence().rows(0)
    apparent = 1 - (fit().residual[rows] ** 2).sum() / (before.residual[rows] ** 2).sum()
    assert gain.is_real()
    assert gain.percent > 20
    assert gain.percent == pytest.approx(100 * apparent, abs=1.0)
    assert 0 < gain.error_percent < gain.percent
    blocks = evidence().blocks()
    assert gain.concerned.sum() == len(np.unique(blocks[rows]))
    assert not gain.blocks[~gain.concerned].any()


def test_chance_courses_lose():
    """Ten free numbers fit white noise where they were found, and make it worse elsewhere."""
    rng = np.random.default_rng(3)
    gains, apparent = [], []
    for _ in range(30):
        before = rng.normal(size=len(evidence().residual))
        tangent = rng.normal(size=(len(before), 10))
        size = np.linalg.lstsq(tangent, before, rcond=None)[0]
        after = before - tangent @ size
        gains.append(gain_of(evidence(), (0, 1), before, after, tangent))
        apparent.append(100 * (1 - (after**2).sum() / (before**2).sum()))
    assert min(apparent) > 0
    assert np.mean([gain.percent for gain in gains]) < 0
    assert np.mean([gain.is_real() for gain in gains]) < 0.15


def test_each_fold_has_values_of_its_own():
    """Those of a fit to the other blocks; near one another, as the cause is true."""
    (folds,) = values_without(evidence(), fit())
    values = np.array(folds)[:, 0]
    assert len(values) == FOLDS == len(set(values))
    assert values == pytest.approx(np.full(FOLDS, DELAY_S), abs=5e-4)
    fold = evidence().blocks() % FOLDS
    for number, value in enumerate(values):
        train = fold != number
        column, left = fit().tangent[train, 0], fit().residual[train]
        expected = fit().explanations[0].values[0] + 0.01 * (column @ left) / (column @ column)
        assert value == pytest.approx(expected, rel=1e-9)


def test_a_cause_of_the_first_trial_does_not_help_the_second():
    before = fit_together(evidence(), ())
    everywhere = Explanation(
        null(EFFECTS["sync_offset"], "", trials=(0, 1)).place, fit().explanations[0].values
    )
    left = evidence().residual - everywhere.change(evidence())
    wrong = Fit((everywhere,), left, everywhere.tangent(evidence()))
    gain = gain_of(evidence(), (1,), before.residual, wrong.residual, wrong.tangent)
    assert gain.percent < 0 and not gain.is_real()
