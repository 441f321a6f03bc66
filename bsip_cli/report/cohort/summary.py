"""Section 1: what came out, in words."""

from __future__ import annotations

import numpy as np

from bsip_cli.report.blocks import Block, Bullets, Grid, Heading, Paragraph, Section
from bsip_cli.report.cohort import diagnoses
from bsip_cli.report.cohort.record import CohortRecord
from bsip_cli.report.gains import SAME_WITHIN
from bsip_cli.report.words import (
    component_label,
    count,
    listing,
    number,
    percent,
    signed,
)


def section(record: CohortRecord) -> Section:
    done = [m for m in record.members if m.facts is not None and m.identification is not None]
    blocks: list[Block] = [
        Paragraph(
            f"{len(done)} of {count(len(record.members), 'participant')} of the study have "
            "identified parameters."
        ),
        *_missing(record),
        Heading("Is anything wrong in the recordings?"),
        diagnoses.verdict(record),
        Heading("Do the identified parameters follow the forces better?"),
        *_gain(record),
    ]
    return Section("summary", "Summary", tuple(blocks))


def _missing(record: CohortRecord) -> list[Block]:
    sentences = list(record.missing)
    for member in record.members:
        sentences += [
            f"{', '.join(filter(None, (member.id, r.unit)))}, {r.stage} refused: {r.sentence}"
            for r in member.refusals
        ]
        if member.identification is None and not any(member.id in s for s in sentences):
            sentences.append(f"{member.id} has no identified parameters; no refusal says why.")
    if not sentences:
        return [Paragraph("Nobody is missing from the tables.")]
    return [
        Paragraph("Who is missing, and why:"),
        Bullets(tuple(dict.fromkeys(sentences)), "warning"),
    ]


def _gain(record: CohortRecord) -> list[Block]:
    held_out = record.ratios.held_out
    rows = [_row(component, ratios) for component, ratios in record.ratios.of_component.items()]
    if not rows:
        return [Paragraph("No trial could be compared with both methods.", "warning")]
    blocks: list[Block] = []
    if not held_out:
        blocks.append(
            Paragraph(
                "Nobody has held-out data: these numbers are from the data that "
                "identified the parameters, and favour OM.",
                "warning",
            )
        )
    worse = [row[0] for row in rows if row[1].startswith("+") or int(row[3]) > int(row[2])]
    blocks.append(
        Paragraph(
            "The table (RM) follows better on the whole, or in more participants, in: "
            f"{listing(worse)}.",
            "warning",
        )
        if worse
        else Paragraph(
            "OM follows better in every component, by the typical change and in the number of "
            "participants. Of the centre of pressure and the vertical force, tests with Holm's "
            "correction say what could be chance: under table 4.",
            "good",
        )
    )
    blocks.append(
        Grid(
            ("component", "typical change [%]", "OM better", "RM better", "the same", "all"),
            tuple(rows),
            "Change of the mean error (RMSE) from RM to OM, "
            + ("held-out data" if held_out else "identification data"),
            groups=(("", 2), ("number of participants", 4)),
        )
    )
    blocks.append(
        Paragraph(
            "Typical: the geometric mean of the participants' error ratios. The same: within "
            f"{percent(SAME_WITHIN)} %. Tests stand in the papers' tables.",
            "note",
        )
    )
    return blocks


def _row(component: str, ratios: np.ndarray) -> tuple[str, ...]:
    ratios = ratios[np.isfinite(ratios)]
    better, worse = int((ratios < 1 - SAME_WITHIN).sum()), int((ratios > 1 + SAME_WITHIN).sum())
    typical = 100.0 * (float(np.exp(np.log(ratios).mean())) - 1.0)
    return (
        component_label(component),
        signed(typical),
        str(better),
        str(worse),
        str(len(ratios) - better - worse),
        number(len(ratios), 0),
    )
