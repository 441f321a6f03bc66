"""Section 7: how well the forces follow from the motion with either set of parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
import pandas as pd

from bsip_cli.report.blocks import Block, Cell, Grid, Heading, Mark, Paragraph, Picture, Section
from bsip_cli.report.figures.cop_path import CopPath, cop_path
from bsip_cli.report.figures.methods_over_time import MethodsOverTime, methods_over_time
from bsip_cli.report.gains import Gain, gains_of
from bsip_cli.report.records import ParticipantRecord, TrialRecord, clock_of, flags_of, signals_of
from bsip_cli.report.windows import hull_of, middle_of_longest
from bsip_cli.report.words import (
    COMPONENTS,
    component_label,
    method_label,
    method_rank,
    number,
    percent,
    signed,
)
from bsip_cli.statistics.methods import MEASURED, OM, SAME_WITHIN

_WINDOW_S = 10.0
_ROOM_S = 0.2
_THROWS = ("basketball", "throw")
_MM = 1000.0
_DATA = {
    "held_out": "held-out data: the identification had not seen them",
    "identification": "data that were used for identification, which favours OM",
}
_MEASURES = (
    ("rmse", "RMSE", 2),
    ("rmse_percent_bw", "RMSE [% BW]", 2),
    ("pearson_r", "r", 3),
    ("schwer_m", "M", 3),
    ("schwer_p", "P", 3),
    ("schwer_c", "C", 3),
)
_SWAY = (
    ("rms_ap_mm", "RMS AP [mm]"),
    ("rms_ml_mm", "RMS ML [mm]"),
    ("mean_velocity_mm_s", "mean speed [mm/s]"),
    ("sway_length_mm", "path length [mm]"),
    ("ellipse_area_mm2", "95 % ellipse [mm²]"),
    ("duration_s", "duration [s]"),
)


def section(record: ParticipantRecord) -> Section:
    return Section(
        "forces",
        "How well the forces follow",
        (
            Paragraph(
                "The ground force and its centre of pressure (COP) are computed from the motion "
                "alone, with the table's parameters (RM), with the table's times one number "
                "(RM+mass) and with the identified ones (OM), and compared with the plates."
            ),
            *_cop_over_time(record),
            *_vertical_force(record),
            Heading("Errors in every trial and component"),
            *_overview(record),
            *_fit_grids(record),
            Heading("Sway measures of the centre of pressure"),
            *_posturography(record),
        ),
    )


# --- Hansen 2017, Fig. 3 ------------------------------------------------------------------------


def _cop_over_time(record: ParticipantRecord) -> list[Block]:
    trial = _cop_trial(record)
    if trial is None:
        return [
            Paragraph(
                "No trial has a centre of pressure that could be compared, so it is not shown.",
                "warning",
            )
        ]
    frame = trial.reconstruction
    assert frame is not None
    clock, shown = clock_of(frame), _with_cop(frame)
    window = middle_of_longest(clock, shown, _WINDOW_S)
    ap, ml = (_cop_mm(frame, name, shown, window) for name in ("ap", "ml"))
    zero = {"ap": float(np.nanmean(ap[MEASURED])), "ml": float(np.nanmean(ml[MEASURED]))}
    when = f"{trial.label}, {clock[window][0]:.1f} to {clock[window][-1]:.1f} s"
    data = _data_of(flags_of(frame, "used")[window])
    blocks: list[Block] = [Heading(f"Centre of pressure: {when}")]
    for key, values, name, towards in (
        ("ml", ml, "medio-lateral", "right"),
        ("ap", ap, "anterior-posterior", "forward"),
    ):
        signals = {method: v - zero[key] for method, v in values.items()}
        figure = methods_over_time(
            MethodsOverTime(clock[window], signals, f"COP {key.upper()} [mm] (+ {towards})")
        )
        caption = (
            f"COP, {name}, about the measured mean. {_rmse_words(signals, 'mm')} These are {data}."
        )
        blocks.append(Picture(figure, caption, f"Curves: COP {name} over time.", f"fig3_cop_{key}"))
    paths = {m: np.stack([ml[m] - zero["ml"], ap[m] - zero["ap"]], axis=1) for m in ap}
    blocks.append(
        Picture(
            cop_path(CopPath(paths)),
            "The path of the centre of pressure on the "
            "plate over the same time, seen from above, about the measured mean.",
            "Curves: path of the COP from above.",
            "cop_path",
        )
    )
    return blocks


def _cop_trial(record: ParticipantRecord) -> TrialRecord | None:
    """The identification trial, else the one with the longest comparable COP."""
    able = {trial.stem: trial for trial in record.trials if trial.role != "static"}
    length = {stem: _longest_s(trial.reconstruction) for stem, trial in able.items()}
    used = [t.stem for t in record.identification_trials() if length.get(t.stem, 0.0) > 0.0]
    best = max(used or length, key=length.__getitem__, default="")
    return able[best] if length.get(best, 0.0) > 0.0 else None


def _with_cop(frame: pd.DataFrame) -> np.ndarray:
    """Frames in which all contacts are measured and there is a measured COP."""
    ap, ml = (signals_of(frame, f"cop_{name}_m")[MEASURED] for name in ("ap", "ml"))
    return flags_of(frame, "valid") & np.isfinite(ap) & np.isfinite(ml)


def _longest_s(frame: pd.DataFrame | None) -> float:
    """Length [s] of the longest stretch with a COP to compare."""
    if frame is None or len(clock_of(frame)) == 0:
        return 0.0
    clock = clock_of(frame)
    window = middle_of_longest(clock, _with_cop(frame), np.inf)
    return float(clock[window][-1] - clock[window][0]) if window.stop > window.start else 0.0


def _cop_mm(
    frame: pd.DataFrame, name: str, shown: np.ndarray, window: slice
) -> dict[str, np.ndarray]:
    signals = signals_of(frame, f"cop_{name}_m")
    return {m: _MM * np.where(shown, values, np.nan)[window] for m, values in signals.items()}


def _vertical_force(record: ParticipantRecord) -> list[Block]:
    trial = _throw(record)
    if trial is None:
        return [
            Paragraph(
                "There is no validating trial with comparable forces, so the vertical "
                "ground force of a throw is not shown.",
                "note",
            )
        ]
    frame = trial.reconstruction
    assert frame is not None
    clock, valid = clock_of(frame), flags_of(frame, "valid")
    window = hull_of(valid, int(_ROOM_S / np.median(np.diff(clock))))
    scale = 100.0 / record.body_weight()
    signals = {
        m: np.where(valid | (m == MEASURED), scale * v, np.nan)[window]
        for m, v in signals_of(frame, "fz_N").items()
    }
    figure = methods_over_time(MethodsOverTime(clock[window], signals, "vertical force [% BW]"))
    compared = {m: np.where(valid[window], v, np.nan) for m, v in signals.items()}
    caption = (
        f"Vertical ground force in {trial.label}, in percent of body weight. "
        f"{_rmse_words(compared, '% BW')} These are "
        f"{_data_of(flags_of(frame, 'used'))}."
    )
    return [
        Heading(f"Vertical ground force: {trial.label}"),
        Picture(figure, caption, "Curves: vertical force over time.", "fig3_vertical_force"),
    ]


def _throw(record: ParticipantRecord) -> TrialRecord | None:
    """A validating trial with forces: a basketball throw, another throw, else the longest."""
    used = record.identification_trials()
    frames = [
        (trial, _valid_frames(trial))
        for trial in record.trials
        if trial.role == "validation" and trial not in used
    ]
    able = [(trial, frames) for trial, frames in frames if frames > 1]
    for word in _THROWS:
        for trial, _ in able:
            if word in trial.task.lower():
                return trial
    return max(able, key=lambda pair: pair[1])[0] if able else None


def _valid_frames(trial: TrialRecord) -> int:
    frame = trial.reconstruction
    return int(flags_of(frame, "valid").sum()) if frame is not None else 0


def _rmse_words(signals: dict[str, np.ndarray], unit: str) -> str:
    """``RMSE in what is shown: RM 3.2 mm, OM 1.1 mm.``"""
    measured, *methods = signals
    errors = {method: signals[method] - signals[measured] for method in methods}
    errors = {method: error for method, error in errors.items() if np.isfinite(error).any()}
    shared = np.isfinite(list(errors.values())).all(axis=0)
    parts = [
        f"{method} {number(float(np.sqrt(np.mean(error[shared] ** 2))), 2)} {unit}"
        for method, error in errors.items()
        if shared.any()
    ]
    return f"RMSE in what is shown: {', '.join(parts)}." if parts else "No method was simulated."


def _data_of(used: np.ndarray) -> str:
    return _DATA["identification" if used.any() else "held_out"]


# --- fit measures -------------------------------------------------------------------------------


def _overview(record: ParticipantRecord) -> list[Block]:
    fits = [(trial, trial.fit) for trial in record.trials if trial.fit is not None]
    rows = [_overview_row(trial, gains_of(trial.label, fit)) for trial, fit in fits]
    rows = [row for row in rows if row]
    if not rows:
        return [Paragraph("No trial could be compared with both methods.", "warning")]
    head = ("trial", "data", *(component_label(c) for c in COMPONENTS))
    return [
        Paragraph(
            "Change of the error (RMSE) when OM replaces the better of RM and RM+mass, in percent: "
            "below zero OM follows better than both (✓). Changes within "
            f"{percent(SAME_WITHIN)} % count as equal."
        ),
        Grid(
            head, tuple(rows), "Change of RMSE from the better of RM and RM+mass to OM [%]", words=2
        ),
    ]


def _overview_row(trial: TrialRecord, gains: Sequence[Gain]) -> tuple[str | Cell, ...]:
    if not gains:
        return ()
    by_name = {gain.component: gain for gain in gains}
    marks: dict[str, Mark] = {OM: "better", "": ""}
    cells = [
        Cell(signed(100.0 * by_name[c].over_rival()), marks.get(by_name[c].better(), "warning"))
        if c in by_name
        else Cell("–")
        for c in COMPONENTS
    ]
    return (trial.label, "held out" if gains[0].held_out else "identification", *cells)


def _fit_grids(record: ParticipantRecord) -> list[Block]:
    blocks: list[Block] = []
    for trial in record.trials:
        if trial.fit is None or trial.fit.empty:
            blocks.append(Paragraph(f"{trial.label}: the forces were not compared.", "note"))
        else:
            blocks.append(_fit_grid(trial, trial.fit))
    blocks.append(
        Paragraph(
            "r: Pearson's correlation. M, P and C: magnitude, phase and combined error after Sprague "
            "and Geers (0 is perfect). Independent: how many independent samples the correlated frames "
            "are worth. Moments are about the world origin.",
            "note",
        )
    )
    return blocks


def _fit_grid(trial: TrialRecord, fit: pd.DataFrame) -> Grid:
    methods = sorted(fit["method"].unique(), key=method_rank)
    rows = {(row["method"], row["component"]): row for row in fit.to_dict("records")}
    lines: list[tuple[str | Cell, ...]] = []
    for component in (*COMPONENTS, *sorted(set(fit["component"]) - set(COMPONENTS))):
        known = [(m, rows[m, component]) for m in methods if (m, component) in rows]
        columns = [
            _measure_cells([row for _, row in known], column, digits)
            for column, _, digits in _MEASURES
        ]
        for k, (method, row) in enumerate(known):
            name = (component_label(component), str(row["unit"])) if k == 0 else ("", "")
            samples = (number(row["n"], 0), number(row["n_effective"], 0))
            lines.append((*name, method, *(cells[k] for cells in columns), *samples))
    data = _DATA.get(str(fit["data"].iloc[-1]), str(fit["data"].iloc[-1]))
    titles = (title for _, title, _ in _MEASURES)
    head = ("component", "unit", "method", *titles, "samples", "independent")
    return Grid(head, tuple(lines), f"{trial.label}: {data}", words=3)


def _measure_cells(rows: Sequence[Mapping], column: str, digits: int) -> list[Cell]:
    """One cell per method; the best by more than the tolerance is marked."""
    values = [float(row[column]) for row in rows]
    badness: Callable[[float], float] = (lambda v: 1.0 - v) if column == "pearson_r" else abs
    bad = np.array([badness(value) for value in values])
    marks: list[Mark] = [""] * len(values)
    if np.isfinite(bad).sum() > 1:
        best = int(np.nanargmin(bad))
        second = np.nanmin(np.delete(bad, best))
        if bad[best] < second * (1.0 - SAME_WITHIN):
            marks[best] = "better"
    return [Cell(number(v, digits), mark) for v, mark in zip(values, marks, strict=True)]


# --- posturography ------------------------------------------------------------------------------


def _posturography(record: ParticipantRecord) -> list[Block]:
    rows = [
        (trial.label, method_label(row["method"]), *(number(row[column], 1) for column, _ in _SWAY))
        for trial in record.trials
        if trial.posturography is not None
        for _, row in trial.posturography.iterrows()
    ]
    if not rows:
        return [Paragraph("No trial has a centre of pressure to measure sway by.", "note")]
    return [
        Grid(
            ("trial", "from", *(title for _, title in _SWAY)),
            tuple(rows),
            "About the mean of each trial; a good simulation repeats the measured values. While "
            "somebody moves, noise of the markers makes the simulated path too long; in quiet "
            "standing smoothing makes it too short. Trials of a second or two do not describe "
            "anybody's balance",
            words=2,
        )
    ]
