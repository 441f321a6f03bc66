"""Known masses on known segments of simulated people: do they come back?

Every person is recorded five times in one session with the same markers: twice with nothing, with
0.5 kg on the right forearm, with 1 kg on the right shank and with 2 kg on the trunk, each time in
another sequence of movements with other noise. `bsip compare-loads` looks for the mass in the
forces; the second recording with nothing is declared to carry each of them, and should show none.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks.measure import bsip, markdown
from bsip_cli.artifacts import read_artifact

LOADS = {2: ("forearm_r", 0.5), 3: ("shank_r", 1.0), 4: ("upper_torso", 2.0)}  # by run
PLAIN_RUN, AGAIN_RUN = 1, 5
ONE, TWO = "loaded segments", "two identifications"


@dataclass(frozen=True)
class Compared:
    """One comparison's table; ``carried``: whether the declared load was there."""

    segment: str
    declared_kg: float
    carried: bool
    table: pd.DataFrame

    def rows(self, analysis: str, segment: str, *quantities: str) -> pd.DataFrame:
        """Rows with the truth as it should be shown."""
        table = self.table
        where = (table["analysis"] == analysis) & (table["segment"] == segment)
        chosen = table[where & table["quantity"].isin(quantities)]
        return chosen.assign(truth=chosen["expected"] * self.carried)


# --- the recordings and comparisons -------------------------------------------------------------


def record(folder: Path, seed: int, duration_s: float, run: int) -> list[float]:
    """Write one run into the study of run 1; where its load sits, in the segment's frame."""
    segment, mass_kg = LOADS.get(run, ("", 0.0))
    hidden = ("--effect", "added_mass", "--size", mass_kg, "--target", segment)
    root = folder / f"run-{run}"
    drawn = ("--participants", 1, "--seed", seed, "--run", run, "--sequence-s", duration_s)
    tasks = ("--task", "static", "--task", "sequence")
    more = (*hidden, "--effect-tasks", "sequence") if segment else ()
    bsip("simulate", root, *drawn, *tasks, *more)
    name = f"sub-01/sub-01_task-sequence_run-{run}.c3d"
    (root / name).replace(folder / f"run-{PLAIN_RUN}" / name)
    truth = json.loads((root / "truth" / "sub-01_truth.json").read_text(encoding="utf-8"))
    return truth["effects"][0]["position_m"] if segment else []


def person(folder: Path, seed: int, duration_s: float) -> Iterator[Compared]:
    """Simulate one person, and compare every run with the first."""
    study, out = folder / f"run-{PLAIN_RUN}", folder / "out"
    places = {run: record(folder, seed, duration_s, run) for run in (PLAIN_RUN, AGAIN_RUN, *LOADS)}
    for stage in ("ingest", "scale", "ik", "regress"):
        bsip(stage, study, "--out", out)
    for worn in LOADS:
        for run in (worn, AGAIN_RUN):
            yield compared(study, out, run, worn, places[worn])


def compared(study: Path, out: Path, run: int, worn: int, position_m: list[float]) -> Compared:
    """A run beside the first, declared to carry the load that run ``worn`` carries."""
    segment, mass_kg = LOADS[worn]
    config = out.parent / "loads.toml"
    config.write_text(
        f'[[loads]]\nsegment = "{segment}"\n'
        f"mass_kg = {mass_kg}\nposition_m = {position_m}\nruns = [{run}]\n",
        encoding="utf-8",
    )
    sets = ("--with", f"sequence_run-{run}", "--without", f"sequence_run-{PLAIN_RUN}")
    who = ("--out", out, "--participant", "sub-01", "--config", config)
    bsip("compare-loads", study, *who, *sets)
    path = out / "sub-01" / "sub-01_load-comparison.parquet"
    table = read_artifact(path, "load-comparison")
    return Compared(segment, mass_kg, run == worn, table)


# --- the tables ---------------------------------------------------------------------------------


def inside(rows: pd.DataFrame) -> str:
    held = (rows["ci_low"] <= rows["truth"]) & (rows["truth"] <= rows["ci_high"])
    return f"{held.sum()} of {len(rows)}"


def mean_of(rows: pd.DataFrame) -> str:
    """Mean, its spread over people, and the mean half-width of the interval."""
    half_width = (rows["ci_high"] - rows["ci_low"]).mean() / 2
    mean, spread = rows["difference"].mean(), rows["difference"].std()
    return f"{mean:.3f} (sd {spread:.3f}) ± {half_width:.3f}"


def table_one_segment(found: list[Compared]) -> str:
    lines = []
    for carried in (True, False):
        for segment, mass_kg in LOADS.values():
            chosen = [one for one in found if (one.segment, one.carried) == (segment, carried)]
            masses, moments = (
                pd.concat([one.rows(ONE, segment, *names) for one in chosen])
                for names in (["m"], ["mcx", "mcy", "mcz"])
            )
            error = 1000 * np.sqrt(((moments["difference"] - moments["truth"]) ** 2).mean())
            name = f"{mass_kg:g} kg, {segment}" if carried else f"nothing, {segment}"
            lines.append([name, mean_of(masses), inside(masses), f"{error:.0f}", inside(moments)])
    header = ["load", "mass found [kg]", "inside", "first moment, RMS error [g m]", "inside"]
    return markdown(header, lines)


def table_differences(found: list[Compared]) -> str:
    lines = []
    for segment, mass_kg in LOADS.values():
        chosen = [one for one in found if one.carried and one.segment == segment]
        total, own = (
            pd.concat([one.rows(TWO, where, "m") for one in chosen]) for where in ("all", segment)
        )
        whole = pd.concat([one.table[one.table["analysis"] == TWO] for one in chosen])
        cells = [mean_of(total), inside(total), mean_of(own), f"{own['truth'].mean():.3f}"]
        every = inside(whole.assign(truth=whole["expected"]))
        lines.append([f"{mass_kg:g} kg, {segment}", *cells, inside(own), every])
    header = ["load", "total mass [kg]", "inside", "segment's own mass [kg]", "of it resolved"]
    return markdown([*header, "inside", "all parameters inside"], lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--people", type=int, default=6)
    parser.add_argument("--seconds", type=float, default=60.0, help="length of each sequence")
    parser.add_argument("--seed", type=int, default=101, help="of the first person")
    options = parser.parse_args()
    found: list[Compared] = []
    for seed in range(options.seed, options.seed + options.people):
        with tempfile.TemporaryDirectory() as folder:
            found += person(Path(folder), seed, options.seconds)
        print(f"person {seed} done", file=sys.stderr, flush=True)
    print(f"\n{table_one_segment(found)}\n\n{table_differences(found)}")


if __name__ == "__main__":
    main()
