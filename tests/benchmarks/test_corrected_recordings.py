"""When a hidden fault counts as corrected, and the corrected recording as free of it."""

from __future__ import annotations

import pytest

from benchmarks.corrected_recordings import (
    Case,
    Key,
    Result,
    corrected_in,
    in_order,
    summary,
    table,
)

GAIN = Case(5101, "plate_gain", 0.05, "fz,plate=2")
KEY = ("plate_gain", "2 fz")


@pytest.mark.parametrize(
    ("case", "key"),
    [
        (GAIN, KEY),
        (Case(1, "plate_crosstalk", 0.04, "fz:fy,plate=2"), ("plate_crosstalk", "2 fz>fy")),
        (Case(1, "plate_rotation", 0.06, "yaw,plate=1"), ("plate_rotation", "1")),
        (Case(1, "camera_frame", 0.02, "y"), ("camera_frame", "")),
        (Case(1, "sync_offset", 0.01, "-"), ("sync_offset", "")),
        (Case(1, "marker_swap", 2.0, "RUA+RELB"), ("marker_swap", "RELB+RUA")),
    ],
)
def test_a_fault_is_known_by_what_a_diagnosis_calls_it(case: Case, key: Key):
    assert case.key() == key


SAID = """\
export: a: corrected: plate_gain 2 fz: gain 5.0 % (95 % interval 4.5 to 5.5) taken off
export: a: corrected: plate_zero 1 mz: offset 2.0 N m taken off (as likely plate_zero 2 mz, with the same sum of forces)
export: a: corrected: plate 1: its reading without load, (0.1, 15.0, 0.2) N, subtracted
export: a: corrected: labels RUA and RELB exchanged from 1.000 to 2.000 s
export: a: not corrected: added_mass hand_r: no fault of the plates, the clocks, the axes or the labels
"""  # noqa: E501


def test_what_was_corrected_is_read_off_what_export_says():
    corrected, alike = corrected_in(SAID)
    assert corrected == {KEY, ("plate_zero", "1 mz"), ("marker_swap", "RELB+RUA")}
    assert alike == {("plate_zero", "2 mz")}


def result(corrected: set[Key], after: set[Key]) -> Result:
    return Result({KEY: ""}, frozenset(corrected), frozenset(), dict.fromkeys(after, ""), (9.0, 0))


@pytest.mark.parametrize(
    ("corrected", "after", "still", "free"),
    [
        ({KEY}, {("none", "")}, "", "yes"),
        ({KEY}, {KEY}, "plate_gain 2 fz", "no"),
        ({KEY}, {("sync_offset", "")}, "", "no"),
        ({("plate_gain", "1 fz")}, {("none", "")}, "", "not corrected"),
    ],
)
def test_free_is_what_is_told_of_nothing_taken_off_and_of_nothing_new(
    corrected, after, still, free
):
    (row,) = table({GAIN: result(corrected, after)})
    assert row[4:6] == (still, free)


def test_a_case_that_ran_again_replaces_its_row():
    rows = table({GAIN: result({KEY}, {KEY})}) + table({GAIN: result({KEY}, {("none", "")})})
    assert in_order(rows) == [rows[1]]
    assert summary(rows).startswith("2 of 2 faults were named and corrected; 1 are told")
