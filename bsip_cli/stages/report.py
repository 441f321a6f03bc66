"""Report, of a participant and of the cohort: one HTML page; its figures and numbers as files."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, replace
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from bsip_cli.artifacts import file_rows, is_made_from, read_artifact, read_header, write_bytes
from bsip_cli.report import cohort_record as cohort
from bsip_cli.report import records
from bsip_cli.report.blocks import FILES, Document, Grid, Light, Picture, render
from bsip_cli.report.participant import participant_document
from bsip_cli.report.recordings import (
    large_finding,
    light_for,
    measured_of,
    not_yet,
    use_now,
    use_said,
    use_words,
)
from bsip_cli.report.words import ROLES, listing, trial_label
from bsip_cli.running.unit import Unit
from bsip_cli.schemas import SCHEMAS
from bsip_cli.stages.frames import load_words, person_of
from bsip_cli.statistics.methods import OM
from bsip_cli.study.study import Participant, Trial

# Field of a trial's record: kind of artifact.
_KINDS = ("quality", "kinematics", "marker-events", "reconstruction", "fit", "joint-moments")
_TABLES = {"residuals": "marker-residuals", "joint_peaks": "joint-peaks"}
_TABLES |= {kind.replace("-", "_"): kind for kind in _KINDS}
_DIGITS = "%.6g"  # of a number in a CSV file
# Field of a participant's record: kind that is there only if its stage has run.
_FOUND = {"diagnosis": "overall-diagnosis", "budget": "overall-error-budget"}
_FOUND |= {kind: kind for kind in ("detection", "choice")}


def run(unit: Unit) -> None:
    """Read all of one person; write the page, its figures and their numbers."""
    record = record_of(unit)
    rows = file_rows(unit.out, write_page(unit, participant_document(record)))
    light = light_for(record)
    unit.say(f"{light.title}. {light.text}".rstrip())
    facts: dict[str, Any] = {"light": asdict(light), "large": large_finding(record)}
    shown = {one.name: size for one, size in measured_of(record).items() if np.isfinite(size)}
    facts |= {"method": use_now(record), "use": f"{use_words(record)}{not_yet(record)}"}
    facts |= {"said": use_said(record), "errors": shown}
    unit.write("report-files", rows, facts=facts)


def write_page(unit: Unit, document: Document) -> list[Path]:
    """The page, its figures, and the numbers behind them."""
    folder = unit.out / (unit.participant.id if unit.participant else "group")
    page = render(document).encode()
    files = [write_bytes(folder / "report.html", page)]
    for block in document.blocks():
        if isinstance(block, Picture):
            files.append(write_bytes(folder / FILES / f"{block.name}.svg", block.svg))
        if isinstance(block, Picture | Grid) and block.data is not None:
            numbers = block.data.to_csv(index=False, float_format=_DIGITS).encode()
            files.append(write_bytes(folder / FILES / f"{block.name}.csv", numbers))
    return files


# --- reading ------------------------------------------------------------------------------------


def record_of(unit: Unit) -> records.ParticipantRecord:
    """Everything that is there of the unit's participant."""
    usable = {kind: set(unit.trials(kind)) for kind in _TABLES.values()}
    trials = sorted(unit.person.trials, key=lambda trial: list(ROLES).index(trial.role))
    person, days = unit.person.id, unit.config.laboratory.recorded_on.items()
    return records.ParticipantRecord(
        id=person,
        facts=unit.read("person").iloc[0],
        outside=unit.facts("regression").get("outside", ""),
        **{kind: unit.read(kind) for kind in ("bsip", "excitation", "identification")},
        body=person_of(unit),
        trials=tuple(_trial_record(unit, trial, usable) for trial in trials),
        refusals=refusals_of(unit, unit.person),
        origins=tuple(_origins(unit, usable)),
        defaults=unit.shipped_options(),
        made_on=date.today().isoformat(),
        recorded_on=tuple(day for name, day in days if name.partition("_ses-")[0] == person),
        loads=tuple((trial_label(t.stem), load_words(unit, t)) for t in trials if unit.loads(t)),
        gains=_extended(unit, "overall-gain"),
        changes=_extended(unit, "bsip-change"),
        **{name: unit.read(kind) for name, kind in _FOUND.items() if unit.has(kind)},
    )


def _extended(unit: Unit, kind: str) -> pd.DataFrame | None:
    """A table of ``extend`` with all causes in the model; None where it has not run on this
    diagnosis."""
    there = unit.has("bsip-change") and unit.has(kind)
    if not there or not is_made_from(unit.path("bsip-change"), unit.path("overall-diagnosis")):
        return None
    return records.with_all_causes(unit.read(kind))


def _trial_record(unit: Unit, trial: Trial, usable: dict[str, set[Trial]]) -> records.TrialRecord:
    tables = {
        name: unit.read(kind, trial) if trial in usable[kind] else None
        for name, kind in _TABLES.items()
    }
    for name in ("reconstruction", "fit"):
        if (table := tables[name]) is not None:
            tables[name] = records.with_all_causes(table)
    return records.TrialRecord(trial.stem, trial.task, trial.role, **tables)


