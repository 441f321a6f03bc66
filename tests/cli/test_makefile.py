"""``make COHORT=study`` asks ``bsip run``, and shows the tables; a stand-in for bsip tells."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BSIP = """#!{python}
import json, os, sys
with open(os.environ["CALLS"], "a") as calls:
    calls.write(json.dumps(sys.argv[1:]) + "\\n")
sys.exit(int(os.environ["CODE"]) if sys.argv[1] == "run" else 0)
"""


@dataclass
class Cohort:
    """A folder with a study, and what the stand-in was called with."""

    folder: Path

    def make(
        self, *more: str, study: str = "study", code: int = 0
    ) -> subprocess.CompletedProcess[str]:
        calls = self.folder / "calls"
        calls.write_text("")
        environment = os.environ | {"CALLS": str(calls), "CODE": str(code), "MAKEFLAGS": ""}
        given = [f"COHORT={study}", f"BIN={self.folder / 'bin'}", "READY="]
        command = ["make", "-f", str(ROOT / "Makefile"), *given, *more]
        return subprocess.run(
            command, cwd=self.folder, env=environment, capture_output=True, text=True
        )

    def calls(self) -> list[list[str]]:
        return [json.loads(line) for line in (self.folder / "calls").read_text().splitlines()]


@pytest.fixture
def cohort(tmp_path) -> Cohort:
    (tmp_path / "bin").mkdir()
    program = tmp_path / "bin" / "bsip"
    program.write_text(BSIP.format(python=sys.executable))
    program.chmod(0o755)
    return Cohort(tmp_path)


def run_of(study: str, out: str, jobs: int = 2) -> list[str]:
    return ["run", study, "--out", out, "--jobs", str(jobs)]


def test_bsip_is_asked_each_time(cohort):
    for _ in range(2):
        assert cohort.make().returncode == 0
        assert cohort.calls() == [run_of("study", "study_results"), ["show", "study_results"]]


def test_as_many_jobs_as_make_was_given(cohort):
    cohort.make("-j", "5", "OUT=elsewhere")
    assert cohort.calls()[0] == run_of("study", "elsewhere", 5)
    cohort.make("JOBS=3")
    assert cohort.calls()[0] == run_of("study", "study_results", 3)


@pytest.mark.parametrize(
    "name", ["it's", "a;touch hacked", "$(touch hacked)", "$HOME", "`touch hacked`", 'a"b', "#"]
)
def test_odd_names_arrive_as_they_are(cohort, name):
    assert cohort.make(study=f"{name}/").returncode == 0
    assert cohort.calls()[0] == run_of(name, f"{name}_results")
    cohort.make(f"OUT={name}")
    assert cohort.calls()[0] == run_of("study", name)
    assert list(cohort.folder.rglob("hacked")) == []


def test_bad_data_of_some_are_no_failure_of_make(cohort):
    assert cohort.make(code=3).returncode == 0
    assert cohort.calls()[-1] == ["show", "study_results"]


@pytest.mark.parametrize("code", [1, 2, 4, 143])
def test_what_failed_fails(cohort, code):
    done = cohort.make(code=code)
    assert done.returncode != 0
    assert f"Error {code}" in done.stderr
    assert len(cohort.calls()) == 1
