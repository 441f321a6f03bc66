"""Sections of a person's report: how large the errors of the forces are, in which recordings and what
makes them; and what identification and named faults change at the joints."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
import pandas as pd

from bsip_cli.report import budget_words, errors
from bsip_cli.report.blocks import Bar, Block, Cell, Grid, Paragraph, Picture, Section, picture
from bsip_cli.report.candidates import Candidate, effects_in
from bsip_cli.report.effect_words import effect_title
from bsip_cli.report.figures.canvas import middle_of_longest
from bsip_cli.report.figures.charts import Panel, curves, error_bars
from bsip_cli.report.records import ParticipantRecord, TrialRecord, clock_of, flags_of, signals_of
from bsip_cli.report.words import (
    COMPONENTS,
    EXTENDED,
    TEXTS,
    component_label,
    count,
    number,
    signed,
)
from bsip_cli.segments import in_words
from bsip_cli.statistics.methods import METHODS, OM, RM, RM_MASS, SAME_WITHIN, is_extended
from bsip_cli.statistics.samples import Z95

_WINDOW_S = 10.0
_PANELS = (  # column, title, to millimetres
    ("fz_N", "vertical force [N]", 1.0),
    ("cop_ap_m", "COP, forward [mm]", 1e3),
    ("cop_ml_m", "COP, to the right [mm]", 1e3),
)
_SHOWN = ("cop_ap", "cop_ml", "grf_vertical")


def section(record: ParticipantRecord) -> Section:
    """Signals over time, what their error is made of, and the error of every recording."""
    blocks = (*_over_time(record), *_budget(record), *_grid(record))
    return Section("errors", "How large are the errors, when, and what makes them?", blocks)


# --- over time ----------------------------------------------------------------------------------


def _over_time(record: ParticipantRecord) -> Iterator[Block]:
    """Of the trial with most compared frames that OM did not see, if any, up to ten seconds of its
    longest interval."""
    own = {trial.stem for trial in record.identification_trials()}
    tables = [(one, t) for one in record.moving_trials() if (t := one.reconstruction) is not None]
    counts = [int(flags_of(table, "valid").sum()) for _, table in tables]
    found = [
        (one.stem not in own, count, one, table)
        for count, (one, table) in zip(counts, tables, strict=True)
        if count > 1
    ]
    if not found:
        yield Paragraph("No recording has forces that could be compared.", "warning")
        return
    *_, trial, table = max(found, key=lambda one: one[:2])
    valid = flags_of(table, "valid")
    window = middle_of_longest(clock_of(table), valid, _WINDOW_S)
    clock = clock_of(table)[window]
    data, panels = {"time_s": clock}, []
    for column, title, scale in _PANELS:
        signals = signals_of(table, column)
        shown = {m: scale * np.where(valid, v, np.nan)[window] for m, v in signals.items()}
        panels.append(Panel(title, clock, shown))
        data |= {f"{column}_{m}": v / scale for m, v in shown.items()}
    seen = flags_of(table, "used")[window].any()
    fitted = "used to identify, which favours OM" if seen else "not used to identify"
    words = {"start": f"{clock[0]:.1f}", "end": f"{clock[-1]:.1f}", "fitted": fitted}
    numbers = pd.DataFrame(data)
    yield picture("forces", curves(panels, 1), numbers, trial=trial.label, **words)


# --- what makes them ----------------------------------------------------------------------------


def _budget(record: ParticipantRecord) -> Iterator[Block]:
    if record.budget is None or record.budget.empty:
        return
    found = effects_in(record.causes)
    bars = []
    for component in COMPONENTS:
        size, unit = budget_words.size_of(record.budget, component)
        if size >= budget_words.LEAST_REPORTED_SIZE:
            name = f"{component_label(component)}, {number(size, 1)} {unit}"
            bars.append(Bar(name, budget_words.pieces(record.budget, component, found)))
    if bars:
        figure = error_bars(bars, budget_words.overall_pieces(record.budget, found))
        yield picture("error_budget", figure, record.budget[record.budget["trial"] == ""])


# --- in figures ---------------------------------------------------------------------------------


def _grid(record: ParticipantRecord) -> Iterator[Block]:
    fits = [(t, t.fit) for t in record.moving_trials() if t.fit is not None]
    gains = [gain for trial, fit in fits for gain in errors.gains_of(trial.label, fit)]
    known = [gain for gain in gains if gain.component in _SHOWN]
    if not known:
        yield Paragraph("No recording could be compared with both methods.", "warning")
        return
    if not any(gain.held_out for gain in gains):
        yield Paragraph(TEXTS["nothing_held_out"], "warning")
    yield from _one_number(record, gains)
    by_trial: dict[str, dict[str, errors.Gain]] = {}
    for gain in known:
        by_trial.setdefault(gain.trial, {})[gain.component] = gain
    rows = []
    for trial, of in by_trial.items():
        used = "" if next(iter(of.values())).held_out else " (identified OM)"
        cells: list[str | Cell] = [f"{trial}{used}"]
        for component in _SHOWN:
            cells += [_cell(of.get(component), method) for method in METHODS]
        rows.append(tuple(cells))
    yield Grid(
        ("recording", *METHODS * len(_SHOWN)),
        tuple(rows),
        "Root-mean-square errors. ✓: smaller than with the other parameters by over "
        f"{100 * SAME_WITHIN:.0f} %.",
        groups=(("", 1), ("COP forward [mm]", 3), ("COP sideways [mm]", 3), ("vertical [% BW]", 3)),
        name="errors",
        data=pd.concat(fit.assign(trial=trial.stem) for trial, fit in fits),
    )


def _cell(gain: errors.Gain | None, method: str) -> Cell:
    if gain is None:
        return Cell(number(None))
    own = gain.of.get(method, np.nan)
    others = [error for name, error in gain.of.items() if name != method]
    return Cell(number(own, 1), "better" if own < min(others) * (1.0 - SAME_WITHIN) else "")


def _one_number(record: ParticipantRecord, gains: list[errors.Gain]) -> Iterator[Block]:
    held_out = [gain for gain in gains if gain.held_out] or gains
    rows = record.identification[record.identification["method"] == RM_MASS]
    of = errors.pooled_errors(held_out, "grf_vertical")
    if len(rows) and RM_MASS in of:
        changes = (of[m] / of[RM] - 1.0 if of[RM] > 0.0 else np.nan for m in (RM_MASS, OM))
        said = errors.one_number_alone(component_label("grf_vertical"), *changes)
        yield Paragraph(f"{said} RM+mass is {RM} times {number(rows['mass_factor'].iloc[0], 3)}.")


# --- what identification and named faults change at the joints: curves and peaks of the moments ---

_LEGS = ("hip", "knee", "ankle")
_ARMS = ("shoulder", "elbow")
_SIDES = ("l", "r")
_LEAST_FRAMES = 10  # of a curve


def joints_section(record: ParticipantRecord) -> Section:
    """Moments of one trial's joints, and the largest changes of all peaks."""
    return Section("joints", "What does it change at the joints?", tuple(_blocks(record)))


