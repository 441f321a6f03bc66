"""What identification and named faults change at the joints: curves and peaks of net moments."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
import pandas as pd

from bsip_cli.report.blocks import Block, Grid, Paragraph, Picture, picture
from bsip_cli.report.causes import Candidate, effect_title
from bsip_cli.report.figures.canvas import middle_of_longest
from bsip_cli.report.figures.charts import Panel, curves
from bsip_cli.report.records import ParticipantRecord, TrialRecord
from bsip_cli.report.words import (
    EXTENDED,
    TEXTS,
    count,
    listing,
    number,
    say,
    segment_label,
    signed,
)
from bsip_cli.statistics.methods import OM, RM, is_extended
from bsip_cli.statistics.samples import Z95

_WINDOW_S = 10.0
_LEGS = ("hip", "knee", "ankle")
_ARMS = ("shoulder", "elbow")
_LEAST_FRAMES = 10  # of a curve


def joint_blocks(record: ParticipantRecord) -> Iterator[Block]:
    """Moments of one trial's joints, and the largest changes of all peaks."""
    trials = [t for t in record.moving_trials() if t.joint_peaks is not None]
    if not trials:
        yield Paragraph("There are no joint moments: run `bsip joints`.", "note")
        return
    trial, joints = _chosen(trials)
    if not joints:
        yield Paragraph(f"{TEXTS['no_moments']} {_left_out(trials[0])}", "warning")
        return
    yield Paragraph(TEXTS["net_moments"])
    yield _picture(trial, joints)
    yield from (Paragraph(f"{said}.") for said in largest_changes(all_peaks(trials)))
    yield _peaks_grid(trial, joints, all_peaks(trials))
    if left := _left_out(trial):
        yield Paragraph(left, "note")


def _peaks(trial: TrialRecord) -> pd.DataFrame:
    assert trial.joint_peaks is not None
    return trial.joint_peaks


def _chosen(trials: Sequence[TrialRecord]) -> tuple[TrialRecord, tuple[str, ...]]:
    """The recording in which most is changed at a leg, where no leg is known at an arm, and its
    joints; none where no curve can be drawn."""
    for kinds in (_LEGS, _ARMS):
        changes = []
        for k, peaks in enumerate(map(_peaks, trials)):
            asked = peaks["joint"].str.startswith(kinds) & (peaks["frames"] >= _LEAST_FRAMES)
            change = peaks.loc[asked, "change_Nm"].abs().max()
            changes.append((np.nan_to_num(change, nan=-1.0), k))
        trial = trials[max(changes)[1]]
        peaks = _peaks(trial)
        frames = peaks[peaks["method"] == RM].groupby("joint")["frames"].max()
        names = (f"{kind}_{side}" for kind in kinds for side in "lr")
        if joints := tuple(one for one in names if frames.get(one, 0) >= _LEAST_FRAMES):
            return trial, joints
    return trials[0], ()


def _picture(trial: TrialRecord, joints: Sequence[str]) -> Picture:
    """Of each joint's first axis, flexion or extension."""
    moments = trial.joint_moments
    assert moments is not None
    rows = moments[moments["joint"].isin(joints)]
    valid = rows["valid"].astype(bool).groupby(rows["time_s"]).any()
    time = valid.index.to_numpy()
    time = time[middle_of_longest(time, valid.to_numpy(), _WINDOW_S)]
    rows = rows[rows["time_s"].between(time[0], time[-1])]
    axes = rows.groupby("joint")["axis"].first()
    found = list(dict.fromkeys(rows["method"]))
    methods = [name for name in (RM, OM) if name in found]
    methods += [name for name in found if is_extended(name)][-1:]  # with all named causes
    data = rows[rows["method"].isin(methods) & (rows["axis"] == rows["joint"].map(axes))]
    panels = []
    for joint in joints:
        of = {m: data[(data["joint"] == joint) & (data["method"] == m)] for m in methods}
        named = {
            EXTENDED if is_extended(m) else m: x["moment_Nm"].to_numpy() for m, x in of.items()
        }
        spreads = {m: x["moment_sd_Nm"].to_numpy() for m, x in of.items() if m == OM}
        title = f"{segment_label(joint)}, {axes[joint].replace('_', ' ')} [N m]"
        panels.append(Panel(title, of[methods[0]]["time_s"].to_numpy(), named, spreads))
    columns = ["time_s", "method", "joint", "axis", "moment_Nm", "moment_sd_Nm"]
    figure = curves(panels, 2, 32.0)
    return picture("joint_moments", figure, data[columns], trial=trial.label)


