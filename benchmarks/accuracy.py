"""Errors of segments and forces, and coverage of the intervals, on simulated people.

    python -m benchmarks.accuracy --people 20

The people differ from the table, their skin moves, and half of them are women. Each is identified
three times: from the sequence, from ten seconds of squats, and from ten seconds of standing in
which one arm moves a little; always judged on the same trials, none of which identified. With
--quick the static trial and the sequence alone are simulated, and segments judged.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks.measure import bsip, markdown
from bsip_cli.body.inertia import from_readable
from bsip_cli.config import load_config
from bsip_cli.pipeline import STAGES
from bsip_cli.running.unit import Unit
from bsip_cli.schemas import bsip_names
from bsip_cli.segments import without_side
from bsip_cli.simulate.balance import balanced
from bsip_cli.simulate.numerics import window
from bsip_cli.simulate.options import PRESETS
from bsip_cli.simulate.people import Person
from bsip_cli.simulate.plan import Plan, moved_a_little, plate_under, sketch_for
from bsip_cli.simulate.recording import (
    THIN,
    Trial,
    measure_trial,
    simulate_trial,
    trial_of,
    write_trial,
)
from bsip_cli.simulate.study import participant_person, simulate_study
from bsip_cli.stages import reconstruct
from bsip_cli.statistics.methods import ALTERNATIVES, OM, RM
from bsip_cli.study.study import load_study

ESTIMATORS = ("consistent", "hansen2017", "robert2017", "base")
WITH_SEGMENTS = (*ALTERNATIVES, *ESTIMATORS[:-1])  # base has combinations only
JUDGED = ["throwing", "basketball", "squat", "steps", "walking", "running"]
COMPONENTS = ["fx", "fy", "fz", "mx", "my", "mz", "cop_ap", "cop_ml"]
LITTLE = "too little motion"
TRUTH = "true parameters"

# --- people with good and poor recordings ---------------------------------------------------------

POOR_S = 10.0
SQUATS, ONE_ARM = "squats", "onearm"
RAISED_RAD = np.deg2rad([20.0, 10.0, 0.0])  # of the right shoulder, about Z, X and Y
BENT_RAD = np.deg2rad(10.0)
PACE_HZ = 0.5


def write_study(folder: Path, people: int, seed: int, quick: bool = False) -> None:
    """The preset ``sample`` with other people, and two poor recordings of each.

    quick : static trial and sequence alone.
    """
    options = replace(PRESETS["sample"], participants=people, seed=seed)
    if quick:
        simulate_study(folder, replace(options, tasks=("static", "sequence")))
        return
    simulate_study(folder, options)
    for number in range(1, people + 1):
        person = participant_person(options, number)
        for k, (task, move) in enumerate(POOR.items()):
            rng = np.random.default_rng([seed, number, k])
            name = f"sub-{number:02d}"
            measured = measure_trial(
                move(person, rng),
                person,
                options.rates_of("squat"),
                options.laboratory,
                options.richness,
                rng,
            )
            path = folder / name / f"{name}_task-{task}_run-1.c3d"
            write_trial(path, measured, options.richness.quantised, name)


def squats(person: Person, rng: np.random.Generator) -> Trial:
    return simulate_trial(person, "squat", rng, POOR_S)


def one_arm(person: Person, rng: np.random.Generator) -> Trial:
    """Standing, and the right arm swings a little."""
    plan = one_arm_plan(person, rng)
    return trial_of(person, plan, balanced(person, plan, THIN))


def one_arm_plan(person: Person, rng: np.random.Generator) -> Plan:
    sketch = sketch_for(person, POOR_S)
    phase = rng.uniform(0.0, 2.0 * np.pi)
    inside = window(sketch.t_s, 0.0, POOR_S, 0.6)
    swing = inside * (1.0 - np.cos(2.0 * np.pi * PACE_HZ * sketch.t_s + phase)) / 2.0
    sketch.angles["shoulder_r"] += RAISED_RAD * swing[:, None]
    sketch.angles["elbow_r"] += BENT_RAD * swing
    moved_a_little(sketch, rng, 0.2)
    return sketch.plan(plate_centre_m=plate_under(sketch, rng))


POOR = {SQUATS: squats, ONE_ARM: one_arm}


# --- how far estimates lie from the truth, and the forces that follow from them -------------------

_QUANTILE = 1.96
_NAMES = list(bsip_names())
_GROUPS = {"masses": slice(0, 1), "centres of mass": slice(1, 4), "tensors": slice(4, 10)}


def identify(study: Path, out: Path, task: str) -> Path:
    """Run the stages with that task as the only one that identifies; return the options' file."""
    options = out.with_name(f"{task}.toml")
    names = ", ".join(f'"{name}"' for name in ESTIMATORS)
    options.write_text(f'[roles]\nsequence = ["{task}"]\n[identify]\nestimators = [{names}]\n')
    for stage in ("ingest", "scale", "ik", "regress", "identify"):
        bsip(stage, study, "--out", out, "--config", options)
    return options