def _blocks(record: ParticipantRecord) -> Iterator[Block]:
    trials = [t for t in record.moving_trials() if t.joint_peaks is not None]
    if not trials:
        yield Paragraph("There are no joint moments: run `bsip joints`.", "note")
        return
    trial, joints = _chosen(trials)
    if not joints:
        yield Paragraph("In no recording are the moments of a hip, knee, ankle, shoulder or elbow "
                        f"determined. {_left_out(trials[0])}", "warning")  # fmt: skip
        return
    yield Paragraph(TEXTS["net_moments"])
    yield _picture(trial, joints, record.use())
    for said in largest_changes(all_peaks(trials)):
        yield Paragraph(f"{said}.")
    yield _peaks_grid(trial, joints, trials)
    if left := _left_out(trial):
        yield Paragraph(left, "note")


def _chosen(trials: Sequence[TrialRecord]) -> tuple[TrialRecord, tuple[str, ...]]:
    """The recording in which most is changed at a leg, where no leg is known at an arm, and its
    joints; none where no curve can be drawn."""
    for kinds in (_LEGS, _ARMS):
        names = [f"{kind}_{side}" for kind in kinds for side in _SIDES]
        changes = []
        for trial in trials:
            peaks = trial.joint_peaks
            assert peaks is not None
            asked = peaks["joint"].str.startswith(kinds) & (peaks["frames"] >= _LEAST_FRAMES)
            changes.append(np.nan_to_num(peaks.loc[asked, "change_Nm"].abs().max(), nan=-1.0))
        trial = trials[max(range(len(trials)), key=lambda k: (changes[k], k))]
        peaks = trial.joint_peaks
        assert peaks is not None
        frames = peaks[peaks["method"] == RM].groupby("joint")["frames"].max()
        joints = tuple(one for one in names if frames.get(one, 0) >= _LEAST_FRAMES)
        if joints:
            return trial, joints
    return trials[0], ()


