"""The report of one participant: its sections in order."""

from __future__ import annotations

from bsip_cli.report.blocks import Document
from bsip_cli.report.participant import (
    diagnosis,
    forces,
    limits,
    measured,
    motion,
    parameters,
    skeleton,
    summary,
)
from bsip_cli.report.records import ParticipantRecord
from bsip_cli.report.words import WHAT_METHODS_ARE

SECTIONS = (
    summary.section,
    diagnosis.section,
    measured.section,
    motion.section,
    skeleton.section,
    parameters.section,
    forces.section,
    limits.section,
)


def participant_document(record: ParticipantRecord) -> Document:
    return Document(
        title=f"{record.id}: segment inertial parameters and ground forces",
        subtitle=f"{WHAT_METHODS_ARE} this person's own movement and ground forces.",
        sections=tuple(section(record) for section in SECTIONS),
    )
