"""Where the time of each stage goes, for one simulated participant: own time by function.

    python -m benchmarks.profiles [--sequence-s 120] [--write]

Compiled functions (numba, Pinocchio, LAPACK) count where Python calls them.
"""

from __future__ import annotations

import argparse
import cProfile
import importlib
import pstats
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import bsip_cli
from benchmarks.measure import RESULTS, bsip, machine, markdown, write_csv
from benchmarks.participant import study_options
from bsip_cli.pipeline import STAGES, Stage
from bsip_cli.running.runner import perform
from bsip_cli.running.session import OpenedStudy, open_study
from bsip_cli.running.unit import Unit
from bsip_cli.simulate.study import simulate_study

FILE = RESULTS / "profiles.csv"
PACKAGE = Path(bsip_cli.__file__).parent
SEED, SHOWN = 2017, 6


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


def row_of(name: str, times: Counter[str]) -> list[str]:
    total = sum(times.values())
    parts = [f"{place} {100 * own / total:.0f} %" for place, own in times.most_common(SHOWN)]
    return [name, f"{total:.1f}", "; ".join(parts)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sequence-s", type=float, default=120.0, help="[s]")
    parser.add_argument("--write", action="store_true", help=f"into {FILE.name}")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        study, out = Path(folder, "study"), Path(folder, "out")
        simulate_study(study, study_options(options.sequence_s, SEED))
        bsip("run", study, "--out", out)  # everything compiled once
        opened = open_study(study, out, (), None)
        rows = []
        for name in dict.fromkeys(stage.name for stage in STAGES):
            stages = [stage for stage in STAGES if stage.name == name]
            rows.append(row_of(name, own_times(profiled(stages, opened, out))))
    header = ["stage", "with the profiler [s]", "own time"]
    print(f"machine: {machine()}\n\n{markdown(header, rows)}")
    if options.write:
        write_csv(FILE, header, rows)


if __name__ == "__main__":
    main()
