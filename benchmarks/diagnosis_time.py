"""CPU-seconds of `bsip diagnose` for a person with one or two trials of 30 s."""

from __future__ import annotations

import argparse
import statistics
import tempfile
from pathlib import Path

from benchmarks.measure import RESULTS, bsip, machine, markdown, write_csv
from bsip_cli.simulate.options import Asked, StudyOptions
from bsip_cli.simulate.study import simulate_study

TARGET_CPU_S, TRIAL_S = 60.0, 30.0
FILE = RESULTS / "diagnosis_time.csv"
HEADER = (
    "recordings",
    "hidden",
    "median [CPU-s]",
    "most [CPU-s]",
    "of which starting [CPU-s]",
    "most per trial, of 60 CPU-s",
)
BEFORE = ("ingest", "scale", "ik", "regress", "identify", "reconstruct")
HIDDEN = {
    "nothing": (),
    "forces 10 ms late": (Asked("sync_offset", 0.010, ""),),
    "forces 10 ms late, plate shifted by 20 mm": (
        Asked("sync_offset", 0.010, ""),
        Asked("plate_translation", 0.020, ""),
    ),
}
TASKS = {"one trial of 30 s": ("sequence",), "two trials of 30 s": ("sequence", "squat")}


def options_of(tasks: tuple[str, ...], hidden: tuple[Asked, ...], seed: int) -> StudyOptions:
    """Static and trials of one person at 100 Hz."""
    durations = {"static": 3.0, **dict.fromkeys(tasks, TRIAL_S)}
    return StudyOptions(
        participants=1,
        seed=seed,
        tasks=("static", *tasks),
        durations_s=durations,
        effects=hidden,
    )


def cpu_s(tasks: tuple[str, ...], hidden: tuple[Asked, ...], seed: int) -> tuple[float, float]:
    """Of `bsip diagnose`, and of it when all is up to date."""
    with tempfile.TemporaryDirectory() as folder:
        study, out = Path(folder, "study"), Path(folder, "out")
        simulate_study(study, options_of(tasks, hidden, seed))
        for stage in BEFORE:
            bsip(stage, study, "--out", out)
        work, start = (bsip("diagnose", study, "--out", out).cpu_s for _ in range(2))
        return work, start


def rows_of(seeds: list[int]) -> list[list[str]]:
    """One per set of recordings and what is hidden in them."""
    rows = []
    for told, tasks in TASKS.items():
        for name, hidden in HIDDEN.items():
            found = [cpu_s(tasks, hidden, seed) for seed in seeds]
            whole = [work for work, _ in found]
            start = statistics.median(start for _, start in found)
            each = max(whole) / len(tasks)
            rows.append([told, name, f"{statistics.median(whole):.1f}"])
            rows[-1] += [f"{max(whole):.1f}", f"{start:.1f}", f"{each / TARGET_CPU_S:.2f}"]
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--people", type=int, default=3)
    parser.add_argument("--write", action="store_true", help=f"into {FILE.name}")
    options = parser.parse_args()
    rows = rows_of([100 + k for k in range(options.people)])
    print(f"machine: {machine()}; {options.people} people\n\n{markdown(HEADER, rows)}")
    if options.write:
        write_csv(FILE, HEADER, rows)


if __name__ == "__main__":
    main()
