"""What is left of the ground force after simulation: over time, frequency and loading."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

from bsip_cli.report.blocks import Block, Cell, Grid, Heading, Paragraph, Picture
from bsip_cli.report.diagnosis import candidates_of, causes_of, looked_at
from bsip_cli.report.figures.wrench_residual import WrenchResidual, wrench_residual
from bsip_cli.report.records import (
    EXTENDED,
    ParticipantRecord,
    TrialRecord,
    clock_of,
    flags_of,
    signals_of,
)
from bsip_cli.report.words import component_label, listing, number

BEFORE = "OM"
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
_PHASES = ("least loaded third", "middle third", "most loaded third")
_STANDS_OUT = 1.5  # times the smallest of the phases: worth a mark


def blocks(record: ParticipantRecord) -> list[Block]:
    """The residual of one trial as curves, and of all trials by component and phase."""
    able = [trial for trial in record.trials if trial.role != "static" and _frames(trial) > 1]
    heading = Heading("The residual: measured less simulated")
    if not able:
        return [heading, Paragraph("No trial has a residual to look at.", "note")]
    shown = _shown(record, able)
    return [heading, _curves(shown), _phase_grid(able)]


def _frames(trial: TrialRecord) -> int:
    frame = trial.reconstruction
    if frame is None or BEFORE not in set(frame["method"]):
        return 0
    return int(flags_of(frame, "valid").sum())


def _shown(record: ParticipantRecord, able: Sequence[TrialRecord]) -> TrialRecord:
    """Of the trials that show what was found (else that were diagnosed), the one compared longest."""
    stems: set[str] = set()
    if record.diagnosis is not None:
        causes = causes_of(candidates_of(record.diagnosis))
        stems = {stem for cause in causes for one in cause for stem in one.trials}
    if not stems and record.detection is not None:
        stems = set(looked_at(record.detection))
    concerned = [trial for trial in able if trial.stem in stems]
    return max(concerned or able, key=_frames)


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


def _curves(trial: TrialRecord) -> Picture:
    frame = trial.reconstruction
    assert frame is not None
    residuals = {component_label(c): residuals_of(frame, c) for c in _COLUMNS}
    units = {component_label(c): unit for c, (_, unit, _) in _COLUMNS.items()}
    figure = wrench_residual(WrenchResidual(clock_of(frame), residuals, units))
    is_extended = EXTENDED in set(frame["method"])
    what = f"with OM (before) and with {EXTENDED} (after)" if is_extended else "with OM"
    caption = (
        f"{trial.label}: measured less simulated {what}, over time (left) and as an amplitude "
        "spectrum (right). Noise is a flat, structureless band; slow waves, steps or a peak at the "
        "pace of the movement are structure that something must cause."
    )
    return Picture(figure, caption, "Curves: residual over time and frequency.", "residual")


# --- phases -------------------------------------------------------------------------------------


def phases_of(vertical_force: np.ndarray, valid: np.ndarray) -> np.ndarray:
    """(n,) 0, 1 or 2: the third of the compared frames, by vertical force; -1 elsewhere."""
    known = valid & np.isfinite(vertical_force)
    phase = np.full(len(valid), -1)
    if known.any():
        limits = np.quantile(vertical_force[known], (1 / 3, 2 / 3))
        phase[known] = np.searchsorted(limits, vertical_force[known])
    return phase


def _phase_grid(trials: Sequence[TrialRecord]) -> Grid:
    frames = [trial.reconstruction for trial in trials]
    rows = tuple(
        _phase_row(component, [frame for frame in frames if frame is not None])
        for component in _COLUMNS
    )
    return Grid(
        ("component", "unit", "all", *_PHASES),
        rows,
        f"RMS of the residual with OM over {listing([t.label for t in trials])}, by how hard the "
        "feet press on the ground (thirds of each trial's frames by vertical force)",
        words=2,
    )


def _phase_row(component: str, frames: Sequence[pd.DataFrame]) -> tuple[str | Cell, ...]:
    residual = np.concatenate([residuals_of(frame, component)[BEFORE] for frame in frames])
    phase = np.concatenate(
        [
            phases_of(signals_of(frame, "fz_N")["measured"], flags_of(frame, "valid"))
            for frame in frames
        ]
    )
    by_phase = [_rms(residual[phase == k]) for k in range(len(_PHASES))]
    least = min((x for x in by_phase if np.isfinite(x)), default=np.nan)
    return (
        component_label(component),
        _COLUMNS[component][1],
        number(_rms(residual), 2),
        *(Cell(number(x, 2), "warning" if x > _STANDS_OUT * least else "") for x in by_phase),
    )


def _rms(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else float("nan")
