"""Section 8: what cannot be known, what went wrong, and with which options and versions."""

from __future__ import annotations

from bsip_cli.report.blocks import Block, Bullets, Heading, Paragraph, Section
from bsip_cli.report.origins import HowMade, options_grids
from bsip_cli.report.records import ParticipantRecord, messages

CANNOT_KNOW = (
    "A mass behind a spherical joint never enters the ground force on its own, only together with "
    "the parameters of its neighbour. Each segment's mass is therefore the identified combination "
    "plus a rule that splits it: nearness to the table. Read every mass with its data share.",
    "The frames of a recording are not independent of each other. Standard deviations and counts "
    "of independent samples allow for it; the number of frames would promise far too much.",
    "The model has rigid segments and ideal joints. Soft tissue, breathing, a spine that bends in "
    "several places and, in a skeleton without clavicles, a moving shoulder girdle end up in the "
    "parameters or in the residual.",
    "An error that is the same in all trials (a heavier plate reading, something carried) can hide "
    "in the identified parameters without making the forces follow worse.",
    "Where the ground force is small the centre of pressure is a quotient of small numbers; it is "
    "computed above a least force only.",
    "Whether OM is better than RM and RM+mass is judged on data that OM has not seen; on one person and few "
    "trials a difference of a few percent may be chance. The cohort's report tests it.",
)


def section(record: ParticipantRecord) -> Section:
    blocks: list[Block] = [
        Bullets(CANNOT_KNOW),
        Heading("Refused"),
        *_refused(record),
        Heading("Warnings"),
        *_warned(record),
        *options_grids(HowMade.of(record.origins)),
    ]
    return Section("limits", "Limits, warnings, options", tuple(blocks))


def _refused(record: ParticipantRecord) -> list[Block]:
    if not record.refusals:
        return [Paragraph("Nothing was refused.")]
    said = (f"{r.unit or record.id}, {r.stage}: {r.sentence}" for r in record.refusals)
    return [Bullets(tuple(said), "warning")]


def _warned(record: ParticipantRecord) -> list[Block]:
    said = messages(record.origins)
    if not said:
        return [Paragraph("No stage had anything to warn of.")]
    return [
        Bullets(
            tuple(f"{stage}{f' ({unit})' if unit else ''}: {text}" for stage, unit, text in said),
            "warning",
        )
    ]