def _peaks_grid(trial: TrialRecord, joints: Sequence[str], every: pd.DataFrame) -> Grid:
    peaks, rows = _peaks(trial), []
    faults = [name for name in dict.fromkeys(peaks["method"]) if is_extended(name)]
    axes = peaks.groupby("joint")["axis"].first()
    for joint in joints:
        of_axis = peaks[(peaks["joint"] == joint) & (peaks["axis"] == axes[joint])]
        mine = {row["method"]: row for row in of_axis.to_dict("records")}
        own = mine.get(OM) or mine[RM]
        changes = (mine[name] for name in (OM, *faults) if name in mine)
        cells = (
            f"{segment_label(joint)} {axes[joint].replace('_', ' ')}",
            f"{number(own['peak_Nm'], 1)} ± {number(Z95 * own['peak_sd_Nm'], 1)}",
            number(own["peak_Nm_kg"], 2),
            number(own["peak_at_s"], 2),
            *(f"{signed(c['change_Nm'], 1)} ({number(c['change_percent'], 0)})" for c in changes),
        )
        rows.append(cells)
    names = [f"{effect_title(name.rpartition('+')[2])} [N m (%)]" for name in faults]
    head = ("joint", "peak, OM [N m]", "[N m/kg]", "at [s]", "OM − RM [N m (%)]", *names)
    caption = TEXTS["captions"]["peaks"].format(trial=trial.label)
    return Grid(head, tuple(rows), caption, name="joint_peaks", data=every)


def _left_out(trial: TrialRecord) -> str:
    """Why moments of the trial are missing, in words; empty where none are."""
    legs = _peaks(trial)["joint"].str.startswith(_LEGS)
    first, *more = dict.fromkeys(filter(None, _peaks(trial).loc[legs, "left_out"])) or [""]
    others = f" ({count(len(more), 'other pattern')} in the CSV)" if more else ""
    return f"Left out of {trial.label}: {first}{others}." if first else ""


# --- changes of the peaks -------------------------------------------------------------------------


def all_peaks(trials: Sequence[TrialRecord]) -> pd.DataFrame:
    """Of the trials that have joint moments, with a column ``trial``."""
    return peaks_of((t.stem, t.joint_peaks) for t in trials if t.joint_peaks is not None)


def peaks_of(tables: Iterable[tuple[str, pd.DataFrame]]) -> pd.DataFrame:
    """Of all recordings (stem, ``joint-peaks``), with a column ``trial``."""
    every = [table.assign(trial=stem) for stem, table in tables]
    return pd.concat(every, ignore_index=True) if every else pd.DataFrame()


def _changed(peaks: pd.DataFrame) -> pd.DataFrame:
    """Rows of known changes at joints of legs and arms, the largest first."""
    if peaks.empty:
        return pd.DataFrame(columns=["method", "trial"], dtype=str)
    asked = peaks["joint"].str.rpartition("_")[0].isin((*_LEGS, *_ARMS))
    known = peaks[asked & peaks["change_Nm"].notna() & peaks["compared_with"].ne("")]
    return known.sort_values("change_Nm", key=lambda x: -x.abs(), kind="stable")


def largest_changes(peaks: pd.DataFrame) -> Iterator[str]:
    """What identification, and each named fault, changes most: a sentence each."""
    order = dict.fromkeys(peaks["method"]) if len(peaks) else ()
    for method in (one for one in order if one == OM or is_extended(one)):
        rows = _changed(peaks).query("method == @method")
        for most in rows.head(1).to_dict("records"):
            fault = "" if method == OM else effect_title(method.rpartition("+")[2])
            yield say("largest_change", fault=fault, most=most)


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
    rows = known[known["method"].str.endswith(f"+{one.effect}") & known["trial"].isin(one.trials)]
    if rows.empty:
        return ""
    if rows["change_percent"].max() < 1.0:  # of joints that are left out nothing is known
        kinds = {joint.rpartition("_")[0] for joint in rows["joint"]}
        shown = [kind for kind in (*_LEGS, *_ARMS) if kind in kinds]
        return f"{listing(shown)} moments change under 1 %"
    most = rows.iloc[0]
    percent = number(most["change_percent"], 0 if most["change_percent"] >= 1.0 else 1)
    return f"changes the {segment_label(most['joint'])}'s moment by {percent} % of its peak"
