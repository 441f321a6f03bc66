"""The Snakemake workflow: each call asks bsip for everybody, and leaves what ``make`` leaves."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from bsip_cli.simulate.study import simulate_study
from tests.small_study import small

ROOT = Path(__file__).parents[2]
INSTALLED = ROOT / ".venv-cluster" / "bin" / "snakemake"
SNAKEMAKE = str(INSTALLED) if INSTALLED.exists() else shutil.which("snakemake")
OWN_FILES = {".made", ".snakemake", ".lock", ".fingerprints.json"}
PEOPLE = "participant_id\tsex\tmass_kg\nsub-01\tM\t70\nsub-02\tF\t60\n"
# Lists people as bsip does; else notes its arguments, and fails where it is asked for FAILS.
STAND_IN = """#!{python}
import json, os, sys
if sys.argv[1] == "people":
    os.execv(sys.executable, [sys.executable, "-m", "bsip_cli", *sys.argv[1:]])
with open(os.environ["CALLS"], "a") as calls:
    calls.write(json.dumps(sys.argv[1:]) + "\\n")
sys.exit(int(os.environ["CODE"]) if os.environ["FAILS"] in sys.argv else 0)
"""

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(
        SNAKEMAKE is None, reason="Snakemake is not there; `make .venv-cluster/ready` installs it"
    ),
]


@dataclass
class Place:
    """A folder with a study in it, and the program that is to stand for bsip.

    told : its calls for what each participant tells of the laboratory.
    """

    folder: Path
    told: list[list[str]] = field(default_factory=list)

    @property
    def bsip(self) -> Path:
        return self.folder / "bin" / "bsip"

    def install(self, program: str) -> None:
        self.bsip.parent.mkdir()
        self.bsip.write_text(program)
        self.bsip.chmod(0o755)
        (self.folder / "bin" / "snakemake").symlink_to(str(SNAKEMAKE))
        (self.folder / "workflow").symlink_to(ROOT / "workflow")

    def snakemake(self, study: str = "study", out: str = "out", **environment: str):
        command = [
            *(str(SNAKEMAKE), "--snakefile", "workflow/Snakefile"),
            *("--profile", "workflow/profiles/plain", "--", "everybody"),
        ]
        return self.call(
            command, BSIP=str(self.bsip), BSIP_STUDY=study, BSIP_OUT=out, **environment
        )

    def make(self, *given: str, **environment: str):
        there = ("BIN=bin", "READY=", "CLUSTER=.", "-o", "./ready")
        return self.call(["make", "-f", str(ROOT / "Makefile"), *there, *given], **environment)

    def call(self, command: list[str], **environment: str) -> subprocess.CompletedProcess[str]:
        own = {
            "MAKEFLAGS": "",
            "XDG_CACHE_HOME": str(self.folder / "cache"),
            "PYTHONPATH": str(ROOT),
            "CALLS": str(self.folder / "calls"),
            "FAILS": "nobody",
            "CODE": "1",
        }
        return subprocess.run(
            command,
            cwd=self.folder,
            env=os.environ | own | environment,
            capture_output=True,
            text=True,
        )

    def calls(self) -> list[list[str]]:
        """What the stand-in was asked since this was last asked, the participants' calls sorted;
        without those for the laboratory, which it makes sure are the first and end by its sum."""
        notes = self.folder / "calls"
        lines = notes.read_text().splitlines() if notes.exists() else []
        notes.unlink(missing_ok=True)
        found = [json.loads(line) for line in lines]
        first = [c for c in found if "--until" in c]
        assert found[: len(first)] == first
        assert ["--group" in c for c in first] == [False] * (len(first) - 1) + [True] * bool(first)
        self.told, found = first[:-1], found[len(first) :]
        return sorted(c for c in found if "--participant" in c) + [
            c for c in found if "--participant" not in c
        ]

    def content(self) -> dict[str, bytes]:
        """Every file of the results by its name, without what is kept for the next call."""
        out = self.folder / "out"
        names = (path.relative_to(out) for path in sorted(out.rglob("*")) if path.is_file())
        return {
            str(name): (out / name).read_bytes()
            for name in names
            if not OWN_FILES & set(name.parts)
        }


def asked(*people: str, study: str = "study", out: str = "out") -> list[list[str]]:
    return [["run", study, "--out", out, "--participant", who] for who in people]


@pytest.fixture
def place(tmp_path) -> Place:
    place = Place(tmp_path)
    place.install(STAND_IN.format(python=sys.executable))
    (tmp_path / "study" / "sub-02").mkdir(parents=True)
    (tmp_path / "study" / "participants.tsv").write_text(PEOPLE)
    return place


def test_everybody_is_asked_at_each_call(place):
    """Also when a recording comes that is older than everything there."""
    for _ in range(2):
        assert place.snakemake().returncode == 0
        assert place.calls() == asked("sub-01", "sub-02")
    older = place.folder / "study" / "sub-02" / "sub-02_task-static.c3d"
    older.write_bytes(b"")
    os.utime(older, (0, 0))
    assert place.snakemake().returncode == 0
    assert place.calls() == asked("sub-01", "sub-02")


def test_the_laboratory_is_summed_once_all_have_told_of_it(place):
    assert place.snakemake().returncode == 0
    place.calls()
    assert sorted(place.told) == [
        [*call, "--until", "laboratory"] for call in asked("sub-01", "sub-02")
    ]


def test_one_failure_stops_nobody_and_fails_the_whole(place):
    """What they tell of the laboratory is asked twice."""
    assert place.snakemake(FAILS="sub-01").returncode != 0
    assert place.calls() == asked("sub-01", "sub-02")
    assert sorted(place.told) == [
        [*call, "--until", "laboratory"] for call in asked("sub-01", "sub-01", "sub-02")
    ]
    assert place.snakemake().returncode == 0


@pytest.mark.parametrize("code", [3, 4])
def test_a_refusal_is_no_failure(place, code):
    assert place.snakemake(FAILS="sub-01", CODE=str(code)).returncode == 0


@pytest.mark.parametrize(
    "table",
    [
        'participant_id\tsex\tmass_kg\n"sub-01"\tM\t70\n"sub-02"\tF\t60\n',
        "age\tmass_kg\tsex\tparticipant_id\n30\t70\tM\tsub-01\n\t60\tF\tsub-02\n",
        "participant_id\tsex\tmass_kg\nsub-01\t\t\n\t\t\n sub-02 \tF\t60\n",
        PEOPLE.replace("\n", "\r\n"),
        "\ufeff" + PEOPLE + "sub-03; touch hacked\tF\t60\nsub-01\tM\t70\n",
    ],
    ids=["quoted", "other order", "blank cells", "CRLF", "impossible and twice"],
)
def test_people_are_those_whom_bsip_reads(place, table):
    (place.folder / "study" / "participants.tsv").write_bytes(table.encode())
    assert place.snakemake().returncode == 0
    assert place.calls() == asked("sub-01", "sub-02")
    assert list(place.folder.rglob("hacked")) == []


def test_what_cannot_be_read_is_refused_in_words(place):
    done = place.snakemake(study="elsewhere")
    assert done.returncode != 0
    assert "bsip: elsewhere/participants.tsv: " in done.stderr
    assert "bsip cannot list the participants of 'elsewhere'" in done.stderr
    done = place.snakemake(out="a{b}")
    assert done.returncode != 0
    assert "'a{b}': Snakemake takes braces for wildcards" in done.stderr
    place.bsip.unlink()
    done = place.snakemake()
    assert done.returncode != 0
    assert "cannot be started (No such file or directory)" in done.stderr
    assert place.calls() == []


@pytest.mark.parametrize(
    "name",
    ["two words", "it's; touch hacked", "$(touch hacked) `touch hacked` $HOME", "007", "a: #b\"'"],
)
def test_make_cluster_with_odd_names(place, name):
    shutil.move(place.folder / "study", place.folder / name)
    done = place.make("cluster", f"COHORT={name}/")
    assert done.returncode == 0, done.stderr
    out = f"{name}_results"
    assert place.calls() == [
        *asked("sub-01", "sub-02", study=name, out=out),
        ["run", name, "--out", out, "--group"],
        ["show", out],
    ]
    assert list(place.folder.rglob("hacked")) == []


def test_make_cluster_fails_with_one_after_the_tables_of_the_others(place):
    done = place.make("cluster", "COHORT=study", "OUT=out", FAILS="sub-01")
    assert done.returncode != 0
    group = ["run", "study", "--out", "out", "--group"]
    assert place.calls() == [*asked("sub-01", "sub-02"), group, ["show", "out"]]
    done = place.make("cluster", "COHORT=study", "OUT=out", FAILS="--group", CODE="2")
    assert done.returncode != 0
    assert place.calls() == [*asked("sub-01", "sub-02"), group]


def test_the_same_artifacts_as_make(tmp_path):
    simulate_study(tmp_path / "study", small("MM", static=1.0, sequence=10.0))
    place = Place(tmp_path)
    place.install(f'#!/bin/sh\nexec {sys.executable} -m bsip_cli "$@"\n')
    given = ("COHORT=study", "OUT=out")
    done = place.make("cluster", *given)
    assert done.returncode == 0, done.stderr
    of_workflow = place.content()
    done = place.make("cluster", *given)
    assert done.returncode == 0, done.stderr
    assert place.content() == of_workflow
    shutil.rmtree(tmp_path / "out")
    done = place.make("study", *given)
    assert done.returncode == 0, done.stderr
    of_make = place.content()
    assert "group/report.html" in of_make
    assert of_workflow.keys() == of_make.keys()
    assert [name for name in of_make if of_workflow[name] != of_make[name]] == []
