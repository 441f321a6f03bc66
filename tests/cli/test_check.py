"""`bsip check` says what every recording is taken for, and keeps nothing."""

from __future__ import annotations

import shutil
from pathlib import Path

import ezc3d
import pytest

from tests.cli.conftest import write_table
from tests.fuzz.fuzz_study import _write_trc_mot

SAMPLE = Path(__file__).parents[2] / "sample_data"


@pytest.fixture
def study(tmp_path) -> Path:
    """A sound static trial and a movement."""
    folder = tmp_path / "study" / "sub-01"
    folder.mkdir(parents=True)
    for name in ("static", "squat_run-1"):
        shutil.copy(SAMPLE / "sub-01" / f"sub-01_task-{name}.c3d", folder)
    write_table(tmp_path / "study", "sub-01\tM\tn/a\tn/a")
    return tmp_path / "study"


def test_says_what_each_recording_is(bsip, study):
    (study / "sub-01" / "sub-01_task-steps.c3d").write_bytes(b"")
    before = sorted(study.rglob("*"))
    answer = bsip("check", study)
    assert answer.code == 3
    head, *lines = answer.out.splitlines()
    assert head == "sub-01: man, mass not stated, height not stated"
    squat, static, empty = lines
    said = "50 Hz, 38 markers (hansen2017), 1 plate, every contact measured for 3.4 s"
    assert "squat_run-1.c3d " in squat and said in squat
    assert "static.c3d " in static and " static " in static
    assert "steps.c3d " in empty and "refused" in empty
    assert "sub-01_task-steps.c3d" in answer.err and answer.summary.startswith("bsip check: 4 done")
    assert sorted(study.rglob("*")) == before


def test_no_person_is_said_before_anything_is_computed(bsip, study):
    """Knee and ankle exchanged in all recordings: each is read well."""
    for path in (study / "sub-01").glob("*.c3d"):
        content = ezc3d.c3d(str(path))
        labels = content["parameters"]["POINT"]["LABELS"]["value"]
        one, other = labels.index("RKNEL"), labels.index("RMALL")
        labels[one], labels[other] = labels[other], labels[one]
        content.write(str(path))
    answer = bsip("check", study)
    assert answer.code == 3 and answer.summary == "bsip check: 3 done, 1 refused"
    assert "scale: sub-01: is this a person? the right shank is " in answer.err


def test_a_study_that_is_none(bsip, tmp_path):
    answer = bsip("check", tmp_path / "nowhere")
    assert answer.code in (2, 3) and "nowhere" in answer.err


def test_a_recording_under_two_names_is_said(bsip, study):
    folder = study / "sub-01"
    sound = bsip("check", study).err
    assert "is a copy of" not in sound and "has the forces of" not in sound
    shutil.copy(folder / "sub-01_task-squat_run-1.c3d", folder / "sub-01_task-squat_run-2.c3d")
    answer = bsip("check", study)
    said = "sub-01_task-squat_run-2.c3d is a copy of sub-01_task-squat_run-1.c3d"
    assert answer.code == 0 and said in answer.err


def test_a_recording_exported_again_is_said(bsip, study):
    folder = study / "sub-01"
    _write_trc_mot(folder / "sub-01_task-squat_run-1.c3d", folder / "sub-01_task-filtered")
    said = "sub-01_task-squat_run-1 has the forces of sub-01_task-filtered, or of a part of it"
    assert f"{said}, and moves alike" in bsip("check", study).err


def test_forces_of_another_trial_are_said(bsip, study):
    """A squat played backwards with the forces of the one played forwards."""
    folder = study / "sub-01"
    _write_trc_mot(folder / "sub-01_task-squat_run-1.c3d", folder / "sub-01_task-squat_run-2")
    trc = folder / "sub-01_task-squat_run-2.trc"
    lines = trc.read_text().splitlines()
    first = next(k for k, line in enumerate(lines) if line.startswith("1\t"))
    rows = [line.split("\t", 2) for line in lines[first:] if line]
    backwards = [
        "\t".join([*row[:2], other[2]]) for row, other in zip(rows, rows[::-1], strict=True)
    ]
    trc.write_text("\n".join([*lines[:first], *backwards]) + "\n")
    answer = bsip("check", study)
    assert "its forces are those of sub-01_task-squat_run-1 too" in answer.err
    assert "50 Hz, 38 markers (hansen2017), no forces" in answer.out.splitlines()[2]
