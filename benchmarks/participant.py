"""CPU-seconds and memory of every stage for one simulated participant.

    python -m benchmarks.participant [--sequence-s 120] [--profiles [--write]]

With --profiles where the time of each stage goes instead: own time by function. Compiled functions
(numba, Pinocchio, LAPACK) count where Python calls them.
"""

from __future__ import annotations

import argparse
import cProfile
import importlib
import pstats
import statistics
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import bsip_cli
from benchmarks.measure import RESULTS, bsip, machine, markdown, run_child, write_csv
from bsip_cli.pipeline import STAGES, Stage
from bsip_cli.running.runner import perform
from bsip_cli.running.session import OpenedStudy, open_study
from bsip_cli.running.unit import Unit
from bsip_cli.simulate.options import Rates, StudyOptions
from bsip_cli.simulate.study import simulate_study

TARGET_CPU_S = 20.0
DIAGNOSIS = ("diagnose", "extend")  # not in the target
FILE, SHOWN = RESULTS / "profiles.csv", 6
PACKAGE = Path(bsip_cli.__file__).parent


Found = tuple[str, float, float, float]
"""A command: CPU-seconds of its work, of starting and importing, and peak memory [MB]."""


def study_options(
    sequence_s: float, seed: int, marker_hz: int = 100, participants: int = 1
) -> StudyOptions:
    """Static, one sequence and four short trials of every person."""
    return StudyOptions(
        participants=participants,
        rates={"default": Rates(marker_hz=marker_hz)},
        seed=seed,
        tasks=("static", "sequence", "throwing", "basketball", "squat", "walking"),
        durations_s={
            "static": 3.0,
            "sequence": sequence_s,
            "throwing": 3.0,
            "basketball": 3.0,
            "squat": 8.0,
            "walking": 1.2,
        },
    )


def stage_names() -> list[str]:
    """The commands, in the order of the pipeline."""
    return list(dict.fromkeys(stage.name for stage in STAGES))


def import_cpu_s(name: str) -> float:
    """What importing the modules of a stage costs on top of what its command always imports."""
    modules = [stage.module for stage in STAGES if stage.name == name]
    levels = {stage.level == "cohort" for stage in STAGES if stage.name == name}
    alone = len(levels) == 1  # else its modules are imported in two processes
    groups = [modules] if alone else [[module] for module in modules]
    base = run_child([sys.executable, "-c", "import bsip_cli.running.runner"]).cpu_s
    return sum(
        run_child(
            [sys.executable, "-c", f"import bsip_cli.running.runner, {', '.join(group)}"]
        ).cpu_s
        - base
        for group in groups
    )


def measure(study: Path, out: Path, rounds: int) -> list[Found]:
    """What every command takes."""
    found = []
    for name in stage_names():
        forced = [bsip(name, study, "--out", out, "--force") for _ in range(rounds)]
        fresh = [bsip(name, study, "--out", out) for _ in range(rounds)]
        imports = statistics.median(import_cpu_s(name) for _ in range(rounds))
        start = statistics.median(usage.cpu_s for usage in fresh) + imports
        total = statistics.median(usage.cpu_s for usage in forced)
        found.append((name, max(total - start, 0.0), start, max(usage.peak_mb for usage in forced)))
    return found


def together(name: str, found: list[Found]) -> Found:
    work, start = (sum(row[k] for row in found) for k in (1, 2))
    return name, work, start, max(row[3] for row in found)


def size_of(folder: Path) -> str:
    """Number and size of all files of a folder."""
    sizes = [path.stat().st_size for path in folder.rglob("*") if path.is_file()]
    return f"{len(sizes)} files, {sum(sizes) / 1e6:.1f} MB"


def table(found: list[Found]) -> str:
    but_diagnosis = [row for row in found if row[0] not in DIAGNOSIS]
    summed = [together("all but diagnosis", but_diagnosis), together("all", found)]
    rows = [
        [name, f"{work:.2f}", f"{start:.2f}", f"{memory:.0f}"]
        for name, work, start, memory in (*found, *summed)
    ]
    header = ["stage", "work [CPU-s]", "starting and importing [CPU-s]", "peak memory [MB]"]
    return markdown(header, rows)


