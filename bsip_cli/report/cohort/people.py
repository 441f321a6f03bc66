"""Section 2: the participants, one line each, with links to their reports."""

from __future__ import annotations

import numpy as np

from bsip_cli.report.blocks import Cell, Grid, Section
from bsip_cli.report.cohort.record import CohortRecord, Member
from bsip_cli.report.words import MISSING, number, signed, significant, trial_label

SHOWN = {
    "person": ("calibration_trial", "sex", "mass_kg", "plate_mass_kg", "height_m", "marker_rms_m"),
    "identification": ("duration_s", "condition_number"),
}
"""Columns of a participant's artifacts that the section shows."""


def section(record: CohortRecord) -> Section:
    head = (
        "participant",
        "calibrated on",
        "sex",
        "mass [kg]",
        "plates against it [%]",
        "height [m]",
        "marker residual [mm]",
        "identified on [s]",
        "condition number",
        "refusals",
    )
    rows = tuple(_row(member) for member in record.members)
    return Section("people", "Participants", (Grid(head, rows, words=3),))


def _row(member: Member) -> tuple[str | Cell, ...]:
    name = Cell(member.id, link=f"../{member.id}/report.html" if member.has_report else "")
    refusals = Cell(str(len(member.refusals)), "warning" if member.refusals else "")
    if member.facts is None:
        return (name, *[MISSING] * 8, refusals)
    facts = member.facts
    difference = 100.0 * (facts["plate_mass_kg"] / facts["mass_kg"] - 1.0)
    return (
        name,
        trial_label(str(facts["calibration_trial"])),
        str(facts["sex"]),
        number(facts["mass_kg"], 2),
        signed(difference, 1),
        number(facts["height_m"], 2),
        number(1000.0 * facts["marker_rms_m"], 1),
        number(_first(member, "duration_s")),
        significant(_first(member, "condition_number")),
        refusals,
    )


def _first(member: Member, column: str) -> float:
    return float((member.identification or {}).get(column, np.nan))
