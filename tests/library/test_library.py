"""The stages on arrays, and what is said of arrays that do not fit."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import bsip_cli as bsip
from bsip_cli.errors import BadDataError, UsageError
from bsip_cli.recordings.read import read_recording

SAMPLE = Path(__file__).parents[2] / "sample_data" / "sub-01"
OPTIONS = {"marker_set": "hansen2017"}


def trials() -> dict[str, Path]:
    names = {"static": "static", "squat": "squat_run-1"}
    return {name: SAMPLE / f"sub-01_task-{end}.c3d" for name, end in names.items()}


def from_arrays(path: Path):
    """The recording that a reader makes of a file, handed over as arrays."""
    known = read_recording(path)
    plates = [
        bsip.Plate(np.where(one.usable[:, None], one.force_N, np.nan), one.moment_Nm, one.corners_m)
        for one in known.plates
    ]
    return bsip.recording(
        known.labels, known.markers_m, known.marker_rate_hz, plates, known.analog_rate_hz
    )


def test_arrays_are_as_good_as_files():
    read = {name: bsip.read(path) for name, path in trials().items()}
    handed = {name: from_arrays(path) for name, path in trials().items()}
    files, arrays = (
        bsip.Person(given, sex="M", mass_kg=74.5, height_m=1.71, options=OPTIONS)
        for given in (read, handed)
    )
    expected, found = files.solve()["squat"], arrays.solve()["squat"]
    coordinates = [name for name in expected if name.startswith("q_")]
    np.testing.assert_allclose(found[coordinates], expected[coordinates], atol=1e-9)
    wrench = ["fx_N", "fy_N", "fz_N", "mx_Nm", "my_Nm", "mz_Nm"]
    np.testing.assert_allclose(
        arrays.table("wrench", "squat")[wrench], files.table("wrench", "squat")[wrench], atol=1e-6
    )
    assert not arrays.refused


def test_a_trial_that_cannot_be_used_does_not_stop_the_others():
    static, squat = (bsip.read(path) for path in trials().values())
    unnamed = bsip.recording([f"M{k}" for k in range(20)], np.zeros((50, 20, 3)), 100.0)
    person = bsip.Person(
        {"static": static, "squat": squat, "odd": unnamed}, mass_kg=74.5, options=OPTIONS
    )
    assert set(person.solve()) == {"static", "squat"}
    assert ("ingest", "odd") in person.refused


def test_without_a_usable_recording_the_person_is_refused():
    unnamed = bsip.recording([f"M{k}" for k in range(20)], np.zeros((50, 20, 3)), 100.0)
    person = bsip.Person({"static": unnamed}, mass_kg=74.5, options=OPTIONS)
    with pytest.raises(BadDataError):
        person.scale()


@pytest.mark.parametrize(
    ("make", "found"),
    [
        (lambda: bsip.recording(["A"], np.zeros((5, 2, 3)), 100.0), "markers of shape (5, 2, 3)"),
        (
            lambda: bsip.recording(["A"], np.zeros((5, 1, 3)), 100.0, (), 150.0),
            "plates at 150 Hz, markers at 100 Hz",
        ),
        (
            lambda: bsip.recording(
                ["A"],
                np.zeros((5, 1, 3)),
                100.0,
                [bsip.Plate(np.zeros((4, 3)), np.zeros((5, 3)), np.zeros((4, 3)))],
            ),
            "plate 1: forces, moments and corners of shapes",
        ),
        (lambda: bsip.Person({}, sex="x"), "sex 'x'"),
        (lambda: bsip.Person({"a b": None}), "a trial 'a b'"),
        (lambda: bsip.Person({}, options={"marker_st": "x"}), "unknown option marker_st"),
    ],
)
def test_what_does_not_fit_is_told(make, found):
    with pytest.raises(UsageError) as told:
        make()
    assert found in str(told.value)


def test_nothing_is_loaded_before_it_is_asked_for():
    asked = "import sys, bsip_cli; print({'pandas', 'pinocchio'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
