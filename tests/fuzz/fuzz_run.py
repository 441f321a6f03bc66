"""Runs ranges of fuzz cases in worker processes; a worker that dies costs one case."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

_ROOT = Path(__file__).parents[2]


@dataclass(frozen=True)
class Result:
    """What became of one case; bug, silent and died are failures."""

    target: str
    index: int
    damage: str
    state: str  # refused, said, unchanged, silent, bug, died
    words: str
    seconds: float = 0.0
    peak_MB: float = 0.0

    def is_failure(self) -> bool:
        return self.state in ("bug", "silent", "died")


def run_cases(
    target: str, first: int, stop: int, scratch: Path, data: Path | None = None
) -> list[Result]:
    """Results of the cases first to stop (exclusive) of one target."""
    results: list[Result] = []
    while first + len(results) < stop:
        before = len(results)
        results += _one_process(target, first + before, stop, scratch, data)
        if len(results) == before:
            raise RuntimeError("the worker died before its first case")
    return results


def _one_process(
    target: str, first: int, stop: int, scratch: Path, data: Path | None
) -> list[Result]:
    paths = [str(_ROOT), os.environ.get("PYTHONPATH", "")]
    command = [sys.executable, "-m", "tests.fuzz.fuzz_worker", target]
    command += [str(first), str(stop), str(scratch)]
    ran = subprocess.run(
        [*command, *([str(data)] if data else [])],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths))},
    )
    lines = [json.loads(line) for line in ran.stdout.splitlines() if line.startswith("{")]
    results = []
    ended = {"state": "died", "words": f"exit code {ran.returncode}: {ran.stderr[-500:]}"}
    for begun, done in zip(lines[0::2], [*lines[1::2], ended], strict=False):
        results.append(Result(target, begun["index"], begun["damage"], **done))
    if not lines and ran.returncode:
        raise RuntimeError(ran.stderr)
    return results
