"""One participant's results as tidy values, from the artifacts that ``stats`` reads."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import hypot
from typing import Any

import pandas as pd

from bsip_cli.statistics.cohort import DATA_SHARE
from bsip_cli.statistics.cohort_correlations import CorrelationRun
from bsip_cli.statistics.cohort_values import DIFFERENCE, Value
from bsip_cli.statistics.methods import MEASURED, METHODS, OM, RM
from bsip_cli.study.study import Participant, Trial

COMPONENTS = ("fx", "fy", "fz", "mx", "my", "mz")
MEASURES = ("rmse", "pearson_r", "schwer_m", "schwer_p", "schwer_c")
"""Columns of ``fit`` in table 5."""

SWAY = {
    "mean_velocity": ("mean_velocity_mm_s", "mm/s"),
    "sway_length": ("sway_length_mm", "mm"),
    "ellipse_area": ("ellipse_area_mm2", "mm2"),
    "rms_ap": ("rms_ap_mm", "mm"),
    "rms_ml": ("rms_ml_mm", "mm"),
    "rms_ap_origin": ("rms_ap_origin_m", "m"),
    "rms_ml_origin": ("rms_ml_origin_m", "m"),
}


@dataclass(frozen=True, eq=False)
class Recording:
    """A trial with what ``reconstruct`` said of it, and its part in this study."""

    trial: Trial
    role: str
    data: str
    frames: dict[str, pd.DataFrame]

    def value(self, table: str, variable: str, method: str, value: float, unit: str) -> Value:
        t = self.trial
        return Value(
            t.participant_id,
            t.stem,
            t.task,
            self.role,
            self.data,
            table,
            variable,
            method,
            float(value),
            unit,
        )


def _rows(frame: pd.DataFrame, *methods: str) -> list[dict[str, Any]]:
    """The rows of these methods as plain dictionaries."""
    return frame[frame["method"].isin(methods)].to_dict("records")  # type: ignore[return-value]


def masses(participant: Participant, bsip: pd.DataFrame) -> Iterator[Value]:
    person = (participant.id, "", "all", "", "", "table1")
    for row in _rows(bsip, *METHODS):
        segment, method = row["segment"], row["method"]
        yield Value(*person, segment, method, row["mass_kg"], "kg")
        if method == OM:
            yield Value(*person, f"{segment}{DATA_SHARE}", OM, row["mass_data_share"], "1")


def centres(participant: Participant, bsip: pd.DataFrame) -> Iterator[Value]:
    """How far OM's centres of mass lie from RM's along the segments, as Robert 2017's table 1."""
    along = bsip.pivot_table(index="segment", columns="method", values="com_y_m", sort=False)
    if not {OM, RM} <= set(along.columns):
        return
    apart = (along[OM] - along[RM]).abs() * 1000
    summary = {"mean": apart.mean(), "median": apart.median(), "max": apart.max()}
    person = (participant.id, "", "all", "", "", "table6")
    for name, value in (*apart.items(), *summary.items()):
        yield Value(*person, f"com_{name}", DIFFERENCE, float(value), "mm")


def values_of(recording: Recording) -> list[Value]:
    values: list[Value] = []
    if "fit" in recording.frames:
        rows = _rows(recording.frames["fit"], *METHODS)
        fits = {(row["method"], row["component"]): row for row in rows}
        for method in METHODS:
            values += _cop_errors(recording, method, fits)
            values += _force_errors(recording, method, fits)
            values += _residuals(recording, method, fits)
    if "posturography" in recording.frames and recording.role == "sequence":
        values += _sway(recording, recording.frames["posturography"])
    return values


def _cop_errors(recording: Recording, method: str, fits: dict) -> Iterator[Value]:
    if (method, "cop_ap") not in fits or (method, "cop_ml") not in fits:
        return
    ap, ml = fits[method, "cop_ap"], fits[method, "cop_ml"]
    both = hypot(ap["rmse"], ml["rmse"])
    for table in ("table2", "table4") if recording.role == "sequence" else ("table4",):
        yield recording.value(table, "cop_ap", method, ap["rmse"], ap["unit"])
        yield recording.value(table, "cop_ml", method, ml["rmse"], ml["unit"])
    yield recording.value("table4", "cop_error", method, both, ap["unit"])


def _force_errors(recording: Recording, method: str, fits: dict) -> Iterator[Value]:
    if (method, "grf_vertical") in fits:
        percent = fits[method, "grf_vertical"]["rmse_percent_bw"]
        yield recording.value("table4", "grf_vertical", method, percent, "% body weight")
    for component in COMPONENTS:
        row = fits.get((method, component))
        if row is None:
            continue
        for measure in MEASURES:
            unit = row["unit"] if measure == "rmse" else "1"
            yield recording.value("table5", f"{component}_{measure}", method, row[measure], unit)


def _residuals(recording: Recording, method: str, fits: dict) -> Iterator[Value]:
    """Root mean square of the force's and the moment's error as vectors."""
    if recording.role != "sequence" or any((method, c) not in fits for c in COMPONENTS):
        return
    errors = {c: fits[method, c]["rmse"] for c in COMPONENTS}
    force, moment = (hypot(*(errors[f"{kind}{axis}"] for axis in "xyz")) for kind in "fm")
    yield recording.value("table6", "force_residual", method, force, "N")
    yield recording.value("table6", "moment_residual", method, moment, "N m")


def _sway(recording: Recording, frame: pd.DataFrame) -> Iterator[Value]:
    for row in _rows(frame, MEASURED, *METHODS):
        for variable, (column, unit) in SWAY.items():
            yield recording.value("table3", variable, row["method"], row[column], unit)


def correlations(recording: Recording) -> Iterator[CorrelationRun]:
    trial, frame = recording.trial, recording.frames.get("correlation-difference")
    if frame is None:
        return
    for row in frame.to_dict("records"):
        if row["component"] not in COMPONENTS or {row["method_a"], row["method_b"]} != {OM, RM}:
            continue
        om, rm = ("r_a", "r_b") if row["method_a"] == OM else ("r_b", "r_a")
        yield CorrelationRun(
            trial.participant_id,
            trial.stem,
            trial.task,
            recording.role,
            row["component"],
            row[om],
            row[rm],
            row["r_ab"],
            row["n_effective"],
        )
