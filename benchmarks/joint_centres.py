"""How far joint centres lie from the true ones: by the regressions, and after `bsip scale`.

Simulated people with skin that slides and joint centres off the regressions. A joint is compared
where the markers of its parent segment put it (the wrist: of the hand; limbs with two markers: and
the joint above): their places on the model's segment are laid on their true places on the bone.
Along a hinge no movement shows the centre, so that the distance of knee and elbow from their true
axis stands beside.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks.measure import RESULTS, bsip, machine, markdown, write_csv
from bsip_cli.artifacts import read_artifact
from bsip_cli.body.person import Person, rigid_motion
from bsip_cli.body.skeleton import load_skeleton
from bsip_cli.segments import without_side
from bsip_cli.simulate.options import StudyOptions
from bsip_cli.simulate.study import simulate_study
from bsip_cli.stages.frames import person_from

FILE = RESULTS / "joint_centres.csv"
TASKS = ("static", "sequence", "squat")
SKELETON = "hansen2017"
BY = ("regression", "bsip scale")


class Truth:
    """What the simulator knows of a person: joints, hinges and markers, in bsip's segments."""

    def __init__(self, record: Mapping) -> None:
        joints = {name: np.array(place) for name, place in record["joints_in_parent_m"].items()}
        below = joints.pop("tjc") + joints.pop("cjc")  # from the waist to the neck
        self.joints = {"waist": np.zeros(3), "neck": np.zeros(3), **joints}
        self.hinges = {name: np.array(axis) for name, axis in record["hinge_axes"].items()}
        self.markers = {
            label: np.array(one["position_m"]) - (below if one["body"] == "abdomen" else 0.0)
            for label, one in record["markers"].items()
        }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--people", type=int, default=10)
    parser.add_argument("--seed", type=int, default=31)
    parser.add_argument("--sequence-s", type=float, default=60.0)
    parser.add_argument("--write", action="store_true", help=f"into {FILE.name}")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        study = Path(folder, "study")
        durations = {"static": 3.0, "sequence": options.sequence_s, "squat": 8.0}
        simulate_study(
            study,
            StudyOptions(options.people, options.seed, tasks=TASKS, durations_s=durations),
        )
        found = pd.DataFrame(errors_of(study, options.people))
    header, rows = ["joint", "distance [mm]", "joints", *BY], summary(found)
    print(f"machine: {machine()}; {options.people} people\n\n{markdown(header, rows)}")
    if options.write:
        write_csv(FILE, header, rows)


def errors_of(study: Path, people: int) -> Iterator[dict]:
    """Every person's joints by both ways."""
    outs = {"bsip scale": study / "refined", "regression": study / "first"}
    unrefined = study / "unrefined.toml"
    unrefined.write_text("[scale]\niterations = 0\n")
    for name, out in outs.items():
        extra = ("--config", unrefined) if name == "regression" else ()
        for stage in ("ingest", "scale"):
            bsip(stage, study, "--out", out, *extra)
    for number in range(1, people + 1):
        sub = f"sub-{number:02d}"
        truth = Truth(json.loads((study / "truth" / f"{sub}_truth.json").read_text())["person"])
        for name, out in outs.items():
            person = person_of(out / sub, sub)
            yield from rows(sub, name, truth, person)


def person_of(folder: Path, sub: str) -> Person:
    tables = (
        read_artifact(folder / f"{sub}_{kind}.parquet", kind)
        for kind in ("skeleton", "marker-positions")
    )
    return person_from(*tables, load_skeleton(SKELETON))


def rows(sub: str, by: str, truth: Truth, person: Person) -> Iterator[dict]:
    """How far every joint lies from its true place, and from its true axis [mm]."""
    skeleton = person.skeleton
    for i in range(1, len(skeleton.segments)):
        name = skeleton.joints[i]
        if name not in truth.joints:
            continue
        of_hand = name.startswith("wrist")
        segment = i if of_hand else skeleton.parents[i]
        model, true = anchors(person, truth, segment)
        turn, shift = rigid_motion(model, true[None])
        place = -person.origin_in_joint_m[i] if of_hand else person.joint_in_parent_m[i]
        aim = np.zeros(3) if of_hand else truth.joints[name]
        apart = turn[0] @ place + shift[0] - aim
        axis = truth.hinges.get(name, np.zeros(3))
        across = apart - (apart @ axis) * axis
        yield {
            "person": sub,
            "joint": without_side(name),
            "by": by,
            "from the true centre": 1000 * np.linalg.norm(apart),
            "from the true axis": 1000 * np.linalg.norm(across) if axis.any() else np.nan,
        }


def anchors(person: Person, truth: Truth, segment: int) -> tuple[np.ndarray, np.ndarray]:
    """(k, 3) markers of a segment in the model and in truth, with its first joint if two."""
    own = np.flatnonzero(person.marker_segments == segment)
    model = list(person.marker_positions_m[own])
    true = [truth.markers[person.markers[m]] for m in own]
    if len(own) < 3:
        model.append(-person.origin_in_joint_m[segment])
        true.append(np.zeros(3))
    return np.stack(model), np.stack(true)


def summary(found: pd.DataFrame) -> list[list[str]]:
    """Median and 90th percentile of the distances per joint, both sides together."""
    measures = ["from the true centre", "from the true axis"]
    lines = []
    for joint in dict.fromkeys(found["joint"]):
        for measure in measures:
            mine = found[(found["joint"] == joint) & found[measure].notna()]
            if mine.empty:
                continue
            cells = [_cell(mine[mine["by"] == by][measure]) for by in BY]
            lines.append([joint, measure, str(len(mine[mine["by"] == BY[0]])), *cells])
    return lines


def _cell(values: pd.Series) -> str:
    return f"{values.median():.1f} ({values.quantile(0.9):.1f})" if len(values) else "–"


if __name__ == "__main__":
    main()
