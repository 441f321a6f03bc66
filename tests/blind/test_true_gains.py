"""What a found cause gains beside what the hidden one would."""

from __future__ import annotations

import json

import numpy as np
import pytest

from bsip_cli.diagnosis.cause import Cause
from bsip_cli.effects.catalogue import EFFECTS
from tests.blind.blind_truth import Expected
from tests.blind.true_gains import _gains, summary
from tests.diagnosis.noisy_trial import all_of, late, noisy, part_of_moving

DELAY_S = 0.010


def gains(said_s: float) -> dict:
    """Of a delay that is said to be this long."""
    evidence = all_of(noisy(late(part_of_moving(0, 12), DELAY_S), 3))
    values = np.array([said_s])
    cause = Cause(EFFECTS["sync_offset"], "", ("a",), values, values[None])
    (found,) = _gains(evidence, [cause], [(cause, Expected("sync_offset", "", {"delay": DELAY_S}))])
    return found


def test_the_truth_itself_gains_as_much():
    found = gains(DELAY_S)
    assert found["effect"] == "sync_offset"
    assert found["truth"] > 25
    assert found["found"] == pytest.approx(found["truth"], rel=0.03)


def test_a_truth_in_other_numbers_is_left_out():
    evidence = all_of(noisy(late(part_of_moving(0, 12), DELAY_S), 3))
    cause = Cause(EFFECTS["sync_offset"], "", ("a",), np.array([DELAY_S]), np.zeros((1, 1)))
    assert not list(_gains(evidence, [cause], [(cause, Expected("sync_offset", "", {}))]))


def test_the_table_holds_medians_and_the_worst(tmp_path):
    rows = [{"effect": "breathing", "found": 40.0 + k, "truth": 50.0} for k in range(3)]
    (tmp_path / "a.json").write_text(json.dumps(rows[:2]))
    (tmp_path / "b.json").write_text(json.dumps(rows[2:]))
    told = summary(tmp_path)
    assert "| breathing | 3 | 41 | 50 | 0.82 | 0.804 |" in told
    assert told.endswith("All 3 cases: 0.820 of the truth's gain (median).")
