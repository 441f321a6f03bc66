"""The Snakemake workflow beside ``make``: the same artifacts, and who fails stops nobody else."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import pytest

from bsip_cli.pipeline import STAGES
from bsip_cli.simulate.options import Rates, StudyOptions
from bsip_cli.simulate.study import simulate_study

ROOT = Path(__file__).parents[2]
INSTALLED = ROOT / ".venv-cluster" / "bin" / "snakemake"
SNAKEMAKE = str(INSTALLED) if INSTALLED.exists() else shutil.which("snakemake")
OWN_FILES = {".made", ".snakemake", ".lock"}
PERSONAL = list(dict.fromkeys(stage.name for stage in STAGES if stage.level != "cohort"))
STAND_IN = """#!/bin/sh
echo "$*" >> "$CALLS"
case "$*" in *"$FAILS"*) exit $CODE;; esac
"""

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(
        SNAKEMAKE is None, reason="Snakemake is not there; `make .venv-cluster/ready` installs it"
    ),
]


@dataclass
class Study:
    """A study of two people, its results, and the program that makes them."""

    folder: Path
    bsip: Path

    def snakemake(self, target: str, *options: str, **environment: str):
        command = [
            *(str(SNAKEMAKE), "--snakefile", str(ROOT / "workflow" / "Snakefile")),
            *("--profile", str(ROOT / "workflow" / "profiles" / "plain"), *options),
            *("--config", f"study={self.folder / 'study'}", f"out={self.folder / 'out'}"),
            *(f"bsip={self.bsip}", "--", target),
        ]
        return self.call(command, **environment)

    def call(self, command: list[str], **environment: str) -> subprocess.CompletedProcess:
        return subprocess.run(
            command,
            cwd=self.folder,
            env=os.environ | {"MAKEFLAGS": "", "XDG_CACHE_HOME": str(self.folder)} | environment,
            capture_output=True,
            text=True,
        )

    def content(self) -> dict[str, bytes]:
        """Every file of the results by its name, without what make and Snakemake keep."""
        out = self.folder / "out"
        names = (path.relative_to(out) for path in sorted(out.rglob("*")) if path.is_file())
        return {
            str(name): (out / name).read_bytes()
            for name in names
            if not OWN_FILES & set(name.parts)
        }


@pytest.fixture
def stand_in(tmp_path):
    """Two people without recordings, and a program that only notes how it is called."""
    for who in ("sub-01", "sub-02"):
        (tmp_path / "study" / who).mkdir(parents=True)
        (tmp_path / "study" / who / f"{who}_task-static.c3d").write_bytes(b"")
    (tmp_path / "study" / "participants.tsv").write_text(
        "participant_id\tsex\nsub-01\tM\nsub-02\tF\nsub-03; touch hacked\tF\n"
    )
    program = tmp_path / "bsip"
    program.write_text(STAND_IN)
    program.chmod(0o755)
    study = Study(tmp_path, program)
    calls = tmp_path / "calls"

    def run(target: str, fails: str = "nothing", code: int = 1) -> tuple[int, list[str]]:
        """Exit code, and the calls as command and participant in the order of the names."""
        calls.write_text("")
        done = study.snakemake(target, CALLS=str(calls), FAILS=fails, CODE=str(code))
        lines = [line.split() for line in calls.read_text().splitlines()]
        return done.returncode, sorted(f"{line[0]} {line[-1]}" for line in lines)

    return run


def everything_of(*people: str, until: str | None = None) -> list[str]:
    stages = PERSONAL[: PERSONAL.index(until) + 1] if until else PERSONAL
    return sorted(f"{stage} {who}" for stage in stages for who in people)


def test_every_stage_of_everybody_once_and_then_the_group(stand_in, tmp_path):
    assert stand_in("everybody") == (0, everything_of("sub-01", "sub-02"))
    assert stand_in("group") == (0, ["run --group"])
    assert stand_in("everybody") == (0, [])
    earlier = time.time() - 100
    for path in tmp_path.rglob("*"):
        os.utime(path, (earlier, earlier))
    (tmp_path / "study" / "sub-02" / "sub-02_task-static.c3d").touch()
    assert stand_in("everybody") == (0, everything_of("sub-02"))
    assert not (tmp_path / "hacked").exists()


def test_one_failure_stops_neither_the_others_nor_the_tables(stand_in):
    code, calls = stand_in("everybody", fails="sub-01")
    assert (code != 0, calls) == (True, sorted(["ingest sub-01", *everything_of("sub-02")]))
    assert stand_in("group") == (0, ["run --group"])
    assert stand_in("everybody") == (0, everything_of("sub-01"))
    assert stand_in("group") == (0, ["run --group"])


@pytest.mark.parametrize("code", [3, 4])
def test_a_refusal_is_no_failure(stand_in, code):
    assert stand_in("everybody", fails="sub-01", code=code)[0] == 0
    assert stand_in("everybody") == (0, [])


def test_the_same_artifacts_as_make(tmp_path):
    options = StudyOptions(
        participants=1,
        seed=3,
        sexes="M",
        tasks=("static", "sequence"),
        durations_s={"static": 1.0, "sequence": 10.0},
        rates={"default": Rates(marker_hz=50, analog_hz=250)},
    )
    simulate_study(tmp_path / "study", options)
    study = Study(tmp_path, tmp_path / "bin" / "bsip")
    study.bsip.parent.mkdir()
    study.bsip.write_text(f'#!/bin/sh\nexec {sys.executable} -m bsip_cli "$@"\n')
    study.bsip.chmod(0o755)
    out = tmp_path / "out"
    for target in ("everybody", "group"):
        done = study.snakemake(target)
        assert done.returncode == 0, done.stderr
    of_workflow = study.content()
    shutil.rmtree(out)
    made = ["make", "-f", str(ROOT / "Makefile"), "-j", "2", f"COHORT={tmp_path / 'study'}"]
    done = study.call([*made, f"OUT={out}", f"BIN={study.bsip.parent}", "READY="])
    assert done.returncode == 0, done.stderr
    of_make = study.content()
    assert "group/report.html" in of_make
    assert of_workflow.keys() == of_make.keys()
    assert [name for name in of_make if of_workflow[name] != of_make[name]] == []
