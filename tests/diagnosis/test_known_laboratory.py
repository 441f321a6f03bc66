"""What a person's recordings are corrected by that others have shown, and what their own show."""

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

SHIFT = tuple(Coordinate("plate_translation", "1", axis) for axis in "xyz")
TILT = Coordinate("plate_rotation", "1", "tilt_x")
TYPICAL_M = 0.02


def rows() -> pd.DataFrame:
    named = {"effect": "plate_translation", "target": "1", "unit": "m", "verdict": "named"}
    numbers = {"ci_low": 0.0, "ci_high": 0.1, "persons": 7, "probability": 0.99}
    return pd.DataFrame(
        [
            named | numbers | {"parameter": axis, "estimate": size}
            for axis, size in zip("xyz", (0.028, 0.0, 0.002), strict=True)
        ]
    )


def test_faults_that_offset_each_other_are_not_taken_off_one_by_one():
    """A height of the plate and its tilt are told together only: their sum, in typical sizes."""
    coordinates = (*SHIFT, TILT)
    mean = np.array([1.4, 0.0, -35.0, 35.1])
    together = 40.0 * np.array([[0.0, 0.0, 1.0, -1.0]]).T
    root = np.column_stack([0.1 * np.eye(4), together])
    known = Known(coordinates, mean, root, rows(), {})
    trial = SimpleNamespace(scene=moving(), name="a")
    (cause,) = known.causes([trial])
    parameters = SHIFT[0].effect, "1"
    assert (cause["effect"], cause["target"]) == parameters
    x, y, z = cause["values"]
    assert x == pytest.approx(1.4 * TYPICAL_M) and y == pytest.approx(0.0)
    assert z == pytest.approx(0.1 * TYPICAL_M, abs=0.05 * TYPICAL_M)


def test_an_offset_is_not_where_ingest_has_taken_it_off():
    scene = moving()
    zeroed = replace(scene, plates=tuple(replace(one, zeroed=True) for one in scene.plates))
    number = {"effect": "plate_zero", "target": "1 fx", "unit": "N", "verdict": "named"}
    row = number | {"parameter": "offset", "estimate": 9.0, "ci_low": 8.0, "ci_high": 10.0}
    table = pd.DataFrame([row | {"persons": 7, "probability": 0.99}])
    offset = Coordinate("plate_zero", "1 fx", "offset")
    known = Known((offset,), np.array([0.9]), 0.1 * np.eye(1), table, {})
    trials = [SimpleNamespace(scene=scene, name="a"), SimpleNamespace(scene=zeroed, name="b")]
    (cause,) = known.causes(trials)
    assert cause["trials"] == ["a"] and cause["values"] == pytest.approx([9.0])
    assert not list(known.findings(trials[1:]))


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