def true_segments(study: Path, participant: str) -> tuple[str, dict[str, np.ndarray]]:
    """Sex, and per segment the ten readable parameters (10,)."""
    record = json.loads((study / "truth" / f"{participant}_truth.json").read_text("utf-8"))
    segments = record["person"]["segments"]
    return record["person"]["sex"], {
        name: np.array([part[column] for column in _NAMES]) for name, part in segments.items()
    }


def segment_errors(study: Path, out: Path) -> pd.DataFrame:
    """A row per participant, method and segment.

    Errors of mass [kg], centre of mass [mm] and, mean of three, principal moments of inertia [%];
    how far mass [kg] and centre of mass [mm] lie from RM's; whether a body can have it; and the
    share of masses, coordinates and tensor entries whose 95 % interval holds the truth. Both sides
    of a limb have the same name.
    """
    rows = []
    for folder in sorted(out.glob("sub-*")):
        sex, truth = true_segments(study, folder.name)
        table = pd.read_parquet(folder / f"{folder.name}_bsip.parquet")
        regression = table[table["method"] == "RM"].set_index("segment")[_NAMES]
        for row in table.to_dict("records"):
            found = np.array([row[name] for name in _NAMES])
            sd = np.array([row[f"{name}_sd"] for name in _NAMES])
            true, rm = truth[row["segment"]], regression.loc[row["segment"]].to_numpy()
            rows.append(
                {
                    "participant": folder.name,
                    "sex": sex,
                    "method": row["method"],
                    "segment": without_side(row["segment"]),
                    **errors(found, true),
                    "mass from RM": abs(found[0] - rm[0]),
                    "centre from RM": 1000 * np.linalg.norm(found[1:4] - rm[1:4]),
                    **inside(found, sd, true),
                }
            )
    return pd.DataFrame(rows)


def errors(found: np.ndarray, true: np.ndarray) -> dict[str, float]:
    """Of one segment, readable parameters (10,)."""
    body, real = from_readable(found), from_readable(true)
    moments, expected = (np.linalg.eigvalsh(one.tensor_kgm2) for one in (body, real))
    return {
        "mass": abs(found[0] - true[0]),
        "centre": 1000 * float(np.linalg.norm(body.com_m - real.com_m)),
        "inertias": 100 * float(np.abs(moments / expected - 1).mean()),
        "physical": float(body.is_physical()),
    }


def inside(found: np.ndarray, sd: np.ndarray, true: np.ndarray) -> dict[str, float]:
    """Share of each group's 95 % intervals that hold the truth."""
    held = np.abs(found - true) <= _QUANTILE * sd
    shares = {name: float(held[part].mean()) for name, part in _GROUPS.items()}
    return shares | {"all": float(held.mean())}


@dataclass
class WithTruth(Unit):
    """A unit of ``reconstruct`` to which the true parameters are one method more.

    What the stage writes is kept here and not on disk.
    """

    truth: pd.DataFrame = field(default_factory=pd.DataFrame)
    kept: dict[str, pd.DataFrame] = field(default_factory=dict)

    def read(self, kind, trial=None, participant=None):
        table = super().read(kind, trial, participant)
        return pd.concat([table, self.truth], ignore_index=True) if kind == "bsip" else table

    def write(self, kind, frame, facts=None):
        self.kept[kind] = frame


def force_errors(study: Path, out: Path, options: list[Path], tasks: list[str]) -> pd.DataFrame:
    """Held-out RMSE (N, N m, mm) per participant, task, component and method, the truth's too."""
    config = load_config([study / "study.toml", *options])
    found, _ = load_study(study, config.roles.model_dump())
    stage = next(stage for stage in STAGES if stage.name == "reconstruct")
    parts = []
    for participant in found.participants:
        _, segments = true_segments(study, participant.id)
        truth = pd.DataFrame.from_dict(segments, orient="index", columns=_NAMES)
        truth = truth.rename_axis("segment").reset_index().assign(method=TRUTH)
        for trial in participant.trials:
            if trial.task not in tasks:
                continue
            unit = WithTruth(stage, found, out, config, participant, trial, truth=truth)
            reconstruct.run(unit)
            fit = unit.kept["fit"].assign(participant=participant.id, task=trial.task)
            parts.append(fit[fit["data"] == "held_out"])
    return pd.concat(parts, ignore_index=True)


