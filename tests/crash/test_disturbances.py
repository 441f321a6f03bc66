"""A few disturbances of ``disturbances.py``, which makes hundreds: nothing is lost or left."""

from __future__ import annotations

import random
import subprocess
import sys

import pytest

from bsip_cli.running.processes import ENDING
from tests.crash import faults
from tests.crash.bench import Bench, by_processes
from tests.crash.disturbances import disturbed, fault_rounds, signal_rounds
from tests.crash.every_call import every_call

needs_shim = pytest.mark.skipif(
    sys.platform != "linux" or faults.compiler() is None,
    reason="calls fail by a library for Linux that a C compiler (cc) makes",
)
needs_proc = pytest.mark.skipif(sys.platform != "linux", reason="processes are looked up in /proc")


@pytest.fixture(scope="module")
def chance():
    return random.Random(7)


@needs_shim
@pytest.mark.parametrize("what", ["write", "read"])
def test_every_call_of_an_artifact_fails_in_turn(tmp_path, what):
    """What is under the final name is the old or the new artifact, and nothing lies beside it."""
    counts, wrong = every_call(what, tmp_path / what, seed=7)
    assert wrong == []
    assert counts.total() > 4 * 5  # open, read and their like, in each of four ways


@needs_shim
@pytest.mark.long
def test_calls_that_fail_lose_nothing(tmp_path, chance):
    rounds = fault_rounds(tmp_path, chance, ("ingest",))
    hits, wrong = disturbed(rounds[:: len(rounds) // 5], tmp_path, jobs=1)
    assert wrong == []
    assert hits.total() >= 5


@needs_shim
@pytest.mark.long
def test_every_call_of_a_stage_fails_in_turn(tmp_path):
    counts, wrong = every_call("regress", tmp_path / "regress", seed=7)
    assert wrong == []
    assert {"open", "read", "pread", "write", "fsync", "rename"} <= counts.keys()


@needs_proc
@pytest.mark.long
def test_signals_lose_and_leave_nothing(tmp_path, chance):
    hits, wrong = disturbed(signal_rounds(tmp_path, chance, count=5), tmp_path, jobs=1)
    assert wrong == []
    assert hits.total() > 0


@pytest.mark.parametrize("ending", ENDING)
def test_a_signal_while_python_ends_changes_nothing(ending):
    command = [sys.executable, "-m", "bsip_cli", "info"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None
    said = process.stdout.read()  # to its end, which bsip closes as its last act
    process.send_signal(ending)
    assert process.wait() == 0 and process.stderr.read() == ""
    assert said


def test_what_is_not_whole_is_noticed(tmp_path):
    out = tmp_path / "out"
    (out / "sub-01").mkdir(parents=True)
    (out / "sub-01" / "sub-01_person.parquet").write_bytes(b"PAR1, and cut")
    (out / "sub-01" / "report.html").write_bytes(b"<html>")
    whole = {"sub-01/report.html": b"<html></html>"}
    bench = Bench(tmp_path, ("ingest",), tmp_path, whole, by_processes)
    broken = "\n".join(bench.broken_left(out))
    assert "sub-01_person.parquet is there, which no run makes" in broken
    assert "sub-01_person.parquet: is not an artifact" in broken
    assert "report.html is cut" in broken
    assert bench.others(out) == ["sub-01/report.html", "sub-01/sub-01_person.parquet"]
