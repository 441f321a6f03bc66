"""Run with the library of ``failing_calls.c``: write or read one artifact, each call failing once.

    python -m tests.crash.every_call write|read FOLDER

Prints how many calls failed; what does not hold is an AssertionError.
"""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Callable
from pathlib import Path

import pandas as pd

from bsip_cli.artifacts import read_artifact, write_artifact
from bsip_cli.errors import BadDataError, NotWritableError
from bsip_cli.fingerprints import forget_all

NOTES = {"made_by": {"stage": "ingest"}, "messages": [], "facts": {}}
FAILURES = ((errno.EIO, False), (errno.EMFILE, False), (errno.ENOSPC, True), (errno.EROFS, True))


def refusal(sentence: str) -> pd.DataFrame:
    return pd.DataFrame([{"stage": "ingest", "kind": "bad data", "sentence": sentence}])


def in_turn(trace: Path, work: Callable[[], object], check: Callable[[bool], None]) -> int:
    """Let the first call of ``work`` fail, then the second, until it makes no more calls."""
    failed = 0
    for error, stays in FAILURES:
        number = 1
        while _failing(trace, number, error, stays, work, check):
            number += 1
        failed += number - 1
    return failed


def _failing(trace: Path, number: int, error: int, stays: bool, work, check) -> bool:
    trace.write_bytes(b"")
    forget_all()
    os.environ.update(FAULT_AT=str(number), FAULT_ERRNO=str(error))
    os.environ.update({"FAULT_STAYS": "1"} if stays else {})
    went_well = True
    try:
        work()
    except (BadDataError, NotWritableError):
        went_well = False
    finally:
        os.environ.update(FAULT_AT="0")
        os.environ.pop("FAULT_STAYS", None)
    was_met = trace.stat().st_size >= number * 256
    check(went_well)
    return was_met


def main() -> None:
    what, folder = sys.argv[1], Path(sys.argv[2])
    path, trace = folder / "a.parquet", Path(os.environ["FAULT_TRACE"])
    old, new = refusal("as it was"), refusal("as it is to be")
    write_artifact(path, "refusal", old, NOTES)

    def check_written(went_well: bool) -> None:
        forget_all()
        assert read_artifact(path, "refusal").equals(new if went_well else old)
        assert list(folder.iterdir()) == [path]
        write_artifact(path, "refusal", old, NOTES)

    def read() -> None:
        assert read_artifact(path, "refusal").equals(old)

    work = read if what == "read" else lambda: write_artifact(path, "refusal", new, NOTES)
    print(in_turn(trace, work, check_written if what == "write" else lambda _: None))


if __name__ == "__main__":
    main()
