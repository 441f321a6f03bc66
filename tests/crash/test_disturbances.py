"""A few disturbances of ``disturbances.py``, which makes hundreds: nothing is lost or left."""

from __future__ import annotations

import os
import random
import subprocess
import sys

import pytest

from tests.crash import faults
from tests.crash.bench import Bench
from tests.crash.disturbances import disturbed, fault_rounds, signal_rounds

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
    (tmp_path / "artifacts").mkdir()
    (tmp_path / "trace").touch()
    environment = faults.environment(
        faults.compiled(tmp_path), tmp_path / "artifacts", tmp_path / "trace", faults.NONE
    )
    done = subprocess.run(
        [sys.executable, "-m", "tests.crash.every_call", what, str(tmp_path / "artifacts")],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 4 * 5  # open, read and their like, in each of four ways


@needs_shim
@pytest.mark.long
def test_calls_that_fail_lose_nothing(tmp_path, chance):
    rounds = fault_rounds(tmp_path, chance, ("ingest",))
    reading = [one for one in rounds if ".c3d" in one.name and one.kind == "read fails"]
    chosen = [*rounds[:: len(rounds) // 8], *reading[-1:]]
    hits, wrong = disturbed(chosen, tmp_path, jobs=1)
    assert wrong == []
    assert hits.total() == len(chosen)


@needs_proc
@pytest.mark.long
def test_signals_lose_and_leave_nothing(tmp_path, chance):
    hits, wrong = disturbed(signal_rounds(tmp_path, chance, count=5), tmp_path, jobs=1)
    assert wrong == []
    assert hits.total() > 0


def test_what_is_not_whole_is_noticed(tmp_path):
    out = tmp_path / "out"
    (out / "sub-01").mkdir(parents=True)
    (out / "sub-01" / "sub-01_person.parquet").write_bytes(b"PAR1, and cut")
    (out / "sub-01" / "report.html").write_bytes(b"<html>")
    bench = Bench(tmp_path, ("ingest",), tmp_path, {"sub-01/report.html": b"<html></html>"})
    broken = "\n".join(bench.broken_left(out))
    assert "sub-01_person.parquet is there, which no run makes" in broken
    assert "sub-01_person.parquet: is not an artifact" in broken
    assert "report.html is cut" in broken
    assert bench.others(out) == ["sub-01/report.html", "sub-01/sub-01_person.parquet"]
