"""What is left of the ground force after simulation: over time, frequency and movement."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from bsip_cli.report.blocks import Block, Cell, Grid, Heading, Paragraph, Picture
from bsip_cli.report.candidates import candidates_of, causes_of
from bsip_cli.report.figures.residual_by_phase import ResidualByPhase, residual_by_phase
from bsip_cli.report.figures.wrench_residual import WrenchResidual, wrench_residual
from bsip_cli.report.limits import looked_at
from bsip_cli.report.movement_phases import PHASES, STILL, motion_of, phases_of
from bsip_cli.report.records import (
    ParticipantRecord,
    TrialRecord,
    clock_of,
    flags_of,
    signals_of,
)
from bsip_cli.report.words import EXTENDED, component_label, count, listing, number, percent
from bsip_cli.statistics.methods import OM

BEFORE = OM
_COLUMNS = {
    "fx": ("fx_N", "N", 1.0),
    "fy": ("fy_N", "N", 1.0),
    "fz": ("fz_N", "N", 1.0),
    "mx": ("mx_Nm", "N m", 1.0),
    "my": ("my_Nm", "N m", 1.0),
    "mz": ("mz_Nm", "N m", 1.0),
    "cop_ap": ("cop_ap_m", "mm", 1000.0),
    "cop_ml": ("cop_ml_m", "mm", 1000.0),
}
_AS_LARGE = 0.7  # of the largest phase: in standing still, worth a mark
_LEAST_FRAMES = 10  # of a phase, to be told


def blocks(record: ParticipantRecord) -> list[Block]:
    """The residual of one trial as curves, and of the trials concerned by component and phase."""
    able = [trial for trial in record.trials if trial.role != "static" and _frames(trial) > 1]
    heading = Heading("The residual: measured less simulated")
    if not able:
        return [heading, Paragraph("No trial has a residual to look at.", "note")]
    concerned = _concerned(record, able)
    return [
        heading,
        _curves(max(concerned, key=_relief)),
        Heading("The residual by phase of the movement"),
        *_phases(concerned, record.body_weight()),
    ]


def _frames(trial: TrialRecord) -> int:
    frame = trial.reconstruction
    if frame is None or BEFORE not in set(frame["method"]):
        return 0
    return int(flags_of(frame, "valid").sum())


def _concerned(record: ParticipantRecord, able: Sequence[TrialRecord]) -> list[TrialRecord]:
    """The trials that show what was found, else those that were diagnosed, else all."""
    stems: set[str] = set()
    if record.diagnosis is not None:
        causes = causes_of(candidates_of(record.diagnosis))
        stems = {stem for cause in causes for one in cause for stem in one.trials}
        if not stems and record.detection is not None:
            stems = set(looked_at(record.detection, record.diagnosis))
    return [trial for trial in able if trial.stem in stems] or list(able)


def _relief(trial: TrialRecord) -> tuple[float, int]:
    """By what part the residual falls with the causes, and how long the trial is compared."""
    frame = trial.reconstruction
    assert frame is not None
    falls = []
    for component in _COLUMNS:
        residuals = residuals_of(frame, component)
        before, after = (
            _rms(residuals.get(name, residuals[BEFORE])) for name in (BEFORE, EXTENDED)
        )
        falls.append(1.0 - after / before if before > 0 else 0.0)
    return max(falls), _frames(trial)


def residuals_of(frame: pd.DataFrame, component: str) -> dict[str, np.ndarray]:
    """Method -> measured less simulated (n,) in people's units, NaN where not compared.

    OM, and OM with the causes that were found where that is there.
    """
    column, _, scale = _COLUMNS[component]
    signals, valid = signals_of(frame, column), flags_of(frame, "valid")
    return {
        name: np.where(valid, scale * (signals["measured"] - signals[name]), np.nan)
        for name in (BEFORE, EXTENDED)
        if name in signals
    }


def _labels(names: Sequence[str]) -> dict[str, str]:
    """What the legend calls OM, and OM with the causes."""
    if EXTENDED not in names:
        return {BEFORE: OM}
    return {BEFORE: "before: OM", EXTENDED: "after: OM with the causes found"}


def _curves(trial: TrialRecord) -> Picture:
    frame = trial.reconstruction
    assert frame is not None
    labels = _labels(list(frame["method"].unique()))
    residuals = {
        component_label(c): {labels[m]: v for m, v in residuals_of(frame, c).items()}
        for c in _COLUMNS
    }
    units = {component_label(c): unit for c, (_, unit, _) in _COLUMNS.items()}
    figure = wrench_residual(WrenchResidual(clock_of(frame), residuals, units))
    what = "before and after the causes are in the model" if len(labels) > 1 else "with OM"
    caption = (
        f"{trial.label}: measured less simulated {what}, over time (left) and as an amplitude "
        "spectrum (right). Noise of the plates is a flat, structureless band; that of the markers "
        "grows with frequency, up to the cut-off, and with the speed of the movement. Slow waves, "
        "steps or a peak at the pace of the movement are neither."
    )
    return Picture(figure, caption, "Curves: residual over time and frequency.", "residual")


# --- phases -------------------------------------------------------------------------------------


def _phases(trials: Sequence[TrialRecord], body_weight_N: float) -> list[Block]:
    """A figure and a table over all trials: RMS by component and phase, before and after."""
    parts = [_phase(trial, body_weight_N) for trial in trials]
    phase = np.concatenate(parts)
    shown = [k for k in range(len(PHASES)) if (phase == k).sum() >= _LEAST_FRAMES]
    if not shown:
        return [Paragraph("The phases of the movement are not known.", "note")]
    frames = [trial.reconstruction for trial in trials if trial.reconstruction is not None]
    rms = {c: _rms_by_phase(frames, c, phase, shown) for c in _COLUMNS}
    figure = residual_by_phase(
        ResidualByPhase(
            tuple(PHASES[k] for k in shown),
            {f"{component_label(c)} [{_COLUMNS[c][1]}]": methods for c, methods in rms.items()},
        )
    )
    where = listing([trial.label for trial in trials]) if len(trials) < 4 else ""
    over = where or count(len(trials), "recording")
    caption = (
        f"Root mean square of the residual in each phase of the movement, over {over}. Errors of "
        "the markers and skin grow with acceleration, and are largest in landings. What is as large "
        "in standing still is none of them: an offset, or a plate out of its place."
    )
    return [
        Picture(figure, caption, "Dots: residual by phase.", "residual_phases"),
        _phase_grid(rms, [PHASES[k] for k in shown], over),
    ]


def _phase(trial: TrialRecord, body_weight_N: float) -> np.ndarray:
    frame = trial.reconstruction
    assert frame is not None
    clock, valid = clock_of(frame), flags_of(frame, "valid")
    if trial.kinematics is None:
        return np.full(len(clock), -1)
    pelvis, joints = motion_of(trial.kinematics, clock)
    load = signals_of(frame, "fz_N")["measured"] / body_weight_N
    return phases_of(pelvis, joints, load, valid)


def _rms_by_phase(
    frames: Sequence[pd.DataFrame], component: str, phase: np.ndarray, shown: Sequence[int]
) -> dict[str, np.ndarray]:
    """Label of the method -> RMS (p,); a trial without causes counts as it is."""
    residuals = [residuals_of(frame, component) for frame in frames]
    names = [n for n in (BEFORE, EXTENDED) if any(n in one for one in residuals)]
    labels = _labels(names)
    joined = {n: np.concatenate([one.get(n, one[BEFORE]) for one in residuals]) for n in names}
    return {
        labels[n]: np.array([_rms(values[phase == k]) for k in shown])
        for n, values in joined.items()
    }


def _phase_grid(rms: dict[str, dict[str, np.ndarray]], phases: Sequence[str], over: str) -> Grid:
    rows = tuple(_phase_row(component, methods, phases) for component, methods in rms.items())
    arrow = ", before → after" if any(len(methods) > 1 for methods in rms.values()) else ""
    return Grid(
        ("component", "unit", *phases),
        rows,
        f"RMS of the residual with OM{arrow}, over {over}; marked: standing still, where it is "
        f"{percent(_AS_LARGE)} % of the largest moving phase or more",
        words=2,
    )


def _phase_row(
    component: str, methods: dict[str, np.ndarray], phases: Sequence[str]
) -> tuple[str | Cell, ...]:
    columns = list(zip(*methods.values(), strict=True))
    moving = [column[0] for phase, column in zip(phases, columns, strict=True) if phase != STILL]
    largest = max(moving, default=np.nan)
    return (
        component_label(component),
        _COLUMNS[component][1],
        *(
            Cell(
                " → ".join(number(x, 2) for x in column),
                "warning" if phase == STILL and column[0] >= _AS_LARGE * largest else "",
            )
            for phase, column in zip(phases, columns, strict=True)
        ),
    )


def _rms(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else float("nan")