def refusals_of(unit: Unit, participant: Participant) -> tuple[records.Refusal, ...]:
    """What earlier stages refused of a participant and the trials."""
    found = []
    for path in sorted((unit.out / participant.id).glob("*_refusal-*.parquet")):
        owner = path.name.split("_refusal-")[0]
        label = "" if owner == participant.id else trial_label(owner)
        rows = read_artifact(path, "refusal").to_dict("records")
        found += [records.Refusal(label, x["stage"], x["sentence"]) for x in rows]
    return tuple(one for one in found if one.stage != unit.stage.name)


def _origins(unit: Unit, usable: dict[str, set[Trial]]) -> Iterator[records.Origin]:
    for kind in unit.stage.inputs:
        if SCHEMAS[kind].level == "trial":
            for one in (trial for trial in unit.person.trials if trial in usable[kind]):
                yield origin_of(unit.path(kind, one), trial_label(one.stem))
        elif unit.has(kind):
            yield origin_of(unit.path(kind), "")


def origin_of(path: Path, label: str) -> records.Origin:
    """Provenance of one artifact."""
    provenance = read_header(path)["provenance"]
    made_by = provenance["made_by"]
    known = ("stage", "bsip_version", "libraries", "options", "inputs")
    made = {name: made_by[name] for name in known}
    return records.Origin(label, messages=tuple(provenance["messages"]), **made)


# --- the cohort ---------------------------------------------------------------------------------


def run_group(unit: Unit) -> None:
    """Read all of the study; write the page, its figures and their numbers."""
    from bsip_cli.report.cohort import cohort_document  # heavy

    document = cohort_document(cohort_record_of(unit))
    unit.write("group-report-files", file_rows(unit.out, write_page(unit, document)))


def cohort_record_of(unit: Unit) -> cohort.CohortRecord:
    """Everything that is there of the whole study."""
    from bsip_cli.report.tables.build import build_tables  # heavy
    from bsip_cli.statistics.cohort import Criteria

    facts = unit.facts("values")
    criteria = Criteria(unit.config.stats.alpha, unit.config.stats.equivalence_percent)
    compared = unit.read("comparisons")

    def read(table: str, variable: str) -> pd.DataFrame:
        return unit.read("values", table=[table], variable=[variable])

    return cohort.CohortRecord(
        members=tuple(_member(unit, person) for person in unit.study.participants),
        ratios=cohort.ratios_of(read),
        tables=build_tables(compared, criteria, facts["fitted_on"], facts["missing"]),
        table_files=tuple(unit.read("tables-files")["file"]),
        missing=tuple(
            f"{gone['sentence']}: not in table{'s' if len(gone['tables']) > 1 else ''} "
            + listing([tag.removeprefix("table") for tag in gone["tables"]])
            for gone in facts["missing"]
        ),
        made=records.HowMade.of(_origins_of_all(unit)),
        defaults=unit.shipped_options(),
        laboratory=unit.read("laboratory") if unit.has("laboratory") else None,
    )


def _read(unit: Unit, kind: str, participant: Participant) -> pd.DataFrame:
    there = unit.path(kind, participant=participant).exists()
    return unit.read(kind, participant=participant) if there else pd.DataFrame()


def _facts(unit: Unit, kind: str, participant: Participant) -> dict[str, Any]:
    """Empty where the artifact is not there."""
    there = unit.path(kind, participant=participant).exists()
    return unit.facts(kind, participant=participant) if there else {}


def _member(unit: Unit, participant: Participant) -> cohort.Member:
    identified = _read(unit, "identification", participant)
    if len(identified):
        identified = identified[identified["method"] == OM]
    shown = {"person": _read(unit, "person", participant), "identification": identified}
    first = {
        kind: {name: rows[name].iloc[0] for name in cohort.SHOWN[kind]} if len(rows) else None
        for kind, rows in shown.items()
    }
    searched = None
    if facts := _facts(unit, "overall-diagnosis", participant):
        diagnosis = _read(unit, "overall-diagnosis", participant)
        searched = cohort.searched(participant.id, diagnosis, facts)
    page, refusals = _facts(unit, "report-files", participant), refusals_of(unit, participant)
    light = Light(**page["light"]) if page else None
    known = participant.id, first["person"], first["identification"], bool(page), refusals, searched
    errors = page.get("errors", {})
    return cohort.Member(*known, page["use"] if errors else "", errors, light)


def _origins_of_all(unit: Unit) -> Iterator[records.Origin]:
    """Of all that is read; a participant's own facts are no options of the group, and what a
    diagnosis found has its section."""
    for kind in unit.stage.inputs:
        of_all = SCHEMAS[kind].level == "cohort"
        for one in (None,) if of_all else unit.study.participants:
            path = unit.path(kind, participant=one)
            if unit.has(kind) if of_all else path.exists():
                origin = origin_of(path, one.id if one else "")
                origin.options.pop("participant", None)
                found = kind in ("overall-diagnosis", "report-files")
                yield replace(origin, messages=()) if found else origin
