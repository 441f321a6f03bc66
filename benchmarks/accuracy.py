"""Errors of segments and forces, and coverage of the intervals, on simulated people.

    python -m benchmarks.accuracy --people 20

The people differ from the table, their skin moves, and half of them are women. Each is identified
three times: from the sequence, from ten seconds of squats, and from ten seconds of standing in
which one arm moves a little; always judged on the same trials, none of which identified. With
--quick the static trial and the sequence alone are simulated, and segments judged.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks.accuracy_measures import TRUTH, force_errors, segment_errors
from benchmarks.accuracy_study import ONE_ARM, SQUATS, write_study
from benchmarks.measure import bsip, markdown
from bsip_cli.statistics.methods import ALTERNATIVES, OM, RM

ESTIMATORS = ("consistent", "hansen2017", "robert2017", "base")
RECORDINGS = {
    "the sequence, 27 s": "sequence",
    "squats only, 10 s": SQUATS,
    "one arm only, 10 s": ONE_ARM,
}
JUDGED = ["throwing", "basketball", "squat", "steps", "walking", "running"]
COMPONENTS = ["fx", "fy", "fz", "mx", "my", "mz", "cop_ap", "cop_ml"]
STAGES = ("ingest", "scale", "ik", "regress", "identify")
LITTLE = "too little motion"


def identify(study: Path, out: Path, task: str) -> Path:
    """Run the stages with that task as the only one that identifies; return the options' file."""
    options = out.with_name(f"{task}.toml")
    names = ", ".join(f'"{name}"' for name in ESTIMATORS)
    options.write_text(f'[roles]\nsequence = ["{task}"]\n[identify]\nestimators = [{names}]\n')
    for stage in STAGES:
        bsip(stage, study, "--out", out, "--config", options)
    return options


def named(table: pd.DataFrame) -> pd.DataFrame:
    """The first estimator by its own name instead of OM."""
    return table.replace({"method": {OM: ESTIMATORS[0]}})


def segment_table(found: pd.DataFrame) -> str:
    means = found.groupby("method").mean(numeric_only=True)
    rows = []
    for method in (*ALTERNATIVES, *ESTIMATORS[:-1]):  # base has combinations only
        row = means.loc[method]
        rows.append(
            [
                method,
                f"{row['mass']:.3f}",
                f"{row['centre']:.1f}",
                f"{row['inertias']:.1f}",
                f"{100 * row['physical']:.1f}",
                f"{row['mass from RM']:.3f}",
                f"{row['centre from RM']:.1f}",
            ]
        )
    header = ["method", "mass [kg]", "centre of mass [mm]", "principal inertias [%]"]
    apart = ["mass from RM's [kg]", "centre from RM's [mm]"]
    return markdown([*header, "possible bodies [%]", *apart], rows)


def sex_table(found: pd.DataFrame) -> str:
    means = found.groupby(["sex", "method"]).mean(numeric_only=True)
    rows = []
    for sex, people in (("F", "women"), ("M", "men")):
        for method in (*ALTERNATIVES, ESTIMATORS[0]):
            row = means.loc[(sex, method)]
            cells = [f"{row['mass']:.3f}", f"{row['centre']:.1f}", f"{row['inertias']:.1f}"]
            rows.append([people, method, *cells, f"{100 * row['all']:.1f}"])
    header = ["", "method", "mass [kg]", "centre of mass [mm]", "principal inertias [%]"]
    return markdown([*header, "inside [%]"], rows)


def each_segment_table(found: pd.DataFrame) -> str:
    """Errors of RM and of the first estimator, and how often its intervals hold, by segment."""
    means = found.groupby(["method", "segment"]).mean(numeric_only=True)
    whole = found.groupby("method").mean(numeric_only=True)
    rm, om = (
        pd.concat([means.loc[name], whole.loc[[name]].rename({name: "all"})])
        for name in (RM, ESTIMATORS[0])
    )
    rows = []
    for segment in om.index:
        cells = [segment]
        for name, digits in (("mass", 2), ("centre", 1)):
            pair = [frame.loc[segment, name] for frame in (rm, om)]
            cells += [*(f"{x:.{digits}f}" for x in pair), f"{pair[1] / pair[0]:.2f}"]
        for group in ("masses", "centres of mass", "tensors"):
            cells.append(" ".join(f"{100 * frame.loc[segment, group]:.0f}" for frame in (rm, om)))
        rows.append(cells)
    header = ["", "RM [kg]", "OM [kg]", "OM/RM", "RM [mm]", "OM [mm]", "OM/RM"]
    inside = [f"{group} inside, RM OM [%]" for group in ("masses", "centres", "tensors")]
    return markdown([*header, *inside], rows)