# --- curves -------------------------------------------------------------------------------------


def _picture(trial: TrialRecord, joints: Sequence[str], use: str) -> Picture:
    moments = trial.joint_moments
    assert moments is not None
    rows = moments[moments["joint"].isin(joints)]
    valid = rows["valid"].astype(bool).groupby(rows["time_s"]).any()
    time = valid.index.to_numpy()
    time = time[middle_of_longest(time, valid.to_numpy(), _WINDOW_S)]
    rows = rows[rows["time_s"].between(time[0], time[-1])]
    found = list(dict.fromkeys(rows["method"]))
    methods = [name for name in (RM, OM) if name in found]
    methods += [name for name in found if is_extended(name)][-1:]  # with all named causes
    panels = [_panel(rows, joint, methods) for joint in joints]
    axes = {joint: _axis(rows, joint) for joint in joints}
    data = rows[rows["method"].isin(methods) & (rows["axis"] == rows["joint"].map(axes))]
    columns = ["time_s", "method", "joint", "axis", "moment_Nm", "moment_sd_Nm"]
    figure = curves(panels, 2, 32.0)
    return picture("joint_moments", figure, data[columns], trial=trial.label, use=use)


def _axis(rows: pd.DataFrame, joint: str) -> str:
    """The first: flexion or extension."""
    return str(rows.loc[rows["joint"] == joint, "axis"].iloc[0])


def _panel(rows: pd.DataFrame, joint: str, methods: Sequence[str]) -> Panel:
    axis = _axis(rows, joint)
    mine = rows[(rows["joint"] == joint) & (rows["axis"] == axis)]
    of = {method: mine[mine["method"] == method] for method in methods}
    time = of[methods[0]]["time_s"].to_numpy()
    named = {
        EXTENDED if is_extended(m) else m: own["moment_Nm"].to_numpy() for m, own in of.items()
    }
    spreads = {m: own["moment_sd_Nm"].to_numpy() for m, own in of.items() if m == OM}
    return Panel(f"{in_words(joint)}, {axis.replace('_', ' ')} [N m]", time, named, spreads)


# --- peaks --------------------------------------------------------------------------------------


def all_peaks(trials: Sequence[TrialRecord]) -> pd.DataFrame:
    """Of the trials that have joint moments, with a column ``trial``."""
    return peaks_of((t.stem, t.joint_peaks) for t in trials if t.joint_peaks is not None)


def peaks_of(tables: Iterable[tuple[str, pd.DataFrame]]) -> pd.DataFrame:
    """Of all recordings (stem, ``joint-peaks``), with a column ``trial``."""
    every = [table.assign(trial=stem) for stem, table in tables]
    return pd.concat(every, ignore_index=True) if every else pd.DataFrame()


