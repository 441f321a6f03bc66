"""CPU-seconds, memory and tables; imports nothing heavy."""

from __future__ import annotations

import csv
import json
import os
import re
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
RESULTS = ROOT / "docs" / "results"
BAD_DATA = 3  # some trial was refused, the rest is done

# A child's peak memory begins with its parent's: a parent of a few MB in between.
_LIGHT_PARENT = """
import json, os, sys
child = os.spawnv(os.P_NOWAIT, sys.argv[1], sys.argv[1:])
_, status, used = os.wait4(child, 0)
code = os.waitstatus_to_exitcode(status)
print(json.dumps([code, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024]))
"""


@dataclass(frozen=True)
class Usage:
    """What a process and its children took; the memory is that of the largest."""

    cpu_s: float
    peak_mb: float
    stdout: str
    stderr: str = ""
    code: int = 0


def cpu_seconds(work: Callable[[], object]) -> float:
    """CPU-seconds of this process, all threads: another's load on the machine does not count."""
    before = time.process_time()
    work()
    return time.process_time() - before


def interleaved(contestants: Mapping[str, Callable[[], float]], rounds: int) -> dict[str, float]:
    """Median of what each contestant returns, run in turns A B A B."""
    found: dict[str, list[float]] = {name: [] for name in contestants}
    for _ in range(rounds):
        for name, work in contestants.items():
            found[name].append(work())
    return {name: statistics.median(values) for name, values in found.items()}


def run_child(
    arguments: Sequence[str],
    environment: Mapping[str, str] | None = None,
    folder: Path = ROOT,
    allowed: int = 0,
) -> Usage:
    """Run a process in a folder to its end.

    RuntimeError: its exit code is neither 0 nor ``allowed``.
    """
    done = subprocess.run(
        [sys.executable, "-I", "-S", "-c", _LIGHT_PARENT, *arguments],
        env={**os.environ, **(environment or {})},
        cwd=folder,
        capture_output=True,
        text=True,
        check=True,
    )
    *printed, last = done.stdout.splitlines()
    code, cpu_s, peak_mb = json.loads(last)
    if code not in (0, allowed):
        raise RuntimeError(f"{' '.join(arguments)} ended with {code}\n{done.stderr}")
    return Usage(cpu_s, peak_mb, "\n".join(printed), done.stderr, code)


def bsip(*arguments: object) -> Usage:
    """Run a command of bsip, which may refuse some trials. Errors as of `run_child`."""
    return run_child([sys.executable, "-m", "bsip_cli", *map(str, arguments)], allowed=BAD_DATA)


def markdown(header: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """A Markdown table."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines)


def write_csv(path: Path, header: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """The same table as a data file."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(rows)


def machine() -> str:
    """Cores and GHz of this machine."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="ascii")
        ghz = max(float(mhz) for mhz in re.findall(r"cpu MHz\s*: ([\d.]+)", text)) / 1000
        return f"{os.cpu_count()} cores, {ghz:.1f} GHz"
    except (OSError, ValueError):
        return f"{os.cpu_count()} cores"
