"""What bsip makes of real recordings: marker residuals, and errors of RM and OM.

    python -m benchmarks.recordings DATA --write

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

from benchmarks.measure import RESULTS, markdown, write_csv
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
    parser.add_argument("--write", action="store_true", help="into docs/results")
    arguments = parser.parse_args()
    for name, rows in tables(arguments.data).items():
        header = list(rows[0]) if rows else []
        cells = [list(row.values()) for row in rows]
        print(markdown(header, cells) if rows else "No recordings were found.", end="\n\n")
        if arguments.write and rows:
            write_csv(RESULTS / f"{name}.csv", header, cells)


def tables(data: Path) -> dict[str, list[dict[str, str]]]:
    """By file name a table of markers and one of forces."""
    markers: list[dict[str, str]] = []
    forces: list[dict[str, str]] = []
    with tempfile.TemporaryDirectory() as scratch:
        for k, source in enumerate(STUDIES):
            study = Path(scratch) / f"study{k}"
            if not make_study(study, data, source):
                continue
            out = run(study)
            markers += marker_rows(source.name, out)
            forces += force_rows(source.name, out)
    return {"real_markers": markers, "real_forces": forces}


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


if __name__ == "__main__":
    main()
