"""The report of the cohort: its sections in order."""

from __future__ import annotations

from bsip_cli.report.blocks import Document
from bsip_cli.report.cohort import (
    diagnoses,
    gain,
    laboratory,
    limits,
    people,
    published_tables,
    summary,
)
from bsip_cli.report.cohort.record import CohortRecord
from bsip_cli.report.words import WHAT_METHODS_ARE

SECTIONS = (
    summary.section,
    people.section,
    diagnoses.section,
    laboratory.section,
    gain.section,
    published_tables.section,
    limits.section,
)


def cohort_document(record: CohortRecord) -> Document:
    return Document(
        title="Cohort: segment inertial parameters and ground forces",
        subtitle=f"{WHAT_METHODS_ARE} each person's own movement and ground forces.",
        sections=tuple(section(record) for section in SECTIONS),
    )
