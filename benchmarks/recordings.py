"""What bsip makes of real recordings: marker residuals, and errors of RM and OM.

    python -m benchmarks.recordings DATA --write docs/recordings.md

DATA is a folder with the recordings listed in STUDIES; those that are missing are left out.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks.every_recording import SECTION as EVERY
from benchmarks.fuzz import SECTION as FUZZ
from benchmarks.sections import marks, read_section, replace_section
from bsip_cli.statistics.methods import METHODS
from tests.real.figaroh_csv import convert


@dataclass(frozen=True)
class Source:
    """One data set as a study of one person: rows of participants.tsv, options, files."""

    name: str
    person: str  # sex, mass_kg, height_m
    options: str
    files: dict[str, str]  # task: recording, without its ending for TRC with MOT


STUDIES = (
    Source(
        "opencap_subject4",
        "M\t62.6\t1.68",
        '[roles]\nsequence = ["squats"]\n[identify]\nhold_out_fraction = 0.4\n',
        {
            "static": "opencap_subject4/static1",
            "squats": "opencap_subject4/squats1",
            "dropjump": "opencap_subject4/DJ1",
            "dropjumptwo": "opencap_subject4/DJ2",
            "sitstand": "opencap_subject4/STS1",
            "walking": "opencap_subject4/walking1",
        },
    ),
    Source(
        "figaroh_human",
        "M\tn/a\tn/a",
        "[identify]\nhold_out_fraction = 0.4\nblock_s = 5.0\n",
        {"sequence": "figaroh_human/Trial03.csv"},
    ),
    Source(
        "biobuddy_ech",
        "M\tn/a\tn/a",
        "",
        {
            "static": "biobuddy_ech/anat_pose_ECH.c3d",
            "righthip": "biobuddy_ech/right_hip.c3d",
            "rightknee": "biobuddy_ech/right_knee.c3d",
        },
    ),
    Source(
        "btk_pig (Full)",
        "F\t47.5\t1.505",
        "",
        {
            "static": "btk_pig/PiG_Calibration-FlatFoot-Full.c3d",
            "gait": "btk_pig/PiG_Motion-FlatFoot-Full.c3d",
        },
    ),
    Source(
        "btk_pig (Hole)",
        "M\t66.5\t1.79",
        "",
        {
            "static": "btk_pig/PiG_Calibration-FlatFoot-Hole.c3d",
            "gait": "btk_pig/PiG_Motion-FlatFoot-Hole.c3d",
        },
    ),
    Source(
        "ktk_walk_and_serve",
        "M\t80\tn/a",
        "",
        {"serve": "ktk_walk_and_serve/kinematics_tennis_serve.c3d"},
    ),
)

_STAGES = ("ingest", "scale", "ik", "regress", "identify", "reconstruct")
_COMPONENTS = ("fx", "fy", "fz", "mx", "my", "mz", "cop_ap", "cop_ml")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("--write", type=Path, help="write the page here instead of printing it")
    arguments = parser.parse_args()
    page = render(arguments.data)
    if arguments.write:
        kept = {name: read_section(arguments.write, name) for name in (EVERY, FUZZ)}
        arguments.write.write_text(page, encoding="utf-8")
        for name, content in kept.items():
            replace_section(arguments.write, name, content)
    else:
        print(page)


def render(data: Path) -> str:
    """The page: a table of markers and one of forces."""
    markers, forces = [], []
    with tempfile.TemporaryDirectory() as scratch:
        for k, source in enumerate(STUDIES):
            study = Path(scratch) / f"study{k}"
            if not make_study(study, data, source):
                continue
            out = run(study)
            markers += marker_rows(source.name, out)
            forces += force_rows(source.name, out)
    marked = {"every": "\n".join(marks(EVERY)), "fuzz": "\n".join(marks(FUZZ))}
    return _PAGE.format(markers=_table(markers), forces=_table(forces), **marked)


def make_study(study: Path, data: Path, source: Source) -> bool:
    """Write the study; False if a recording is missing."""
    folder = study / "sub-01"
    folder.mkdir(parents=True)
    for task, name in source.files.items():
        target = folder / f"sub-01_task-{task}"
        if name.endswith(".csv"):
            pairs = []
            if not (data / name).exists():
                return False
            convert(data / name, target)
        elif name.endswith(".c3d"):
            pairs = [(data / name, target.with_suffix(".c3d"))]
        else:
            pairs = [
                (data / f"{name}.trc", target.with_suffix(".trc")),
                (data / f"{name}_grf.mot", target.with_suffix(".mot")),
            ]
        for recording, copy in pairs:
            if not recording.exists():
                return False
            copy.write_bytes(recording.read_bytes())
    header = "participant_id\tsex\tmass_kg\theight_m"
    (study / "participants.tsv").write_text(f"{header}\nsub-01\t{source.person}\n")
    (study / "study.toml").write_text(source.options)
    return True


def run(study: Path) -> Path:
    """Run the stages up to the reconstruction; return the participant's folder."""
    out = study.with_name(f"{study.name}_out")
    for stage in _STAGES:
        command = [sys.executable, "-m", "bsip_cli", stage, str(study), "--out", str(out)]
        subprocess.run(command, check=False, capture_output=True)
    return out / "sub-01"


