"""How large the errors of the forces are, in which recordings, and what makes them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd

from bsip_cli.report.blocks import Block, Cell, Grid, Paragraph, Picture, Section
from bsip_cli.report.budget import LEAST_TOLD_SIZE, pieces, size_of
from bsip_cli.report.figures.bars import Whole, error_bars
from bsip_cli.report.figures.canvas import middle_of_longest
from bsip_cli.report.figures.curves import Panel, curves
from bsip_cli.report.gains import Gain, gains_of, one_number_alone, pooled_gains, relative_change
from bsip_cli.report.records import ParticipantRecord, TrialRecord, clock_of, flags_of, signals_of
from bsip_cli.report.words import COMPONENTS, component_label, number
from bsip_cli.statistics.methods import METHODS, OM, RM, RM_MASS, SAME_WITHIN

_WINDOW_S = 10.0
_PANELS = (  # column, title, to millimetres
    ("fz_N", "vertical force [N]", 1.0),
    ("cop_ap_m", "COP, forward [mm]", 1e3),
    ("cop_ml_m", "COP, to the right [mm]", 1e3),
)
_SHOWN = ("cop_ap", "cop_ml", "grf_vertical")


def section(record: ParticipantRecord) -> Section:
    blocks = (*_over_time(record), *_budget(record), *_grid(record))
    return Section("errors", "How large are the errors, when, and what makes them?", blocks)


def all_gains(record: ParticipantRecord) -> tuple[Gain, ...]:
    """Of all trials of movement, trial by trial."""
    fits = [(t.label, t.fit) for t in record.moving_trials() if t.fit is not None]
    return tuple(gain for label, fit in fits for gain in gains_of(label, fit))


# --- over time ----------------------------------------------------------------------------------


def _over_time(record: ParticipantRecord) -> Iterator[Block]:
    trial, window = _most_compared(record)
    if trial is None:
        yield Paragraph("No recording has forces that could be compared.", "warning")
        return
    assert trial.reconstruction is not None
    clock = clock_of(trial.reconstruction)[window]
    data, panels = {"time_s": clock}, []
    for column, title, scale in _PANELS:
        signals = signals_of(trial.reconstruction, column)
        valid = flags_of(trial.reconstruction, "valid")
        shown = {m: scale * np.where(valid, v, np.nan)[window] for m, v in signals.items()}
        panels.append(Panel(title, clock, shown))
        data |= {f"{column}_{m}": v / scale for m, v in shown.items()}
    seen = flags_of(trial.reconstruction, "used")[window].any()
    fitted = "used to identify, which favours OM" if seen else "not used to identify"
    yield Picture(
        curves(panels, 1),
        "forces",
        f"{trial.label}: measured (grey) and simulated ground force and centre of pressure (COP), "
        f"{clock[0]:.1f} to {clock[-1]:.1f} s; data {fitted}.",
        "Curves over time: measured and simulated.",
        "the coloured lines should lie on the grey one. A constant distance is a shifted plate or a "
        "wrong mass, a lag is a delay, spikes at contact are smoothing or soft tissue.",
        "where they part, look at the recording at that second.",
        pd.DataFrame(data),
    )


def _most_compared(record: ParticipantRecord) -> tuple[TrialRecord | None, slice]:
    """The trial with most compared frames that OM did not see, if any, and up to ten seconds of its
    longest stretch."""
    own = {trial.stem for trial in record.identification_trials()}
    found = [
        (trial.stem not in own, int(flags_of(trial.reconstruction, "valid").sum()), trial)
        for trial in record.moving_trials()
        if trial.reconstruction is not None and len(trial.reconstruction)
    ]
    found = [one for one in found if one[1] > 1]
    if not found:
        return None, slice(0)
    *_, trial = max(found, key=lambda one: one[:2])
    assert trial.reconstruction is not None
    clock, valid = clock_of(trial.reconstruction), flags_of(trial.reconstruction, "valid")
    return trial, middle_of_longest(clock, valid, _WINDOW_S)


# --- what makes them ----------------------------------------------------------------------------


def _budget(record: ParticipantRecord) -> Iterator[Block]:
    """Component by component, all recordings together."""
    if record.budget is None or record.budget.empty:
        return
    bars = []
    for component in COMPONENTS:
        size, unit = size_of(record.budget, "", component)
        if size >= LEAST_TOLD_SIZE:
            parts = tuple((p.label, p.share) for p in pieces(record.budget, "", component))
            name = f"{component_label(component)}, {number(size, 1)} {unit}"
            bars.append(Whole(name, parts))
    if bars:
        yield Picture(
            error_bars(bars),
            "error_budget",
            "What makes the error of the table's parameters (RM) in each component, and how large it "
            "is, over all recordings.",
            "Bars: shares of the squared error by cause.",
            "little that is hatched (unknown) is good. What stands left of zero makes the error "
            "smaller where it is.",
            "a long bar of segment parameters: use OM. A long hatched bar in a large error: something "
            "is wrong that has no name here.",
            record.budget,
        )


# --- in figures ---------------------------------------------------------------------------------


def _grid(record: ParticipantRecord) -> Iterator[Block]:
    gains = all_gains(record)
    known = [gain for gain in gains if gain.component in _SHOWN]
    if not known:
        yield Paragraph("No recording could be compared with both methods.", "warning")
        return
    if not any(gain.held_out for gain in gains):
        yield Paragraph(
            "No data were held out: these errors are of the very data that identified the "
            "parameters, and favour OM.",
            "warning",
        )
    yield from _one_number(record, gains)
    by_trial: dict[str, dict[str, Gain]] = {}
    for gain in known:
        by_trial.setdefault(gain.trial, {})[gain.component] = gain
    rows = []
    for trial, of in by_trial.items():
        used = "" if next(iter(of.values())).held_out else " (identified OM)"
        cells: list[str | Cell] = [f"{trial}{used}"]
        for component in _SHOWN:
            cells += [_cell(of.get(component), method) for method in METHODS]
        rows.append(tuple(cells))
    fits = [t.fit.assign(trial=t.stem) for t in record.moving_trials() if t.fit is not None]
    yield Grid(
        ("recording", *METHODS * len(_SHOWN)),
        tuple(rows),
        "Root-mean-square errors. ✓: smaller than with the other parameters by over "
        f"{100 * SAME_WITHIN:.0f} %.",
        groups=(("", 1), ("COP forward [mm]", 3), ("COP sideways [mm]", 3), ("vertical [% BW]", 3)),
        name="errors",
        data=pd.concat(fits),
    )


def _cell(gain: Gain | None, method: str) -> Cell:
    """The error, marked where it is smaller than those of all others."""
    if gain is None:
        return Cell(number(None))
    own = gain.of.get(method, np.nan)
    others = [error for name, error in gain.of.items() if name != method]
    return Cell(number(own, 1), "better" if own < min(others) * (1.0 - SAME_WITHIN) else "")


def _one_number(record: ParticipantRecord, gains: tuple[Gain, ...]) -> Iterator[Block]:
    """What one number for the whole mass is, and does without identification."""
    held_out = [gain for gain in gains if gain.held_out] or list(gains)
    rows = record.identification[record.identification["method"] == RM_MASS]
    found = [m for m in pooled_gains(held_out) if m.component == "grf_vertical" and RM_MASS in m.of]
    if len(rows) and found:
        (mean,) = found
        over = relative_change(mean.of[RM_MASS], mean.of[OM])
        said = one_number_alone(
            component_label(mean.component), mean.change(RM_MASS), mean.change(), over
        )
        yield Paragraph(f"{said} RM+mass is {RM} times {number(rows['mass_factor'].iloc[0], 3)}.")
