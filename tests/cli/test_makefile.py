"""``make COHORT=study``: participants one by one, then the tables; a stand-in for bsip tells."""

from __future__ import annotations

import os
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BSIP = """#!/bin/sh
echo "$@" >> "$CALLS"
case "$*" in *"$FAILS"*) exit ${CODE:-0};; esac
"""


@dataclass
class Cohort:
    """Three people, and what the stand-in was called with."""

    folder: Path

    def make(self, *more: str, fails: str = "nobody", code: int = 1) -> subprocess.CompletedProcess:
        environment = os.environ | {
            "CALLS": str(self.folder / "calls"),
            "FAILS": f"--participant {fails}",
            "CODE": str(code),
            "MAKEFLAGS": "",
        }
        (self.folder / "calls").write_text("")
        given = [f"COHORT={self.folder / 'study'}", f"BIN={self.folder / 'bin'}", "READY="]
        command = ["make", "-f", str(ROOT / "Makefile"), *given, *more]
        return subprocess.run(
            command, cwd=self.folder, env=environment, capture_output=True, text=True
        )

    def calls(self) -> list[str]:
        """Command and participant of every call, in order."""
        lines = (self.folder / "calls").read_text().splitlines()
        return [f"{line.split()[0]} {Path(line.split()[-1]).name}" for line in lines]


@pytest.fixture
def cohort(tmp_path) -> Cohort:
    study = tmp_path / "study"
    rows = [f"sub-0{k}\tM\t70\tn/a" for k in (1, 2, 3)]
    for k in (1, 2, 3):
        (study / f"sub-0{k}").mkdir(parents=True)
        (study / f"sub-0{k}" / f"sub-0{k}_task-static.c3d").write_bytes(b"")
    (study / "participants.tsv").write_text("\n".join(["participant_id\tsex", *rows]) + "\n")
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "bsip").write_text(BSIP)
    (tmp_path / "bin" / "bsip").chmod(0o755)
    return Cohort(tmp_path)


GROUP = ["run --group", "show study_results"]
EVERYBODY = [f"run sub-0{k}" for k in (1, 2, 3)]


def test_everybody_and_then_the_tables(cohort):
    done = cohort.make()
    assert done.returncode == 0, done.stderr
    assert cohort.calls() == [*EVERYBODY, *GROUP]


def test_only_what_changed_is_done_again(cohort):
    cohort.make()
    cohort.make()
    assert cohort.calls() == ["show study_results"]
    recording = cohort.folder / "study" / "sub-02" / "sub-02_task-static.c3d"
    later = recording.stat().st_mtime + 100
    os.utime(recording, (later, later))
    cohort.make()
    assert cohort.calls() == ["run sub-02", *GROUP]


def test_odd_names_do_no_harm(cohort):
    study = cohort.folder / "study"
    (study / "sub-01" / "notes $(touch hacked).c3d").write_bytes(b"")
    with (study / "participants.tsv").open("a") as table:
        table.write("sub-09; touch hacked\tM\nsub-$(touch hacked)\tM\n")
    assert cohort.make().returncode == 0
    assert cohort.calls() == [*EVERYBODY, *GROUP]
    assert list(cohort.folder.rglob("hacked")) == []


def test_several_at_once_and_a_dry_run(cohort):
    said = cohort.make("-n").stdout
    assert all(f"--participant sub-0{k}" in said for k in (1, 2, 3))
    assert cohort.calls() == []
    assert cohort.make("-j", "3").returncode == 0
    assert sorted(cohort.calls()[:3]) == EVERYBODY


def test_one_failure_stops_neither_the_others_nor_the_tables(cohort):
    done = cohort.make(fails="sub-02")
    assert cohort.calls() == [*EVERYBODY, *GROUP]
    assert done.returncode != 0
    assert "make: sub-02 failed (1)" in done.stderr
    assert "make: not done: sub-02; read what bsip said" in done.stderr
    cohort.make()
    assert cohort.calls() == ["run sub-02", *GROUP]  # tried again, alone


def test_bad_data_are_done_until_they_change(cohort):
    assert cohort.make(fails="sub-02", code=3).returncode == 0
    cohort.make()
    assert cohort.calls() == ["show study_results"]