def marker_rows(name: str, out: Path) -> list[dict[str, str]]:
    """Marker residuals of each trial [mm]."""
    rows = []
    for path in sorted(out.glob("*_kinematics.parquet")):
        stem = path.name.removesuffix("_kinematics.parquet")
        kinematics = pd.read_parquet(path)
        residuals = pd.read_parquet(out / f"{stem}_marker-residuals.parquet")
        squares = residuals.assign(square=residuals["residual_m"] ** 2).groupby("marker")["square"]
        rms = 1000 * np.sqrt(squares.mean()).sort_values(ascending=False)
        worst = ", ".join(f"{label} {value:.0f}" for label, value in rms.head(3).items())
        rows.append(
            {
                "data set": name,
                "trial": stem.split("task-")[1],
                "frames": str(len(kinematics)),
                "with a pose": f"{100 * kinematics['determined'].mean():.0f} %",
                "median marker [mm]": f"{rms.median():.1f}",
                "all markers [mm]": f"{1000 * np.sqrt((residuals['residual_m'] ** 2).mean()):.1f}",
                "worst markers [mm]": worst,
            }
        )
    return rows


def force_rows(name: str, out: Path) -> list[dict[str, str]]:
    """RMSE of RM, RM+mass and OM in each trial with measured forces."""
    rows = []
    for path in sorted(out.glob("*_fit.parquet")):
        fit = pd.read_parquet(path)
        if not len(fit) or not (fit["n"] > 0).any():
            continue
        rmse = fit.pivot(index="component", columns="method", values="rmse")
        row = {
            "data set": name,
            "trial": path.name.split("task-")[1].removesuffix("_fit.parquet"),
            "data": str(fit["data"].iloc[0]).replace("_", " "),
            "samples": str(int(fit["n"].max())),
        }
        for component in _COMPONENTS:
            values = [f"{rmse.loc[component, m]:.1f}" for m in METHODS if m in rmse]
            row[component] = " / ".join(values)
        rows.append(row)
    return rows


def _table(rows: list[dict[str, str]]) -> str:
    if not rows:
        return "No recordings were found."
    header = list(rows[0])
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    lines += ["| " + " | ".join(row[name] for name in header) + " |" for row in rows]
    return "\n".join(lines)


_PAGE = """# Real recordings

Made by `python -m benchmarks.recordings ../shared/data --write docs/recordings.md`; the last two
tables by scripts of their own. The recordings belong to others and are not part of the project.

## Markers after scaling

Root mean square over frames of the distance of each marker from its model; the median over the
markers, all of them together, and the three worst.

{markers}

In `biobuddy_ech` the knee's and elbow's epicondyles change places between trials. `ik` puts them
right, but the calibration meets them as labelled: they only calibrate there (weight 0.02 in the
marker set), and where the trials disagree their places are a compromise. `figaroh_human`'s right
wrist markers change places at 45.6 s and are put right too. The fingertip markers of
`biobuddy_ech` (RFT3, LFT3) sit on fingers, which the hand does not carry rigidly. Acromion markers
stand out in `opencap_subject4` and `figaroh_human`: the shoulder girdle moves, and this skeleton
has none.

## Forces and centre of pressure: RM / RM+mass / OM

RMSE in N, N m and mm. `held out`: data that did not identify OM.

{forces}

What is odd in them, and not the inertial parameters' fault: in the one-leg trials of `biobuddy_ech`
both hands hold a rail that bears 4 kg (see the [diagnosis](diagnosis_of_recordings.md)), so OM,
identified from them, misses the static weight; the plates of `opencap_subject4` read 4 % under the
stated mass in all trials but walking.

## Every recording

Made by `python -m benchmarks.every_recording ../shared/data --write docs/recordings.md`: each file
alone, before a marker set is chosen and before unloaded plates are zeroed. `bsip` is the mean
vertical force of all plates over g, `alone` the same frames as ezc3d's extraction has them (TRC and
CSV: the vertical columns) without any correction. `standing` are the frames of the longest calm
stretch of at least 0.8 s; `all` is every usable frame of a trial without one, which is no mass.

{every}

What is left open. `edge_nimble/JH_01`: reversed, plate 1 presses, inside its outline; but both
loads rise and fall together, which a person who shifts weight cannot do, and its centre of pressure
is 0.42 m from the nearest foot. As recorded, the sum stays within 0.6 N: a zero lost by about
1100 N explains all of it, a wrong sign does not. The file does not tell the zero, so the plate
stays reversed, with a warning. Three plates of `TYPE-3.c3d` pull in the samples of
FORCE_PLATFORM:ZERO, and differ by that baseline. `type1.C3D`, `kyowadengyo.c3d` and `evart.c3d`
hold other counts than ezc3d takes from their parameters; the forces of the first two (up to 732 and
787 N, under the feet) bear the header out, those of the third are volts without a calibration.

## Damaged files

Made by `python -m benchmarks.fuzz --data ../shared/data --write docs/recordings.md`: bytes flipped,
emptied, moved and cut, words set to extremes, text cells and lines mangled. `refused`: in words;
`said`: read, with a warning that the sound file does not have; `unchanged`: the same numbers.
`silent` would be another number without a word, `bug` a traceback, `died` a killed process (20 s,
or 1.5 GB above the sound file). Numbers count as changed if the median of a marker moves by 2 mm,
of a wrench by 1 %, or any by far; digits of a participant's mass or height in a table of good form
are the user's word.

{fuzz}
"""


if __name__ == "__main__":
    main()
