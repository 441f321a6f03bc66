"""What one person's own recordings say of a fault that is known from the laboratory."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from bsip_cli.diagnosis.shared_faults import Coordinate
from bsip_cli.stages.known_laboratory import Known, alone
from bsip_cli.statistics.samples import Z95
from tests.diagnosis.test_laboratory import DELAY, drawn, numbers
from tests.effects.moving_scene import moving

DELAY_S = 0.015


def test_intervals_of_one_person_hold_as_often_as_they_say():
    rng, known = np.random.default_rng(3), numbers()
    held = []
    for _ in range(40):
        sizes = {one: float(rng.standard_normal()) for one in known}
        found = alone(drawn(rng, sizes, 1, between=0.0))
        held += [abs(mean - sizes[one]) < Z95 * sd for one, (mean, sd) in found.items()]
    assert len(held) > 1000
    assert 0.93 < np.mean(held) < 0.98


def test_sessions_are_a_sum_and_who_says_nothing_has_no_number():
    (one,) = drawn(np.random.default_rng(4), {DELAY: 1.0}, 1)
    (_, twice), (_, once) = (alone(x)[DELAY] for x in ([one, one], [one]))
    assert twice < once
    nothing = replace(one, precision=0 * one.precision, pull=0 * one.pull)
    assert alone([nothing]) == {}


@pytest.mark.parametrize(
    ("own", "said"),
    [
        ({DELAY: (1.4, 0.2)}, "alone also show it: 14.0 ms, 95 % interval 10.1 to 17.9 ms"),
        ({DELAY: (0.6, 0.5)}, "alone leave it open: 6 ms, 95 % interval -4 to 16 ms"),
        ({Coordinate("plate_gain", "1 fz", "gain"): (1.0, 0.1)}, None),
    ],
)
def test_the_sentence_says_whether_the_person_shows_it_too(own, said):
    row = {
        "effect": "sync_offset", "target": "", "parameter": "delay", "unit": "s",
        "estimate": DELAY_S, "ci_low": 0.011, "ci_high": 0.019, "probability": 0.999,
        "verdict": "named", "persons": 4,
    }  # fmt: skip
    known = Known((), np.zeros(0), np.zeros((0, 0)), pd.DataFrame([row]), own)
    (finding,) = known.findings([SimpleNamespace(scene=moving(), name="sub-01_task-squat")])
    end = "known from the laboratory (4 persons)"
    if said is None:
        assert finding.sentence.endswith(end)
    else:
        assert finding.sentence.endswith(f"{end}, and this person's recordings {said}")