# --- where the time goes --------------------------------------------------------------------------


def units_of(stage: Stage, opened: OpenedStudy, out: Path) -> Iterator[Unit]:
    """All of the only participant, or that of the group."""
    if stage.level == "cohort":
        yield Unit(stage, opened.study, out, opened.config)
        return
    (person,) = opened.study.participants
    for trial in person.trials if stage.level == "trial" else (None,):
        yield Unit(stage, opened.study, out, opened.config, person, trial)


def own_times(profile: cProfile.Profile) -> Counter[str]:
    """Seconds by function of bsip, and by package of what it calls."""
    found: Counter[str] = Counter()
    for (file, _, name), (_, _, own_s, _, _) in pstats.Stats(profile).stats.items():  # type: ignore[attr-defined]
        found[place_of(file, name)] += own_s
    return found


def place_of(file: str, name: str) -> str:
    path = Path(file)
    if path.is_relative_to(PACKAGE):
        return f"{path.relative_to(PACKAGE).with_suffix('').as_posix()}: {name}"
    if "site-packages" in path.parts:
        return path.parts[path.parts.index("site-packages") + 1]
    return name.strip("<>") if file == "~" else "Python's own library"


def profiled(stages: list[Stage], opened: OpenedStudy, out: Path) -> cProfile.Profile:
    """The work of a command's stages; importing is not in it."""
    for stage in stages:
        importlib.import_module(stage.module)
    profile = cProfile.Profile(time.process_time)
    for stage in stages:
        for unit in units_of(stage, opened, out):
            profile.runcall(perform, unit, force=True)
    return profile


def profile_row(name: str, times: Counter[str]) -> list[str]:
    total = sum(times.values())
    parts = [f"{place} {100 * own / total:.0f} %" for place, own in times.most_common(SHOWN)]
    return [name, f"{total:.1f}", "; ".join(parts)]


def profiles(study: Path, out: Path) -> list[list[str]]:
    """A row for each command."""
    opened = open_study(study, out, (), None)
    rows = []
    for name in stage_names():
        stages = [stage for stage in STAGES if stage.name == name]
        rows.append(profile_row(name, own_times(profiled(stages, opened, out))))
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sequence-s", type=float, default=120.0, help="[s]")
    parser.add_argument("--marker-hz", type=int, default=100, help="100 or 250, for instance")
    parser.add_argument("--seed", type=int, default=2017)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--profiles", action="store_true", help="own time by function instead")
    parser.add_argument("--write", action="store_true", help=f"these into {FILE.name}")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        study, out = Path(folder, "study"), Path(folder, "out")
        simulate_study(study, study_options(options.sequence_s, options.seed, options.marker_hz))
        bsip("run", study, "--out", out)  # everything compiled once
        if options.profiles:
            header, rows = ["stage", "with the profiler [s]", "own time"], profiles(study, out)
            print(f"machine: {machine()}\n\n{markdown(header, rows)}")
            if options.write:
                write_csv(FILE, header, rows)
            return
        print(f"machine: {machine()}; medians of {options.rounds} rounds\n")
        found = measure(study, out, options.rounds)
        print(table(found))
        (person,) = (path.name for path in study.glob("sub-*"))
        print(f"\nrecordings: {size_of(study / person)}; results: {size_of(out / person)}")
        whole = statistics.median(
            bsip("run", study, "--out", out, "--force").cpu_s for _ in range(options.rounds)
        )
    diagnosis = sum(work for name, work, _, _ in found if name in DIAGNOSIS)
    print(
        f"\n`bsip run`, all stages in one command: {whole:.1f} CPU-s with starting and importing;"
    )
    print(f"without diagnosis {whole - diagnosis:.1f} (target: at most {TARGET_CPU_S:g} CPU-s)")
    help_s = statistics.median(bsip("--help").cpu_s for _ in range(5))
    print(f"`bsip --help`: {help_s:.2f} CPU-s (target: under 0.5)")


if __name__ == "__main__":
    main()
