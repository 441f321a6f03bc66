"""Calls of the system that fail: each read, write, open, fsync, rename in turn."""

from __future__ import annotations

import errno
import random
import shutil
import subprocess
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path

from tests.crash.bench import Bench, Ended

_SOURCE = Path(__file__).with_name("failing_calls.c")
LIBRARY = "failing_calls.so"
_RECORD = 256  # bytes, as there
_READING = ("read", "pread", "pread64", "opendir", "unlink")
CODES = (0, 2, 3)  # it did without, cannot write, cannot read


def compiler() -> str | None:
    return shutil.which("cc")


def compiled(folder: Path) -> Path:
    """The library that lets calls fail."""
    library = folder / LIBRARY
    command = [str(compiler()), "-shared", "-fPIC", "-o", str(library), str(_SOURCE), "-ldl"]
    subprocess.run(command, check=True)
    return library


@dataclass(frozen=True)
class Call:
    """The ``number``-th call on the study or the results, and how it fails.

    ``stays``: it writes one half, and from there on nothing can be written.
    """

    number: int
    name: str
    file: str
    error: int = 0
    stays: bool = False

    def __str__(self) -> str:
        how = f"{errno.errorcode.get(self.error, 'no error')}{' from there on' * self.stays}"
        return f"{self.name} {self.file} (call {self.number}): {how}"


NONE = Call(0, "", "")


def environment(library: Path, below: Path, trace: Path, call: Call) -> dict[str, str]:
    """What tells the library which call is to fail, of those on files below a folder."""
    return {
        "LD_PRELOAD": str(library),
        "FAULT_BELOW": f"{below}/",
        "FAULT_TRACE": str(trace),
        "FAULT_AT": str(call.number),
        "FAULT_ERRNO": str(call.error),
        **({"FAULT_STAYS": "1"} if call.stays else {}),
    }


def run_with(bench: Bench, library: Path, out: Path, call: Call) -> tuple[Ended, list[str]]:
    """One run, and the calls that it made."""
    trace = out.with_name(f"{out.name}.trace")
    trace.write_bytes(b"")
    done = bench.run(out, environment(library, out.parent, trace, call))
    return done, trace.read_bytes().decode().splitlines()


def calls_of(bench: Bench, library: Path, out: Path, chance: random.Random) -> list[Call]:
    """The calls of an undisturbed run in their order, each with a failure that it may meet; of
    several that follow each other on one file the first and the last."""
    bench.run(bench.fresh_out(out), {})  # the first run of new code makes calls that no other does
    done, lines = run_with(bench, library, bench.fresh_out(out), NONE)
    assert done.code == 0 and all(len(line) == _RECORD - 1 for line in lines), done.said
    calls = [Call(n, *line.split(maxsplit=1)) for n, line in enumerate(lines, 1)]
    streaks = [list(same) for _, same in groupby(calls, lambda call: (call.name, call.file))]
    ends = {call.number: call for streak in streaks for call in (streak[0], streak[-1])}
    return [_failing(call, chance) for call in ends.values()]


def _failing(call: Call, chance: random.Random) -> Call:
    kinds = [(errno.EIO, False)]
    if call.name == "open":
        kinds += [(errno.EMFILE, False)]
    if call.name not in _READING:
        kinds += [(errno.ENOSPC, True), (errno.EROFS, True)]
    return Call(call.number, call.name, call.file.strip(), *chance.choice(kinds))


def what_fails(bench: Bench, library: Path, out: Path, call: Call) -> list[str]:
    """What did not hold when this call failed."""
    done, lines = run_with(bench, library, bench.fresh_out(out), call)
    if len(lines) < call.number:  # caches of libraries spare some: where is the same call now?
        same = [n for n, line in enumerate(lines, 1) if line.split() == [call.name, call.file]]
        if same:
            call = replace(call, number=same[-1])
            done, lines = run_with(bench, library, bench.fresh_out(out), call)
        if len(lines) < call.number:
            return [f"only {len(lines)} calls were made"]
    is_named = any(word in done.said for word in (str(out), str(bench.study), "sub-01"))
    return [
        *([f"exit code {done.code}: {done.said}"] if done.code not in CODES else []),
        *([f"a trace: {done.said}"] if "Traceback" in done.said else []),
        *([f"no file is named: {done.said}"] if done.code and not is_named else []),
        *(f"exit code 0 with another {name}" for name in bench.others(out) if not done.code),
        *(f"an orphan: {line}" for line in done.left),
        *bench.broken_left(out),
        *bench.wrong_next(out),
    ]