def better_in(found: pd.DataFrame) -> str:
    """In how many people the first estimator is nearer to the truth than RM."""
    means = found.groupby(["participant", "method"]).mean(numeric_only=True).unstack()
    nearer = [
        int((means[name][ESTIMATORS[0]] < means[name][RM]).sum()) for name in ("mass", "centre")
    ]
    return f"Nearer than RM: masses in {nearer[0]}, centres of mass in {nearer[1]} of {len(means)}."


def coverage_table(found: pd.DataFrame) -> str:
    means = found.groupby("method").mean(numeric_only=True)
    groups = ["masses", "centres of mass", "tensors", "all"]
    rows = [
        [method, *(f"{100 * means.loc[method, group]:.1f}" for group in groups)]
        for method in (*ALTERNATIVES, *ESTIMATORS[:-1])
    ]
    return markdown(["95 % intervals that hold the truth [%]", *groups], rows)


def by_task(forces: pd.DataFrame) -> pd.DataFrame:
    """Mean over people of the RMSE: index task and component, columns methods."""
    return forces[forces["component"].isin(COMPONENTS)].pivot_table(
        index=["task", "component"], columns="method", values="rmse", aggfunc="mean"
    )


def geometric_mean(ratios: pd.Series) -> float:
    return float(np.exp(np.log(ratios).mean()))


def force_table(forces: pd.DataFrame) -> str:
    """Means over tasks of the people's mean RMSE; ratios are geometric means."""
    errors = by_task(forces)
    means = errors.groupby("component").mean()
    rows = []
    for method in (*ALTERNATIVES, *ESTIMATORS, TRUTH):
        cells = [f"{means.loc[component, method]:.1f}" for component in COMPONENTS]
        ratios = [geometric_mean(errors[method] / errors[other]) for other in (RM, TRUTH)]
        rows.append([method, *cells, *(f"{ratio:.2f}" for ratio in ratios)])
    header = ["RMSE [N, N m, mm]", *COMPONENTS, "over RM's", "over the true parameters'"]
    return markdown(header, rows)


def floor_table(forces: pd.DataFrame) -> str:
    """OM's error over that of the true parameters, per component and, at worst, per task."""
    errors = by_task(forces)
    ratio = errors[ESTIMATORS[0]] / errors[TRUTH]
    per_component = ratio.groupby("component")
    mean = [f"{geometric_mean(per_component.get_group(c)):.2f}" for c in COMPONENTS]
    worst = [f"{per_component.get_group(c).max():.2f}" for c in COMPONENTS]
    name = f"{ESTIMATORS[0]} over true parameters"
    return markdown([name, *COMPONENTS], [["mean over tasks", *mean], ["worst task", *worst]])


def notes(out: Path) -> str:
    """What the estimator says of itself: how often it stays near the table, and an example."""
    tables = [pd.read_parquet(path) for path in sorted(out.glob("sub-*/*_identification.parquet"))]
    said = [str(table.set_index("method").loc[OM, "note"]) for table in tables]
    few = sum(LITTLE in note for note in said)
    return f'"{LITTLE}" in {few} of {len(said)} notes of {ESTIMATORS[0]}; the first: "{said[0]}"'


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--people", type=int, default=20)
    parser.add_argument("--seed", type=int, default=4711)
    parser.add_argument("--folder", type=Path, help="keep study and results here")
    parser.add_argument("--quick", action="store_true", help="the sequence, and segments alone")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = options.folder or Path(scratch)
        study, out = folder / "study", folder / "out"
        write_study(study, options.people, options.seed, options.quick)
        for name, task in RECORDINGS.items():
            own = identify(study, out, task)
            found = named(segment_errors(study, out))
            if options.quick:
                print(
                    "\n\n".join([segment_table(found), each_segment_table(found), better_in(found)])
                )
                return
            forces = named(force_errors(study, out, [own], JUDGED))
            tables = [segment_table(found), coverage_table(found)]
            if task == "sequence":
                tables.append(sex_table(found))
            tables += [force_table(forces), floor_table(forces), notes(out)]
            print(f"\n**Identified from {name}**\n\n" + "\n\n".join(tables), flush=True)


if __name__ == "__main__":
    main()
