"""Report (cohort): one HTML page with the papers' tables and the gain per participant.

Reads values, comparisons, person, identification, tables-files; links to the participants'
reports where report-files are there. Writes group-report-files.
"""

from __future__ import annotations

from typing import Any

from bsip_cli.pipeline import STAGES, producer, stages_named
from bsip_cli.report.cohort.document import cohort_document
from bsip_cli.report.cohort.record import (
    ERROR_TABLES,
    ERROR_VARIABLES,
    CohortRecord,
    Member,
)
from bsip_cli.report.figures.workflow import Step
from bsip_cli.report.page import render
from bsip_cli.report.records import Origin
from bsip_cli.report.tables.build import build_tables
from bsip_cli.report.words import listing
from bsip_cli.schemas import SCHEMAS
from bsip_cli.stages.report import files_frame, origin_of, refusals_of, write_figures, write_text
from bsip_cli.statistics.cohort import Criteria
from bsip_cli.study import Participant
from bsip_cli.unit import Unit


def run(unit: Unit) -> None:
    document = cohort_document(record_of(unit))
    folder = unit.out / "group"
    files = [
        write_text(folder / "report.html", render(document)),
        *write_figures(folder / "figures", document),
    ]
    unit.write("group-report-files", files_frame(unit.out, files))


# --- reading ------------------------------------------------------------------------------------


def record_of(unit: Unit) -> CohortRecord:
    """Everything that is there of the whole study."""
    facts = unit.facts("values")
    options = unit.config.stats
    criteria = Criteria(options.alpha, options.equivalence_percent)
    return CohortRecord(
        members=tuple(_member(unit, participant) for participant in unit.study.participants),
        errors=unit.read("values", table=ERROR_TABLES, variable=ERROR_VARIABLES),
        tables=build_tables(
            unit.read("comparisons"), criteria, facts["fitted_on"], facts["missing"]
        ),
        table_files=tuple(unit.read("tables-files")["file"]),
        missing=tuple(_missing_sentence(gone) for gone in facts["missing"]),
        origins=_origins(unit),
        steps=steps(),
    )


def steps() -> tuple[Step, ...]:
    """The stages of the pipeline, those of one name as one."""
    names = tuple(dict.fromkeys(stage.name for stage in STAGES))
    return tuple(_step(name) for name in names)


def _step(name: str) -> Step:
    stages = stages_named(name)
    before = {producer(kind).name for stage in stages for kind in stage.inputs} - {name}
    levels = tuple(dict.fromkeys(stage.level for stage in stages))
    order = dict.fromkeys(stage.name for stage in STAGES if stage.name in before)
    return Step(name, levels, stages[0].summary, tuple(order))


def _missing_sentence(gone: dict) -> str:
    numbers = [tag.removeprefix("table") for tag in gone["tables"]]
    return f"{gone['sentence']}: not in table{'s' if len(numbers) > 1 else ''} {listing(numbers)}"


def _member(unit: Unit, participant: Participant) -> Member:
    return Member(
        participant.id,
        _first_row(unit, "person", participant),
        _first_row(unit, "identification", participant),
        unit.path("report-files", participant=participant).exists(),
        refusals_of(unit, participant),
    )


def _first_row(unit: Unit, kind: str, participant: Participant) -> dict[str, Any] | None:
    if not unit.path(kind, participant=participant).exists():
        return None
    rows = unit.read(kind, participant=participant).head(1).to_dict("records")
    return {str(name): value for row in rows for name, value in row.items()}


def _origins(unit: Unit) -> tuple[Origin, ...]:
    origins = []
    for kind in unit.stage.reads:
        if SCHEMAS[kind].level == "cohort":
            origins.append(origin_of(unit.path(kind), ""))
        else:
            paths = {p.id: unit.path(kind, participant=p) for p in unit.study.participants}
            origins += [origin_of(path, name) for name, path in paths.items() if path.exists()]
    return tuple(origins)