def largest_changes(peaks: pd.DataFrame) -> Iterator[str]:
    """What identification, and each named fault, changes most: a sentence each."""
    for method, rows in _changed(peaks).groupby("method", sort=False):
        if method == OM or is_extended(str(method)):
            most = rows.iloc[int(rows["change_Nm"].abs().argmax())]
            what = "Identification (OM against RM)"
            if method != OM:
                what = f"The {effect_title(str(method).rpartition('+')[2])}"
            yield (
                f"{what} changes {in_words(most['joint'])} {most['axis'].replace('_', ' ')} most, "
                f"by {signed(most['change_Nm'], 1)} N m, {number(most['change_percent'], 0)} % of "
                "that joint's peak"
            )


def moment_change(
    cause: Sequence[Candidate], causes: Sequence[Sequence[Candidate]], peaks: pd.DataFrame
) -> str:
    """What a named fault changes most at the joints, in a clause; empty where it is not known, or
    not known of it alone. ``causes``: all that was found; ``peaks``: of all recordings."""
    one = cause[0]
    alike = [c for other in causes for c in other if c.effect == one.effect]
    if len(cause) > 1 or any(c != one and {*c.trials} & {*one.trials} for c in alike):
        return ""
    known = _changed(peaks)
    is_of_it = known["method"].str.endswith(f"+{one.effect}")
    rows = known[is_of_it & known["trial"].isin(one.trials)]
    if rows.empty:
        return ""
    most = rows.iloc[int(rows["change_Nm"].abs().argmax())]
    percent = most["change_percent"]
    if rows["change_percent"].max() < 1.0:
        return "joint moments change under 1 %"
    return (
        f"changes the {in_words(most['joint'])}'s moment by "
        f"{number(percent, 0 if percent >= 1.0 else 1)} % of its peak"
    )


def _changed(peaks: pd.DataFrame) -> pd.DataFrame:
    """Rows of known changes at joints of legs and arms."""
    if peaks.empty:
        return pd.DataFrame(columns=["method", "trial"], dtype=str)
    asked = peaks["joint"].str.rpartition("_")[0].isin((*_LEGS, *_ARMS))
    return peaks[asked & peaks["change_Nm"].notna() & peaks["compared_with"].ne("")]


def _peaks_grid(trial: TrialRecord, joints: Sequence[str], trials: Sequence[TrialRecord]) -> Grid:
    peaks = trial.joint_peaks
    assert peaks is not None
    faults = [name for name in dict.fromkeys(peaks["method"]) if is_extended(name)]
    rows = []
    for joint in joints:
        axis = _axis(peaks, joint)
        of_axis = peaks[(peaks["joint"] == joint) & (peaks["axis"] == axis)].to_dict("records")
        mine = {row["method"]: row for row in of_axis}
        own = mine.get(OM) or mine[RM]
        changes = (mine[name] for name in (OM, *faults) if name in mine)
        cells = (
            f"{in_words(joint)} {axis.replace('_', ' ')}",
            f"{number(own['peak_Nm'], 1)} ± {number(Z95 * own['peak_sd_Nm'], 1)}",
            number(own["peak_Nm_kg"], 2),
            number(own["peak_at_s"], 2),
            *(f"{signed(c['change_Nm'], 1)} ({number(c['change_percent'], 0)})" for c in changes),
        )
        rows.append(cells)
    names = [f"{effect_title(name.rpartition('+')[2])} [N m (%)]" for name in faults]
    return Grid(
        ("joint", "peak, OM [N m]", "[N m/kg]", "at [s]", "OM − RM [N m (%)]", *names),
        tuple(rows),
        f"Peaks in {trial.label} with 95 % interval; largest change in N m, and in per cent "
        "of the joint's peak. A change beyond the interval matters.",
        name="joint_peaks",
        data=all_peaks(trials),
    )


def _left_out(trial: TrialRecord) -> str:
    """Why moments of the trial are missing, in words; empty where none are."""
    assert trial.joint_peaks is not None
    legs = trial.joint_peaks["joint"].str.startswith(_LEGS)
    reasons = trial.joint_peaks.loc[legs, "left_out"]
    said = dict.fromkeys(text for text in reasons if text)
    if not said:
        return ""
    first, *more = said
    others = f" ({count(len(more), 'other pattern')} in the CSV)" if more else ""
    return f"Left out of {trial.label}: {first}{others}."