# --- tables ---------------------------------------------------------------------------------------

_ERRORS = {
    "mass [kg]": "mass",
    "centre of mass [mm]": "centre",
    "principal inertias [%]": "inertias",
}
_APART = {"mass from RM's [kg]": "mass from RM", "centre from RM's [mm]": "centre from RM"}


def named(table: pd.DataFrame) -> pd.DataFrame:
    """The first estimator by its own name instead of OM."""
    return table.replace({"method": {OM: ESTIMATORS[0]}})


def means_of(found: pd.DataFrame, *by: str) -> pd.DataFrame:
    """Means of all errors, shares in %."""
    means = found.groupby([*by]).mean(numeric_only=True)
    means[["physical", *_GROUPS, "all"]] *= 100
    return means


def table_of(
    corner: Sequence[str], rows: Mapping[tuple[str, ...], pd.Series], columns: Mapping[str, str]
) -> str:
    """Means under titles, kilograms with three decimals."""
    cells = [
        [*names, *(f"{row[c]:.{3 if 'kg' in title else 1}f}" for title, c in columns.items())]
        for names, row in rows.items()
    ]
    return markdown([*corner, *columns], cells)


def segment_table(found: pd.DataFrame) -> str:
    means = means_of(found, "method")
    columns = _ERRORS | {"possible bodies [%]": "physical"} | _APART
    return table_of(["method"], {(m,): means.loc[m] for m in WITH_SEGMENTS}, columns)


def sex_table(found: pd.DataFrame) -> str:
    means, methods = means_of(found, "sex", "method"), (*ALTERNATIVES, ESTIMATORS[0])
    people = (("F", "women"), ("M", "men"))
    rows = {(title, m): means.loc[(sex, m)] for sex, title in people for m in methods}
    return table_of(["", "method"], rows, _ERRORS | {"inside [%]": "all"})


def coverage_table(found: pd.DataFrame) -> str:
    means, corner = means_of(found, "method"), ["95 % intervals that hold the truth [%]"]
    rows = {(m,): means.loc[m] for m in WITH_SEGMENTS}
    return table_of(corner, rows, {name: name for name in (*_GROUPS, "all")})


def each_segment_table(found: pd.DataFrame) -> str:
    """Errors of RM and of the first estimator, and how often its intervals hold, by segment."""
    means, whole = means_of(found, "method", "segment"), means_of(found, "method")
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
        cells += [" ".join(f"{frame.loc[segment, g]:.0f}" for frame in (rm, om)) for g in _GROUPS]
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
    ratio = (errors[ESTIMATORS[0]] / errors[TRUTH]).groupby("component")
    found = {"mean over tasks": ratio.agg(geometric_mean), "worst task": ratio.max()}
    rows = [[name, *(f"{x:.2f}" for x in values[COMPONENTS])] for name, values in found.items()]
    return markdown([f"{ESTIMATORS[0]} over true parameters", *COMPONENTS], rows)


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
    recordings = {
        "the sequence, 27 s": "sequence",
        "squats only, 10 s": SQUATS,
        "one arm only, 10 s": ONE_ARM,
    }
    with tempfile.TemporaryDirectory() as scratch:
        folder = options.folder or Path(scratch)
        study, out = folder / "study", folder / "out"
        write_study(study, options.people, options.seed, options.quick)
        for name, task in recordings.items():
            own = identify(study, out, task)
            found = named(segment_errors(study, out))
            if options.quick:
                tables = [segment_table(found), each_segment_table(found), better_in(found)]
                print("\n\n".join(tables))
                return
            forces = named(force_errors(study, out, [own], JUDGED))
            tables = [segment_table(found), coverage_table(found)]
            if task == "sequence":
                tables.append(sex_table(found))
            tables += [force_table(forces), floor_table(forces), notes(out)]
            print(f"\n**Identified from {name}**\n\n" + "\n\n".join(tables), flush=True)


if __name__ == "__main__":
    main()
