"""Participants per hour: `bsip run` for 1 to 12 people in one and in two processes.

    python -m benchmarks.scaling [--participants 1 4 12] [--sequence-s 30]

A static trial and a sequence each. Both take turns on the same recordings; the clock counts, so
nothing else should run.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from benchmarks.measure import bsip, machine, markdown
from benchmarks.participant import study_options
from bsip_cli.simulate.study import simulate_study

SEED = 2017
JOBS = (1, 2)


def measured(study: Path, out: Path, jobs: int) -> tuple[float, float, float]:
    """Seconds of the clock, CPU-seconds and MB of the largest process, from nothing."""
    shutil.rmtree(out, ignore_errors=True)
    began = time.monotonic()
    usage = bsip("run", study, "--out", out, "--jobs", jobs)
    return time.monotonic() - began, usage.cpu_s, usage.peak_mb


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--participants", type=int, nargs="+", default=[1, 2, 4, 8, 12])
    parser.add_argument("--sequence-s", type=float, default=30.0)
    arguments = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as name:
        for n in arguments.participants:
            study, out = Path(name, f"study{n}"), Path(name, f"out{n}")
            options = study_options(arguments.sequence_s, SEED, participants=n)
            simulate_study(study, replace(options, tasks=("static", "sequence")))
            if not rows:
                measured(study, out, 1)  # everything compiled once
            one, two = (measured(study, out, jobs) for jobs in JOBS)
            per_hour = [n * 3600.0 / clock_s for clock_s, _, _ in (one, two)]
            rows.append(
                [
                    n,
                    *(f"{value:.0f}" for value in (one[0], one[1], one[2], two[0], two[1], two[2])),
                    *(f"{value:.0f}" for value in per_hour),
                    f"{one[0] / two[0]:.2f}",
                ]
            )
            print(rows[-1], file=sys.stderr)
    print(machine())
    of_each = [f"{what}, {jobs}" for jobs in JOBS for what in ("s", "CPU-s", "MB")]
    per_hour_of = [f"per hour, {jobs}" for jobs in JOBS]
    print(markdown(["participants", *of_each, *per_hour_of, "faster by"], rows))


if __name__ == "__main__":
    main()
