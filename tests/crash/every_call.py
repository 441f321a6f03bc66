"""Every call of the system fails in turn, all in this one process, which takes no time to start.

    python -m tests.crash.every_call write|read|STAGE FOLDER SEED

``write`` and ``read`` concern one artifact; a stage is run by bsip's own command, with the tasks
that workers do otherwise. Needs the library of ``failing_calls.c`` in LD_PRELOAD. The answer is a
line of JSON: how many calls of each kind failed, and what did not hold.
"""

from __future__ import annotations

import contextlib
import errno
import io
import json
import os
import random
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import pandas as pd

from bsip_cli import cli
from bsip_cli.artifacts import read_artifact, write_artifact
from bsip_cli.errors import BadDataError, NotWritableError
from bsip_cli.files.fingerprints import forget_all
from bsip_cli.running import runner
from tests.crash import faults
from tests.crash.bench import Ended, benches

_NOTES = {"made_by": {"stage": "ingest"}, "messages": [], "facts": {}}
_FAILURES = ((errno.EIO, False), (errno.EMFILE, False), (errno.ENOSPC, True), (errno.EROFS, True))

Answer = tuple[Counter[str], list[str]]


def every_call(what: str, folder: Path, seed: int) -> Answer:
    """What `main` finds, from a process of its own."""
    folder.mkdir()
    library = faults.compiled(folder)
    (trace := folder / "out.trace").touch()
    done = subprocess.run(
        [sys.executable, "-m", "tests.crash.every_call", what, str(folder), str(seed)],
        env={**os.environ, **faults.environment(library, folder, trace, faults.NONE)},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    counts, wrong = json.loads(done.stdout)
    return Counter(counts), wrong


# --- a stage ----------------------------------------------------------------------------------


def _of_stage(name: str, folder: Path, seed: int) -> Answer:
    counts: Counter[str] = Counter()
    wrong: list[str] = []
    library, out = folder / faults.LIBRARY, folder / "out"
    for bench in benches(_in_this_process, folder, (name,)):
        for call in faults.calls_of(bench, library, out, random.Random(seed)):
            found = faults.what_fails(bench, library, out, call)
            counts[call.name] += 1
            wrong += [f"{' '.join(bench.command)}: {call}: {what}" for what in found]
    return counts, wrong


def _in_this_process(
    study: Path, out: Path, command: Sequence[str], environment: Mapping[str, str]
) -> Ended:
    """A command's exit code and words; its tasks are not handed to workers."""
    name, *options = command
    sys.argv = ["bsip", name, str(study), "--out", str(out), *options]
    runner.work_on = lambda tasks, work, *_: (one for task in tasks for one in work(task))
    said = io.StringIO()
    with contextlib.redirect_stderr(said), _fault(environment):
        sentence, code = cli._answer()
    return Ended(code, said.getvalue() + sentence)


@contextlib.contextmanager
def _fault(environment: Mapping[str, str]):
    os.environ.update(environment)
    try:
        yield
    finally:
        os.environ.update(FAULT_AT="0")
        os.environ.pop("FAULT_STAYS", None)


# --- one artifact -----------------------------------------------------------------------------


def _of_artifact(what: str, folder: Path) -> Answer:
    (place := folder / "artifacts").mkdir()
    path = place / "a.parquet"
    old, new = _refusal("as it was"), _refusal("as it is to be")
    write_artifact(path, "refusal", old, _NOTES)

    def check_written(went_well: bool) -> None:
        assert read_artifact(path, "refusal").equals(new if went_well else old)
        assert list(place.iterdir()) == [path]
        write_artifact(path, "refusal", old, _NOTES)

    def read() -> None:
        assert read_artifact(path, "refusal").equals(old)

    if what == "read":
        return _in_turn(folder, read, lambda _: None)
    return _in_turn(folder, lambda: write_artifact(path, "refusal", new, _NOTES), check_written)


def _refusal(sentence: str) -> pd.DataFrame:
    return pd.DataFrame([{"stage": "ingest", "kind": "bad data", "sentence": sentence}])


def _in_turn(folder: Path, work: Callable[[], None], check: Callable[[bool], None]) -> Answer:
    """Let the first call of ``work`` fail, then the second, until it makes no more calls."""
    counts: Counter[str] = Counter()
    for error, stays in _FAILURES:
        number = 1
        while name := _failing(folder, faults.Call(number, "", "", error, stays), work, check):
            counts[name] += 1
            number += 1
    return counts, []


def _failing(folder: Path, call: faults.Call, work, check) -> str:
    """The name of the call that failed; empty if there was none of that number."""
    trace = folder / "out.trace"
    trace.write_bytes(b"")
    forget_all()
    with _fault(faults.environment(folder / faults.LIBRARY, folder / "artifacts", trace, call)):
        try:
            work()
            went_well = True
        except (BadDataError, NotWritableError):
            went_well = False
    lines = trace.read_text().splitlines()
    forget_all()
    check(went_well)
    return lines[call.number - 1].split()[0] if len(lines) >= call.number else ""


def main() -> None:
    what, folder, seed = sys.argv[1], Path(sys.argv[2]), int(sys.argv[3])
    is_stage = what not in ("write", "read")
    print(json.dumps(_of_stage(what, folder, seed) if is_stage else _of_artifact(what, folder)))


if __name__ == "__main__":
    main()
