"""Report (cohort): one HTML page with the papers' tables and the gain per participant."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import pandas as pd

from bsip_cli.artifacts import file_rows
from bsip_cli.report.blocks import Light
from bsip_cli.report.cohort import record
from bsip_cli.report.cohort.document import SHOWN, cohort_document
from bsip_cli.report.records import HowMade, Origin
from bsip_cli.report.tables.build import build_tables
from bsip_cli.report.words import listing
from bsip_cli.running.unit import Unit
from bsip_cli.schemas import SCHEMAS
from bsip_cli.stages.report import origin_of, refusals_of, write_page
from bsip_cli.statistics.cohort import Criteria
from bsip_cli.statistics.methods import OM, RM
from bsip_cli.study.study import Participant


def run(unit: Unit) -> None:
    document = cohort_document(record_of(unit))
    unit.write("group-report-files", file_rows(unit.out, write_page(unit, document)))


# --- reading ------------------------------------------------------------------------------------


def record_of(unit: Unit) -> record.CohortRecord:
    """Everything that is there of the whole study."""
    facts = unit.facts("values")
    criteria = Criteria(unit.config.stats.alpha, unit.config.stats.equivalence_percent)
    compared = unit.read("comparisons")

    def read(table: str, variable: str) -> pd.DataFrame:
        return unit.read("values", table=[table], variable=[variable])

    choices = {one.id: _read(unit, "choice", one) for one in unit.study.participants}
    # the table's parameters where nothing was chosen
    use = {name: str(rows["use"].iloc[0]) if len(rows) else RM for name, rows in choices.items()}
    errors = record.yardsticks_of(read, use)
    return record.CohortRecord(
        members=tuple(
            _member(unit, person, use[person.id], errors.get(person.id, {}))
            for person in unit.study.participants
        ),
        ratios=record.ratios_of(read),
        tables=build_tables(compared, criteria, facts["fitted_on"], facts["missing"]),
        table_files=tuple(unit.read("tables-files")["file"]),
        missing=tuple(
            f"{gone['sentence']}: not in table{'s' if len(gone['tables']) > 1 else ''} "
            + listing([tag.removeprefix("table") for tag in gone["tables"]])
            for gone in facts["missing"]
        ),
        made=HowMade.of(_origins(unit)),
        defaults=unit.shipped_options(),
        laboratory=unit.read("laboratory") if unit.has("laboratory") else None,
    )


def _read(unit: Unit, kind: str, participant: Participant) -> pd.DataFrame:
    """A participant's table; empty where there is none."""
    there = unit.path(kind, participant=participant).exists()
    return unit.read(kind, participant=participant) if there else pd.DataFrame()


def _member(
    unit: Unit, participant: Participant, use: str, errors: Mapping[str, float]
) -> record.Member:
    has_page = unit.path("report-files", participant=participant).exists()
    facts = unit.facts("report-files", participant=participant) if has_page else {}
    identified = _read(unit, "identification", participant)
    shown = {"person": _read(unit, "person", participant), "identification": identified}
    if len(identified):
        shown["identification"] = identified[identified["method"] == OM]
    first = {
        kind: {name: rows[name].iloc[0] for name in SHOWN[kind]} if len(rows) else None
        for kind, rows in shown.items()
    }
    return record.Member(
        participant.id,
        first["person"],
        first["identification"],
        has_page,
        refusals_of(unit, participant),
        _searched(unit, participant),
        use if errors else "",
        errors,
        Light(**facts["light"]) if has_page else None,
    )


def _searched(unit: Unit, participant: Participant) -> record.Searched | None:
    if not unit.path("overall-diagnosis", participant=participant).exists():
        return None
    diagnosis = unit.read("overall-diagnosis", participant=participant)
    facts = unit.facts("overall-diagnosis", participant=participant)
    return record.searched(participant.id, diagnosis, facts)


def _origins(unit: Unit) -> Iterator[Origin]:
    """Of all that is read; a participant's own facts are no options of the group, and what a
    diagnosis found has its section."""
    for kind in unit.stage.inputs:
        if SCHEMAS[kind].level == "cohort":
            if unit.has(kind):
                yield origin_of(unit.path(kind), "")
        else:
            paths = {p.id: unit.path(kind, participant=p) for p in unit.study.participants}
            for name, path in paths.items():
                if path.exists():
                    origin = origin_of(path, name)
                    origin.options.pop("participant", None)
                    found = kind in ("overall-diagnosis", "report-files")
                    yield replace(origin, messages=()) if found else origin
