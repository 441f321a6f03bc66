"""How far estimates lie from the truth of simulated people, and the forces that follow from them.

Import ``measure`` before this.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pandas as pd

from bsip_cli.body.inertia import from_readable
from bsip_cli.config import load_config
from bsip_cli.pipeline import STAGES
from bsip_cli.running.unit import Unit
from bsip_cli.schemas import bsip_names
from bsip_cli.stages import reconstruct
from bsip_cli.study.study import load_study

TRUTH = "true parameters"
_QUANTILE = 1.96
_NAMES = list(bsip_names())
_GROUPS = {"masses": slice(0, 1), "centres of mass": slice(1, 4), "tensors": slice(4, 10)}


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
                    "segment": row["segment"].removesuffix("_l").removesuffix("_r"),
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
        truth = pd.DataFrame(
            [{"method": TRUTH, "segment": name, **dict(zip(_NAMES, values, strict=True))}
             for name, values in segments.items()]
        )  # fmt: skip
        for trial in participant.trials:
            if trial.task not in tasks:
                continue
            unit = WithTruth(stage, found, out, config, participant, trial, truth=truth)
            reconstruct.run(unit)
            fit = unit.kept["fit"].assign(participant=participant.id, task=trial.task)
            parts.append(fit[fit["data"] == "held_out"])
    return pd.concat(parts, ignore_index=True)
