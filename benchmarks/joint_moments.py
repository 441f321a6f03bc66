"""Joint moments of simulated people against their truth: error per method, coverage of intervals.

    bsip simulate STUDY --participants 3 --plate-per-foot
    bsip run STUDY --out OUT
    python -m benchmarks.joint_moments STUDY OUT

The truth is Newton and Euler of each simulated body at 1 kHz about its true joint, with the force
under each foot and what the feet push against each other, below the cut-off that the artifact is
below. Legs and arms only: the simulated trunk has two parts. ``Richness.placement_error_m`` 0.01 of
`simulate_study` makes landmarks as uncertain as the stage takes them to be.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.ndimage import gaussian_filter1d

from bsip_cli.artifacts import read_artifact
from bsip_cli.simulate.moving import MOVEMENTS
from bsip_cli.simulate.options import PRESETS, StudyOptions
from bsip_cli.simulate.people import Person
from bsip_cli.simulate.plan import GRAVITY
from bsip_cli.simulate.recording import Trial, simulate_trial
from bsip_cli.simulate.study import MOVEMENT, generator, participant_person, wobbling
from tests.dynamics.newton_euler import driving_wrench, joint_axes

STEP_S = 1e-3
SIGMA_S = np.sqrt(np.log(2)) / (2 * np.pi * 10.0)  # of joints.cutoff_hz, half of the power
LIMBS = {
    "ankle": ("foot",),
    "knee": ("shank", "foot"),
    "hip": ("thigh", "shank", "foot"),
    "elbow": ("forearm", "hand"),
    "shoulder": ("upper_arm", "forearm", "hand"),
}
PROXIMAL = {"ankle": "shank", "knee": "thigh", "hip": "lower_torso", "elbow": "upper_arm"}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("study", type=Path)
    parser.add_argument("out", type=Path)
    given = parser.parse_args()
    rows = []
    for file in sorted((given.study / "truth").glob("*_truth.json")):
        record = json.loads(file.read_text())
        options = _options(record["options"])
        name = record["participant_id"]
        for task in options.tasks:
            if task not in ("throwing", "basketball", "static"):  # a ball is in the hand
                rows += _of_trial(given.out, options, name, task)
    table = pd.DataFrame(rows)
    print(_summary(table, ["joint", "method"]).to_string())
    print(_summary(table[table["method"] == "OM"], ["joint", "axis"]).to_string())
    print(_summary(table, ["task"]).to_string())


def _options(written: dict) -> StudyOptions:
    """The sample's, with what the command line or a caller of `simulate_study` can change of it."""
    base = PRESETS["sample"]
    laboratory = replace(base.laboratory, plate_per_foot=written["laboratory"]["plate_per_foot"])
    return replace(
        base,
        laboratory=laboratory,
        richness=replace(base.richness, **written["richness"]),
        durations_s=written["durations_s"],
        **{key: written[key] for key in ("participants", "seed", "sexes", "run")},
        tasks=tuple(written["tasks"]),
    )


def _summary(table: pd.DataFrame, by: list[str]) -> pd.DataFrame:
    """Errors [N m], and frames within 95 % intervals [%], means over trials and axes."""
    means = table.groupby(by)[["rms_Nm", "peak_Nm", "inside_percent", "inside_sd"]].mean()
    return means.round(2)


def _of_trial(out: Path, options: StudyOptions, name: str, task: str) -> list[dict]:
    number = int(name.removeprefix("sub-"))
    person = participant_person(options, number)
    trial = simulate_trial(
        person,
        task,
        generator(options, number, MOVEMENT, task),
        options.durations_s.get(task, MOVEMENTS[task][1]),
        0.3,
        wobbling(person),
    )
    stem = f"{name}_task-{task}_run-{options.run}"
    file = out / name / f"{stem}_joint-moments.parquet"
    found = read_artifact(file, "joint-moments")
    rows = []
    for kind in LIMBS:
        for side in "lr":
            true = _true_moments(person, trial, kind, side)
            rows += _compared(found, f"{kind}_{side}", true, trial.time_s, task)
    return rows


def _compared(
    found: pd.DataFrame, joint: str, true: np.ndarray, times_s: np.ndarray, task: str
) -> list[dict]:
    rows = []
    mine = found[(found["joint"] == joint) & found["valid"]]
    axes = list(dict.fromkeys(found.loc[found["joint"] == joint, "axis"]))
    for (method, axis), part in mine.groupby(["method", "axis"]):
        below = gaussian_filter1d(true[:, axes.index(axis)], SIGMA_S / STEP_S)
        course = np.interp(part["time_s"], times_s, below)
        error = part["moment_Nm"].to_numpy() - course
        ratio = np.abs(error) / part["moment_sd_Nm"].to_numpy()
        rows.append(
            {
                "task": task,
                "joint": joint[:-2],
                "method": method,
                "axis": axis,
                "rms_Nm": np.sqrt((error**2).mean()),
                "peak_Nm": np.abs(course).max(),
                "inside_percent": 100 * (ratio < 1.96).mean(),
                "inside_sd": np.sqrt((ratio**2).mean()),
            }
        )
    return rows


def _true_moments(person: Person, trial: Trial, kind: str, side: str) -> np.ndarray:
    """(T, 3) about the axes of the joint."""
    poses, wrench = trial.poses, np.zeros((len(trial.time_s), 6))
    for part in LIMBS[kind]:
        body = f"{part}_{side}"
        inertia, R = person.inertias[body], poses.rotation[body]
        moved = poses.point(body, inertia.com_m), inertia.mass_kg, inertia.tensor_kgm2
        wrench += driving_wrench(R, *moved, GRAVITY, STEP_S)
    if "foot" in LIMBS[kind]:
        wrench -= np.hstack(trial.feet_apart()[side])
    own = f"{LIMBS[kind][0]}_{side}"
    above = "thorax" if kind == "shoulder" else PROXIMAL[kind]
    above = above if above in poses.rotation else f"{above}_{side}"
    moment = wrench[:, 3:] - np.cross(poses.origin_m[own], wrench[:, :3])
    sign = -1.0 if side == "l" else 1.0
    axes = joint_axes(poses.rotation[above], poses.rotation[own], sign)
    return np.einsum("nc,nkc->nk", moment, axes)


if __name__ == "__main__":
    main()
