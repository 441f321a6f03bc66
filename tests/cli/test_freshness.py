"""What counts as up to date: code, tables, options and bytes, not times; and what is said of it.

On a study that is done as far as `regress`; what needs a whole run is in test_small_study.py.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pyarrow.parquet as pq
import pytest

from bsip_cli.files import fingerprints
from bsip_cli.pipeline import STAGES
from bsip_cli.running.unit import imported_by
from bsip_cli.simulate.study import simulate_study
from tests.small_study import Run, small

ROOT = Path(__file__).parents[2]
DONE = ("ingest", "scale", "regress")
OPTIONS = small("MF", static=1.0)
HASHES = """
import json
from bsip_cli.running.unit import code_hash
from bsip_cli.pipeline import STAGES
print(json.dumps({stage.label: code_hash(stage.module) for stage in STAGES}))
"""
LOADED = """
import importlib, json, sys
from bsip_cli.pipeline import STAGES
loaded = {}
for stage in STAGES:
    for name in [name for name in sys.modules if name.split(".")[0] == "bsip_cli"]:
        del sys.modules[name]
    importlib.import_module(stage.module)
    loaded[stage.module] = [name for name in sys.modules if name.split(".")[0] == "bsip_cli"]
print(json.dumps(loaded))
"""


class Done(Run):
    """As far as `regress`."""

    def recording(self, who: str) -> Path:
        return self.study / who / f"{who}_task-static.c3d"

    def memory(self) -> Path:
        return self.out / "sub-01" / fingerprints.NAME


@pytest.fixture(scope="module")
def first(tmp_path_factory) -> Done:
    """Made once; nobody changes it."""
    done = Done.within(tmp_path_factory.mktemp("fresh"))
    simulate_study(done.study, OPTIONS)
    for stage in DONE:
        done.done(stage)
    return done


@pytest.fixture
def done(first, tmp_path) -> Done:
    """A copy to change."""
    return first.copied_to(tmp_path)


# --- code and tables ----------------------------------------------------------------------------


@pytest.fixture
def copy_of_bsip(tmp_path) -> Path:
    for part in ("bsip_cli", "configs"):
        left = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / part, tmp_path / "code" / part, ignore=left)
    return tmp_path / "code"


def run_python(code: Path, *arguments: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *map(str, arguments)],
        cwd=code,
        env=os.environ | {"PYTHONPATH": str(code)},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture(scope="module")
def before() -> dict[str, str]:
    return hashes(ROOT)


def hashes(code: Path) -> dict[str, str]:
    return json.loads(run_python(code, "-c", HASHES).stdout)


@pytest.mark.parametrize(
    ("file", "must", "must_not"),
    [
        ("bsip_cli/stages/regress.py", {"regress"}, {"ingest", "identify", "stats"}),
        ("bsip_cli/running/unit.py", {stage.name for stage in STAGES}, set()),
        ("bsip_cli/body/tables/dumas2007.csv", {"regress", "scale"}, {"stats", "tables"}),
        ("configs/markersets/plugin_gait.toml", {"ingest"}, {"stats", "regress"}),
        ("bsip_cli/commands/export.py", set(), {stage.name for stage in STAGES}),
        ("configs/default.toml", set(), {stage.name for stage in STAGES}),
    ],
)
def test_hash_is_of_what_a_stage_imports_and_reads(copy_of_bsip, before, file, must, must_not):
    with (copy_of_bsip / file).open("a") as text:
        text.write("# another line\n")
    now = hashes(copy_of_bsip)
    changed = {label.split()[0] for label in before if before[label] != now[label]}
    assert must <= changed
    assert not must_not & changed


def test_hash_covers_every_module_that_is_loaded():
    answer = run_python(ROOT, "-c", LOADED)
    assert answer.returncode == 0, answer.stderr
    loaded = json.loads(answer.stdout)
    missed = {module: set(names) - imported_by(module) for module, names in loaded.items()}
    assert missed == {stage.module: set() for stage in STAGES}


def test_heavier_thighs_in_a_table_make_other_results(done, copy_of_bsip):
    table = copy_of_bsip / "bsip_cli" / "body" / "tables" / "dumas2007.csv"
    rows = pd.read_csv(table, comment="#")
    rows.loc[rows["segment"].str.contains("thigh"), "mass_percent"] *= 1.2
    rows.to_csv(table, index=False)
    before = pd.read_parquet(done.path("regression"))
    call = ("-m", "bsip_cli", "regress", done.study, "--out", done.out)
    answer = run_python(copy_of_bsip, *call)
    assert answer.returncode == 0, answer.stderr
    assert "bsip regress: 2 done;" in answer.stderr
    because = "is not up to date (the code or a shipped table has changed); `bsip run` brings"
    assert answer.stderr.count(because) == 2  # what regress reads is of the old table, too
    assert not pd.read_parquet(done.path("regression")).equals(before)
    assert "bsip regress: 2 up to date;" in run_python(copy_of_bsip, *call).stderr


# --- artifacts ----------------------------------------------------------------------------------


def flip_a_bit(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 8] ^= 1  # in the data, not in what the file says of itself
    path.write_bytes(content)


def rewrite(path: Path) -> None:
    """As any program may that keeps what the file says of itself."""
    table = pq.read_table(path)
    heavier = table.to_pandas()
    heavier.loc[0, "mass_kg"] += 1.0
    new = table.from_pandas(heavier, preserve_index=False).cast(table.schema)
    pq.write_table(new.replace_schema_metadata(table.schema.metadata), path)


@pytest.mark.parametrize(
    ("change", "found"),
    [(flip_a_bit, "has changed since bsip wrote it"), (rewrite, "has no seal of bsip")],
)
def test_artifact_changed_by_hand_is_made_again(done, change, found):
    path = done.path("regression")
    content, times = path.read_bytes(), path.stat()
    change(path)
    os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))
    assert path.read_bytes() != content
    answer = done.call("regress")
    assert answer.err.splitlines()[0] == f"regress: {path.name} {found}: made again"
    assert answer.summary.startswith("bsip regress: 1 done, 1 up to date;")
    assert path.read_bytes() == content


def test_older_recording_is_another_recording(done):
    """Of the same size, too. The session is read anew, then the trial."""
    path = done.recording("sub-01")
    size = path.stat().st_size
    shutil.copy(done.recording("sub-02"), path)
    os.truncate(path, size)
    os.utime(path, (0, 0))
    assert done.call("ingest").summary.startswith("bsip ingest: 2 done, 2 up to date;")


def test_a_stage_alone_says_what_is_stale_before_it(done, tmp_path):
    own = tmp_path / "own.toml"
    own.write_text('[roles]\nstatic = ["static", "standing"]\n')
    answer = done.call("regress", "--config", own)
    assert answer.code == 0
    assert answer.err.splitlines()[:2] == [
        f"regress: {who}: what `bsip scale` made of {it} is not up to date "
        "(other options (roles)); `bsip run` brings it up to date"
        for who, it in (("sub-01", "sub-01"), ("the same of sub-02", "it"))
    ]
    assert "regress: " not in done.call("regress").err.replace("bsip regress: ", "")


# --- what is kept of files between runs ---------------------------------------------------------


def test_verify_finds_what_a_forged_memory_hides(done):
    """Somebody edits an artifact and writes its new times beside the old hash."""
    path = done.path("regression")
    done.done("regress")  # the copy's own inodes are known now
    content = path.read_bytes()
    flip_a_bit(path)
    kept = json.loads(done.memory().read_text())
    status = path.stat()
    known = kept["files"][str(path)]
    known[0] = [
        *(status.st_dev, status.st_ino, status.st_size),
        *(status.st_mtime_ns, status.st_ctime_ns),
    ]
    done.memory().write_text(json.dumps(kept))
    assert done.call("regress").summary.startswith("bsip regress: 2 up to date;")
    answer = done.call("regress", "--verify")
    assert f"{path.name} has changed since bsip wrote it: made again" in answer.err
    assert path.read_bytes() == content


@pytest.mark.parametrize(
    "damaged",
    [
        b"",
        b"{",
        b"\xff\xfe",
        b"[1]",
        b"[" * 100_000,
        b'{"note": 1, "files": {"a": 3}}',
        b'{"note": "", "files": {"a": [1, 2, 3]}}',
        b'{"files": []}',
    ],
    ids=lambda content: content[:20].decode(errors="replace"),
)
def test_a_damaged_memory_is_not_believed(tmp_path, damaged):
    (tmp_path / fingerprints.NAME).write_bytes(damaged)
    assert fingerprints.recall(tmp_path) == ""


@pytest.mark.parametrize("make", [lambda path: path.write_bytes(b"\xff"), os.mkfifo])
def test_a_damaged_memory_is_written_anew(done, make):
    done.memory().unlink()
    make(done.memory())
    answer = done.call("regress")
    assert (answer.code, answer.err.count("\n")) == (0, 1)
    assert str(done.path("regression")) in json.loads(done.memory().read_text())["files"]
