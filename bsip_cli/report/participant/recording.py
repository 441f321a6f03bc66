"""What was recorded: trials, what was repaired or left out, markers."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pandas as pd

from bsip_cli.report.blocks import Block, Bullets, Cell, Grid, Heading, Paragraph, Picture, Section
from bsip_cli.report.figures.bars import marker_bars
from bsip_cli.report.records import ParticipantRecord, TrialRecord, clock_of, flags_of
from bsip_cli.report.words import MISSING, ROLES, count, listing, number, percent
from bsip_cli.report.yardsticks import MARKERS, yardsticks

_MOST_FINDINGS = 10
_MOST_EVENTS = 6
_LEVELS = ("excluded", "warning", "corrected")
_MM = 1000.0


def section(record: ParticipantRecord) -> Section:
    refused = tuple(f"{r.unit or record.id}, {r.stage}: {r.sentence}" for r in record.refusals)
    blocks: list[Block] = [_trials(record)]
    if refused:
        blocks += [Heading("Refused"), Bullets(refused, "warning")]
    blocks += [*_loads(record), *_findings(record), *_markers(record), *_events(record)]
    return Section("recording", "What was recorded?", tuple(blocks))


def _trials(record: ParticipantRecord) -> Grid:
    head = (
        "recording",
        "role",
        "duration [s]",
        "forces compared [%]",
        "pose known [%]",
        "markers [mm]",
    )
    return Grid(
        head,
        tuple(_trial_row(trial) for trial in record.trials),
        "Forces are compared while every foot on the ground stands on a plate. Markers: root mean "
        "square distance from the model.",
        words=2,
    )


def _trial_row(trial: TrialRecord) -> tuple[str | Cell, ...]:
    role = ROLES[trial.role]
    frame = trial.kinematics
    if frame is None or frame.empty:
        return (trial.label, role, MISSING, MISSING, MISSING, MISSING)
    compared = np.nan
    if trial.reconstruction is not None and len(clock_of(trial.reconstruction)):
        compared = float(flags_of(trial.reconstruction, "valid").mean())
    rms = frame["marker_rms_m"].to_numpy(dtype=float)
    rms = rms[np.isfinite(rms)]
    return (
        trial.label,
        role,
        number(float(frame["time_s"].iloc[-1] - frame["time_s"].iloc[0])),
        percent(compared),
        percent(float(frame["determined"].astype(float).mean())),
        number(_MM * float(np.sqrt(np.mean(rms**2)))) if len(rms) else MISSING,
    )


def _loads(record: ParticipantRecord) -> Iterator[Block]:
    """What the person carried as the study says, and what was made of it."""
    trials_of: dict[str, list[str]] = {}
    for trial, words in record.loads:
        trials_of.setdefault(words, []).append(trial)
    if trials_of:
        carried = "; ".join(f"{words} in {listing(trials)}" for words, trials in trials_of.items())
        yield Paragraph(
            f"Known loads, as study.toml states them: {carried}. They are no part of the masses: "
            "their share of the ground forces was computed as of point masses."
        )


def _findings(record: ParticipantRecord) -> Iterator[Block]:
    """What ingest repaired, warned of or left out: one line per check, with its recordings."""
    found: dict[tuple[str, str, str], dict[str, set[str]]] = {}
    for trial in record.trials:
        if trial.quality is not None:
            for row in trial.quality.to_dict("records"):
                if row["level"] in _LEVELS:
                    key = (row["level"], row["check"], row["action"])
                    what = f"{row['subject']} {row['found']}".strip()
                    found.setdefault(key, {}).setdefault(trial.label, set()).add(what)
    order = sorted(found, key=lambda key: _LEVELS.index(key[0]))
    lines = tuple(_line(key, found[key]) for key in order)
    if not lines:
        yield Paragraph("Nothing was repaired, excluded or warned of.")
        return
    yield Heading("Repaired, left out, warned of")
    yield Bullets(lines[:_MOST_FINDINGS])
    if len(lines) > _MOST_FINDINGS:
        more = count(len(lines) - _MOST_FINDINGS, "more finding")
        yield Paragraph(f"{more} in the recordings' quality artifacts.", "note")


def _line(key: tuple[str, str, str], trials: dict[str, set[str]]) -> str:
    level, check, action = key
    told = set().union(*trials.values())
    what = told.pop() if len(told) == 1 else count(len(told), "finding")
    done = f" ({action})" if action else ""
    return f"{check.replace('_', ' ')}, {level}, in {listing(list(trials))}: {what}{done}"


# --- markers ------------------------------------------------------------------------------------


def _markers(record: ParticipantRecord) -> Iterator[Block]:
    frames = [t.residuals for t in record.trials if t.residuals is not None]
    rows = pd.concat(frames) if frames else pd.DataFrame({"marker": [], "residual_m": []})
    squares = rows["residual_m"].astype(float) ** 2
    rms = _MM * squares.groupby(rows["marker"]).mean().dropna().pow(0.5)
    if rms.empty:
        yield Paragraph("No marker residuals are known.", "warning")
        return
    limit = next(y.limit for y in yardsticks(np.nan, np.nan) if y.name == MARKERS)
    far = [f"{name} ({number(rms[name], 0)} mm)" for name in rms.index[rms > limit]]
    yield Heading("Markers")
    yield Picture(
        marker_bars([str(name) for name in rms.index], rms.to_numpy(), limit),
        "marker_residuals",
        "Root mean square distance of each marker from its model, all recordings; the line is the "
        f"limit of {number(limit, 0)} mm.",
        "Bars: distance per marker.",
        "low and even is good. One far above the others has slipped, is exchanged with another, or "
        "sits where the model does not expect it.",
        f"look at {listing(far)}." if far else "nothing: none is beyond the limit.",
        rms.rename("rms_mm").reset_index(),
    )


def _events(record: ParticipantRecord) -> Iterator[Block]:
    """What the inverse kinematics says of single markers; nothing where it was not asked."""
    known = [(trial.label, t) for trial in record.trials if (t := trial.marker_events) is not None]
    lines = [
        f"{label}: {sentence} ({number(_MM * float(size), 0)} mm)"
        for label, table in known
        for sentence, size in zip(table["sentence"], table["size_m"], strict=True)
    ]
    if known and not lines:
        yield Paragraph("No marker jumps, slips, bears another's label or sits wrong.")
    elif lines:
        yield Bullets(tuple(lines[:_MOST_EVENTS]))
        if len(lines) > _MOST_EVENTS:
            yield Paragraph(
                f"{len(lines) - _MOST_EVENTS} more in the trials' marker-events.", "note"
            )
