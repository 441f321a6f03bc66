"""Thousands of damaged files: what bsip answers, how long it takes, how much memory.

    python -m benchmarks.fuzz --cases 400 --data ../shared/data --write

Per kind of file CASES copies are damaged (tests/fuzz/damage.py) and ingested in processes with
limits of time and memory; with DATA the real C3D files of tests/fuzz/fuzz_study.py too. The
exit code is 1 if any case failed: a traceback, a killed process, or a wrong number in silence.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections import Counter
from pathlib import Path

from benchmarks.measure import RESULTS, write_csv
from tests.fuzz.fuzz_run import Result, run_cases
from tests.fuzz.fuzz_study import REAL, TARGETS

FILE = RESULTS / "damaged_files.csv"
_STATES = ("refused", "said", "unchanged", "silent", "bug", "died")
HEADER = ("file", "cases", *_STATES, "slowest [s]", "peak [MB]")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=400, help="per kind of file")
    parser.add_argument("--real-cases", type=int, default=60, help="per real C3D file")
    parser.add_argument("--data", type=Path, help="folder of real recordings")
    parser.add_argument("--write", action="store_true", help=f"into {FILE.name}")
    arguments = parser.parse_args()
    results: dict[str, list[Result]] = {}
    with tempfile.TemporaryDirectory() as scratch:
        for target in TARGETS:
            results[target] = run_cases(target, 0, arguments.cases, Path(scratch) / target)
            _tell(target, results[target])
        for target in REAL if arguments.data else ():
            folder = Path(scratch) / target
            results[target] = run_cases(target, 0, arguments.real_cases, folder, arguments.data)
            _tell(target, results[target])
    if arguments.write:
        write_csv(FILE, HEADER, rows_of(results))
    sys.exit(any(one.is_failure() for ones in results.values() for one in ones))


def rows_of(results: dict[str, list[Result]]) -> list[list[str]]:
    """A row per kind of file: cases by answer, the slowest, the largest."""
    rows = []
    for target, ones in results.items():
        counts = Counter(one.state for one in ones)
        name = TARGETS[target][0] if target in TARGETS else REAL[target]
        cells = [name, str(len(ones)), *(str(counts[state]) for state in _STATES)]
        cells += [f"{max(one.seconds for one in ones):.1f}"]
        cells += [f"{max(one.peak_MB for one in ones):.0f}"]
        rows.append(cells)
    return rows


def _tell(target: str, ones: list[Result]) -> None:
    print(target, dict(Counter(one.state for one in ones)), flush=True)
    for one in ones:
        if one.is_failure():
            print(f"  {one.index} {one.damage} {one.state}: {one.words[-300:]}", flush=True)


if __name__ == "__main__":
    main()
