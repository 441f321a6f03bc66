"""What a person's recordings are corrected by that other persons have shown."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from bsip_cli.diagnosis.shared_faults import Coordinate
from bsip_cli.stages.known_laboratory import Known
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
    known = Known(coordinates, mean, root, rows())
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
    known = Known((offset,), np.array([0.9]), 0.1 * np.eye(1), table)
    trials = [SimpleNamespace(scene=scene, name="a"), SimpleNamespace(scene=zeroed, name="b")]
    (cause,) = known.causes(trials)
    assert cause["trials"] == ["a"] and cause["values"] == pytest.approx([9.0])
    assert not list(known.findings(trials[1:]))
