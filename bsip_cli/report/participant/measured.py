"""Section 3: what the recordings hold."""

from __future__ import annotations

import numpy as np

from bsip_cli.report.blocks import Block, Cell, Grid, Heading, Paragraph, Picture, Section
from bsip_cli.report.figures.contact_timeline import ContactTimeline, contact_timeline
from bsip_cli.report.records import ParticipantRecord, TrialRecord
from bsip_cli.report.words import MISSING, ROLES, count, number, percent

_MOST_FINDINGS = 80
_GAPS = "marker_gaps"  # the checks of ingest that are told apart here
_PLATES = "plate"
_LEVELS = ("excluded", "warning", "corrected")
_FLAGS = ("left_on_ground", "right_on_ground", "left_on_plate", "right_on_plate", "valid")


def section(record: ParticipantRecord) -> Section:
    blocks: list[Block] = [
        Paragraph(
            "Forces are compared only while every foot that touches the ground stands on a "
            "plate (the compared share). A frame is usable if its markers fix the pose, and no "
            "end of the trial or gap of the pose lies within 0.1 s."
        ),
        Grid(
            (
                "trial",
                "role",
                "duration [s]",
                "compared [%]",
                "usable [%]",
                "with gaps",
                "samples left open [%]",
                "excluded",
                "warnings",
                "corrected",
            ),
            tuple(_row(trial) for trial in record.trials),
            words=2,
            groups=(("", 5), ("markers", 2), ("findings at ingest", 3)),
        ),
        *_findings(record),
        Heading("Contacts with the ground"),
        Paragraph(
            "Where a foot is low enough that it may touch the ground, and whether it is over a "
            "plate: on purpose rather too long, so that no force beside the plates is overlooked. "
            "These are no gait events.",
            "note",
        ),
        *_timelines(record),
    ]
    return Section("measured", "What was measured", tuple(blocks))


def _row(trial: TrialRecord) -> tuple[str | Cell, ...]:
    levels = list(trial.quality["level"]) if trial.quality is not None else []
    excluded, warned, corrected = (levels.count(level) for level in _LEVELS)
    return (
        trial.label,
        ROLES.get(trial.role, trial.role),
        _duration(trial),
        percent(_share(trial, "contacts", "valid")),
        percent(_share(trial, "kinematics", "determined")),
        _markers_with_gaps(trial),
        _samples_left_open(trial),
        Cell(str(excluded), "warning" if excluded else ""),
        Cell(str(warned), "warning" if warned else ""),
        str(corrected),
    )


def _duration(trial: TrialRecord) -> str:
    frame = trial.contacts if trial.contacts is not None else trial.kinematics
    if frame is None or len(frame) == 0:
        return MISSING
    return number(frame["time_s"].iloc[-1] - frame["time_s"].iloc[0], 1)


def _share(trial: TrialRecord, table: str, flag: str) -> float | None:
    frame = getattr(trial, table)
    return float(frame[flag].mean()) if frame is not None and len(frame) else None


def _markers_with_gaps(trial: TrialRecord) -> str:
    return MISSING if trial.quality is None else str((trial.quality["check"] == _GAPS).sum())


def _samples_left_open(trial: TrialRecord) -> str:
    if trial.residuals is None or len(trial.residuals) == 0:
        return MISSING
    return percent(float(trial.residuals["residual_m"].isna().mean()), 1)


def _findings(record: ParticipantRecord) -> list[Block]:
    rows = [
        (
            trial.label,
            Cell(row["level"], "warning" if row["level"] in _LEVELS[:2] else ""),
            row["check"],
            row["subject"] or MISSING,
            row["found"],
            row["expected"] or MISSING,
            row["action"] or MISSING,
        )
        for level in (*_LEVELS, "info")
        for trial in record.trials
        if trial.quality is not None
        for _, row in trial.quality[trial.quality["level"] == level].iterrows()
        if level != "info" or row["check"].startswith(_PLATES)
    ]
    if not rows:
        return [Paragraph("Nothing had to be corrected or excluded in the recordings.")]
    head = ("trial", "level", "check", "subject", "found", "expected", "done")
    blocks: list[Block] = [Grid(head, tuple(rows[:_MOST_FINDINGS]), "Findings at ingest", words=7)]
    if len(rows) > _MOST_FINDINGS:
        blocks.append(
            Paragraph(
                f"{count(len(rows) - _MOST_FINDINGS, 'more finding')} in the quality tables.",
                "note",
            )
        )
    return blocks


def _timelines(record: ParticipantRecord) -> list[Block]:
    blocks: list[Block] = []
    for trial in record.trials:
        if trial.contacts is None or len(trial.contacts) < 2:
            blocks.append(Paragraph(f"{trial.label}: no contacts are known.", "note"))
            continue
        flags = {name: trial.contacts[name].to_numpy(dtype=bool) for name in _FLAGS}
        data = ContactTimeline(time_s=trial.contacts["time_s"].to_numpy(), **flags)
        if not any(flags[name].any() for name in _FLAGS):
            blocks.append(Paragraph(f"{trial.label}: no foot touches the ground.", "note"))
            continue
        blocks.append(
            Picture(
                contact_timeline(data),
                f"{trial.label}: {_in_words(data)}",
                f"Bars over time: contacts of both feet in {trial.label}.",
            )
        )
    return blocks


def _in_words(data: ContactTimeline) -> str:
    beside = (data.left_on_ground & ~data.left_on_plate) | (
        data.right_on_ground & ~data.right_on_plate
    )
    return (
        f"forces compared over {percent(float(np.mean(data.valid)))} % of the time; in "
        f"{percent(float(np.mean(beside)))} % a foot stands beside the plates."
    )
