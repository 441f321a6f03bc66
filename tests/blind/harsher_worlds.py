"""Nulls in worlds that are further from the model than that of the blind suite.

Run from the checkout. Nothing is hidden, but skin, noise or bodies differ up to twice as much from
what is fitted as in the suite, where the rules of the diagnosis were found. A world that is there
is not simulated again, and `bsip` does again what is not up to date.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pandas as pd

from bsip_cli.simulate.options import PRESETS, Richness
from bsip_cli.simulate.study import simulate_study
from tests.blind.blind_running import ROOT, STAGES, TABLES, run_pipeline
from tests.blind.blind_scoring import read_answer
from tests.blind.blind_tables import markdown, wilson, write_csv

WORLDS = {
    "skin that moves twice as far": Richness(soft_tissue=2.0),
    "markers and plates three times as noisy": Richness(
        marker_noise_m=0.001, marker_drift_m=0.0005, force_noise_n=3.0, moment_noise_nm=1.0
    ),
    "joints, hinges, markers and inertias twice as far off": Richness(
        hinge_tilt=2.0, joint_centre_offset=2.0, placement_error_m=0.010, inertia_variation=2.0
    ),
    "all of it, about 1.7 times": Richness(
        soft_tissue=1.7,
        marker_noise_m=0.0008,
        marker_drift_m=0.0004,
        force_noise_n=2.5,
        moment_noise_nm=0.8,
        hinge_tilt=1.7,
        joint_centre_offset=1.7,
        placement_error_m=0.009,
        inertia_variation=1.7,
    ),
}


def main(arguments: Sequence[str] | None = None) -> None:
    options = parsed(arguments)
    rows = []
    for number, (world, richness) in enumerate(WORLDS.items(), start=1):
        folder = options.results / f"world-{number}"
        alarms = alarms_in(folder, richness, options)
        rows.append({"world": world, "people": len(alarms), **counted(alarms)})
    table = pd.DataFrame(rows)
    print(summary(table))
    write_csv(options.tables, "harsher_worlds", table)


def parsed(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    add = parser.add_argument
    add("--people", type=int, default=4, help="of every world")
    add("--seed", type=int, default=777, help="draws people and movements")
    add("--results", type=Path, default=ROOT / "out" / "harsher", help="folder of results")
    add("--tables", type=Path, default=TABLES, help="folder that gets the table")
    add("--jobs", type=int, default=2, help="processes at once")
    return parser.parse_args(arguments)


def alarms_in(folder: Path, richness: Richness, options: argparse.Namespace) -> list[list[str]]:
    """Per person everything that is taken to be wrong."""
    study = folder / "study"
    if not (study / "participants.tsv").exists():
        asked = {"participants": options.people, "seed": options.seed, "richness": richness}
        simulate_study(study, replace(PRESETS["diagnosis"], **asked))
    problems = run_pipeline(folder, STAGES, options.jobs)
    if problems:
        raise SystemExit("\n".join(problems))
    people = sorted((folder / "out").glob("sub-*"))
    files = (person / f"{person.name}_diagnosis.parquet" for person in people)
    return [read_answer(file, file.stem).alarms() for file in files]


def counted(alarms: list[list[str]]) -> dict[str, object]:
    raised = [", ".join(one) for one in alarms if one]
    return {"false positives": len(raised), "what": "; ".join(raised)}


def summary(table: pd.DataFrame) -> str:
    people, alarms = int(table["people"].sum()), int(table["false positives"].sum())
    low, high = wilson(alarms, people)
    return (
        f"{markdown(table)}\n\nOf {people} people {alarms} have a false positive: "
        f"{100 * alarms / people:.1f}% ({100 * low:.1f}% to {100 * high:.1f}%).\n"
    )


if __name__ == "__main__":
    main()
