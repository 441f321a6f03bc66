"""What bsip makes of real recordings: markers, errors of RM and OM, balance of forces, faults.

    python -m benchmarks.recordings DATA --write

DATA is a folder with the recordings listed in STUDIES; those that are missing are left out. With
--folder studies and results stay there, and only what has changed since is done again.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from benchmarks.measure import RESULTS, bsip, markdown, write_csv
from bsip_cli.statistics.methods import METHODS
from tests.real.figaroh_csv import convert


@dataclass(frozen=True)
class Source:
    """One data set as a study of one person: rows of participants.tsv, options, files.

    fitted, diagnosed : whether it is in the tables of markers and errors, of forces and faults.
    """

    name: str
    person: str  # sex, mass_kg, height_m
    options: str
    files: dict[str, str]  # task: recording, without its ending for TRC with MOT
    fitted: bool = True
    diagnosed: bool = True


_OPENCAP = {
    "static": "opencap_subject4/static1",
    "squats": "opencap_subject4/squats1",
    "dropjump": "opencap_subject4/DJ1",
    "dropjumptwo": "opencap_subject4/DJ2",
    "sitstand": "opencap_subject4/STS1",
    "walking": "opencap_subject4/walking1",
}
_FEW = {task: _OPENCAP[task] for task in ("static", "squats", "sitstand")}
_OF_OPENCAP = (
    "opencap_subject4",
    "M\t62.6\t1.68",
    '[roles]\nsequence = ["squats"]\n[identify]\nhold_out_fraction = 0.4\n',
)
STUDIES = (
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
    Source(*_OF_OPENCAP, _OPENCAP, diagnosed=False),
    Source(*_OF_OPENCAP, _FEW, fitted=False),
    Source(
        "figaroh_human",
        "M\tn/a\tn/a",
        "[identify]\nhold_out_fraction = 0.4\nblock_s = 5.0\n",
        {"sequence": "figaroh_human/Trial03.csv"},
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
        diagnosed=False,
    ),
    Source(
        "return11_static",
        "F\t58.35\t1.60",
        "",
        {"static": "return11_static/c3dfile1.c3d"},
        fitted=False,
    ),
    Source(
        "hamner_other",
        "M\tn/a\tn/a",
        "",
        {"runa": "hamner_other/run200", "runb": "hamner_other/run300"},
        fitted=False,
    ),
    Source(
        "motionanalysis_helenhayes",
        "M\tn/a\tn/a",
        "",
        {"jump": "motionanalysis_helenhayes/Sample_Jump2.c3d"},
        fitted=False,
    ),
)

_FITTING = ("ingest", "scale", "ik", "regress", "identify", "reconstruct")
_DIAGNOSING = ("diagnose", "extend")
_FORCES = ("fx", "fy", "fz", "mx", "my", "mz")
_COMPONENTS = (*_FORCES, "cop_ap", "cop_ml")
_G = 9.81
Row = dict[str, str]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("--folder", type=Path, help="keep studies and results here")
    parser.add_argument("--write", action="store_true", help="into docs/results")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        found = tables(arguments.data, arguments.folder or Path(scratch))
    for name, rows in found.items():
        header, cells = [*rows[0]] if rows else [], [[*row.values()] for row in rows]
        print(f"{name}\n\n{markdown(header, cells) if rows else 'No recordings found.'}\n")
        if arguments.write and rows:
            write_csv(RESULTS / f"{name}.csv", header, cells)


def tables(data: Path, folder: Path) -> dict[str, list[Row]]:
    """By file name: markers, errors of the methods, faults, and the balance of forces."""
    markers, errors, faults, balance = (list[Row]() for _ in range(4))
    for k, source in enumerate(STUDIES):
        study, out = folder / f"study{k}", folder / f"study{k}_out"
        if not make_study(study, data, source):
            continue
        stages = (*_FITTING, *_DIAGNOSING) if source.diagnosed else _FITTING
        said = [line for stage in stages for line in _said(stage, study, out)]
        person = out / "sub-01"
        if source.fitted:
            markers += marker_rows(source.name, person)
            errors += error_rows(source.name, person)
        if source.diagnosed:
            faults += fault_rows(source.name, person, said)
            balance += balance_rows(source.name, person)
    return {
        "real_markers": markers,
        "real_forces": errors,
        "real_diagnosis": faults,
        "real_balance": balance,
    }


def _said(stage: str, study: Path, out: Path) -> list[str]:
    """Run a stage; its warnings."""
    lines = bsip(stage, study, "--out", out).stderr.splitlines()
    return [line for line in lines if line.startswith(f"{stage}:")]


def make_study(study: Path, data: Path, source: Source) -> bool:
    """Write the study; False if a recording is missing."""
    folder = study / "sub-01"
    folder.mkdir(parents=True, exist_ok=True)
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


def _task(trial: str) -> str:
    return trial.partition("_task-")[2]


def marker_rows(name: str, out: Path) -> Iterator[Row]:
    """Marker residuals of each trial [mm]."""
    for path in sorted(out.glob("*_kinematics.parquet")):
        stem = path.name.removesuffix("_kinematics.parquet")
        kinematics = pd.read_parquet(path)
        residuals = pd.read_parquet(out / f"{stem}_marker-residuals.parquet")
        squares = residuals.assign(square=residuals["residual_m"] ** 2).groupby("marker")["square"]
        rms = 1000 * np.sqrt(squares.mean()).sort_values(ascending=False)
        worst = ", ".join(f"{label} {value:.0f}" for label, value in rms.head(3).items())
        yield {
            "data set": name,
            "trial": _task(stem),
            "frames": str(len(kinematics)),
            "with a pose": f"{100 * kinematics['determined'].mean():.0f} %",
            "median marker [mm]": f"{rms.median():.1f}",
            "all markers [mm]": f"{1000 * np.sqrt((residuals['residual_m'] ** 2).mean()):.1f}",
            "worst markers [mm]": worst,
        }


def error_rows(name: str, out: Path) -> Iterator[Row]:
    """RMSE of RM, RM+mass and OM in each trial with measured forces."""
    for path in sorted(out.glob("*_fit.parquet")):
        fit = pd.read_parquet(path)
        if not len(fit) or not (fit["n"] > 0).any():
            continue
        rmse = fit.pivot(index="component", columns="method", values="rmse")
        methods = [method for method in METHODS if method in rmse]
        yield {
            "data set": name,
            "trial": _task(path.name.removesuffix("_fit.parquet")),
            "data": str(fit["data"].iloc[0]).replace("_", " "),
            "samples": str(int(fit["n"].max())),
        } | {c: " / ".join(f"{x:.1f}" for x in rmse.loc[c, methods]) for c in _COMPONENTS}


def balance_rows(name: str, out: Path) -> Iterator[Row]:
    """Mean forces over the frames with every contact measured: measured, and simulated by RM."""
    axes = ["fx_N", "fy_N", "fz_N"]
    for path in sorted(out.glob("*_reconstruction.parquet")):
        table = pd.read_parquet(path)
        table = table[table["valid"]]
        means = table.groupby("method")[axes].mean()
        if "measured" not in means.index:
            continue
        measured = means.loc["measured"]
        simulated = means.loc["RM"] if "RM" in means.index else measured
        times = table.loc[table["method"] == "measured", "time_s"].to_numpy()
        yield {
            "recording": name,
            "trial": _task(path.name.removesuffix("_reconstruction.parquet")),
            "time [s]": f"{len(times) * np.median(np.diff(times)):.1f}",
            **{f"{axis[:2]} [N]": f"{measured[axis]:.1f} / {simulated[axis]:.1f}" for axis in axes},
            "fz / g [kg]": f"{measured['fz_N'] / _G:.2f}",
        }


# --- faults ---------------------------------------------------------------------------------------


def fault_rows(name: str, out: Path, said: list[str]) -> Iterator[Row]:
    """What is named or in a group, each with its size, and what correcting it gains."""

    def row(*cells: str) -> Row:
        return dict(zip(_OF_FAULTS, (name, *cells, *[""] * 6), strict=False))

    file = out / "sub-01_diagnosis.parquet"
    if not file.exists():
        yield row(f"not diagnosed: {said[0] if said else 'no diagnosis'}")
        return
    table = pd.read_parquet(file)
    found = table[(table["verdict"] != "rejected") & (table["effect"] != "none")]
    if found.empty and "no movement can be diagnosed" in " ".join(said):
        yield row("not diagnosed: no trial has motion with every contact on a plate")
    elif found.empty:
        yield row("nothing wrong above the noise")
    alone = found["rank"].astype(str)
    group = found["class_id"].where(found["class_id"].fillna("") != "", alone)
    for _, alike in found.sort_values("rank", kind="stable").groupby(group, sort=False):
        for k, (_, one) in enumerate(alike.groupby("rank")):
            first = one.iloc[0]
            gain, p = first["gain_percent"], first["p_value"]
            yield row(
                "or " * bool(k) + f"`{first['effect']}` {first['target'] or ''}".strip(),
                "; ".join(
                    map(_size, one["parameter"], one["estimate"], one["ci_low"], one["ci_high"])
                ),
                ", ".join(map(_task, first["trials"].split(", "))),
                "" if np.isnan(p) else "> 0.999" if p < 1e-3 else f"{1 - p:.3f}",
                "" if np.isnan(gain) else f"{gain:.1f}",
                "" if k else _gains(out / "sub-01_gain.parquet"),
            )


_OF_FAULTS = (
    "recording",
    "cause",
    "size in SI units (95 % interval)",
    "trials",
    "probability",
    "held-out gain of the diagnosis [%]",
    "held-out gain by `extend`, all causes [%]",
)


def _size(parameter: str, value: float, low: float, high: float) -> str:
    interval = "" if np.isnan(low) or low == high else f" ({low:.3g} to {high:.3g})"
    return f"{parameter} {value:.3g}{interval}"


def _gains(file: Path) -> str:
    """Of each component, by all causes together: they come last."""
    if not file.exists():
        return ""
    table = pd.read_parquet(file)
    gains = dict(zip(table["component"], table["gain_percent"], strict=True))
    return ", ".join(f"{c} {gains[c]:+.0f}" for c in _FORCES if c in gains)


if __name__ == "__main__":
    main()
