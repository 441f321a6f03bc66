"""``bsip check``, ``info``, ``published``: what recordings, artifacts and printed papers hold."""

from __future__ import annotations

import json
import platform
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import click
import numpy as np
import pyarrow.parquet as pq

from bsip_cli import __version__
from bsip_cli.artifacts import read_header
from bsip_cli.errors import printable
from bsip_cli.files.regular import check_regular
from bsip_cli.pipeline import producer, stages_named
from bsip_cli.report.words import count
from bsip_cli.running.runner import run_stages
from bsip_cli.running.session import follow, open_study
from bsip_cli.running.unit import Unit, library_versions
from bsip_cli.schemas import SCHEMAS
from bsip_cli.study.study import Participant, Trial

# --- what each recording of a study is taken for, whether it is a person, and what fails ----------


def check_study(
    study: Path, chosen: tuple[str, ...], config_file: Path | None, jobs: int, **voice: bool
) -> int:
    """Read a study's recordings and build each person's skeleton, say what is wrong and what each
    recording is; the exit code of `ingest` and `scale`.

    ``voice`` as `follow` takes it.
    """
    stages = stages_named("ingest") + stages_named("scale")
    with TemporaryDirectory(prefix="bsip-check-") as folder:
        out = Path(folder) / "results"
        opened = open_study(study, out, chosen, config_file)
        running = run_stages(stages, opened.study, out, opened.config, jobs=jobs)
        total = sum(2 + len(person.trials) for person in opened.study.participants)
        code = follow("check", opened.refusals, running, total, None, **voice)
        for person in opened.study.participants:
            unit = Unit(producer("markers"), opened.study, out, opened.config, person)
            for line in _about(unit, person):
                click.echo(printable(line))
    return code


def _about(unit: Unit, person: Participant) -> Iterator[str]:
    stated = [
        {"M": "man", "F": "woman"}.get(person.sex, "sex other or not stated"),
        "mass not stated" if person.mass_kg is None else f"{person.mass_kg:g} kg",
        "height not stated" if person.height_m is None else f"{person.height_m:g} m",
    ]
    yield f"{person.id}: {', '.join(stated)}"
    width = max(len(trial.path.name) for trial in person.trials)
    for trial in person.trials:
        yield f"  {trial.path.name:{width}}  {trial.role:10}  {_trial(unit, trial)}"


def _trial(unit: Unit, trial: Trial) -> str:
    if not unit.stands("contacts", trial, unit.participant):
        return "refused, see above"
    facts, contacts = unit.facts("markers", trial), unit.read("contacts", trial)
    markers, rate_hz = unit.read("markers", trial), facts["marker_rate_hz"]
    seen = markers.loc[np.isfinite(markers["x_m"]), "marker"].nunique()
    plates = sum(name.endswith("_fz_N") for name in unit.read("wrench", trial).columns)
    measured = f"every contact measured for {contacts['valid'].sum() / rate_hz:.1f} s"
    forces = f"{count(plates, 'plate')}, {measured}" if plates else "no forces"
    time = f"{len(contacts) / rate_hz:.1f} s at {rate_hz:g} Hz"
    return f"{time}, {seen} markers ({facts['marker_set']}), {forces}"


# --- what an artifact holds and what made it; without one, the versions that numbers depend on ----


def info(artifact: Path | None) -> Iterator[str]:
    """The lines of the answer.

    BadDataError: the artifact is not there, or is none.
    """
    if artifact is None:
        known = {"bsip": __version__, "python": platform.python_version()} | library_versions()
        yield from (f"{name} {version}" for name, version in known.items())
        return
    check_regular(artifact)
    yield from map(printable, _lines(artifact))


def _lines(path: Path) -> Iterator[str]:
    header = read_header(path)
    kind, provenance = header["kind"], header["provenance"]
    meaning = f": {SCHEMAS[kind].meaning}" if kind in SCHEMAS else ""
    yield f"{path.name}"
    yield f"kind      {kind}, version {header['schema_version']}{meaning}"
    yield f"rows      {pq.read_metadata(path).num_rows}"
    yield from _made(provenance["made_by"], "made by")
    if "amended_by" in provenance:
        yield from _made(provenance["amended_by"], "amended")
    for message in provenance["messages"]:
        yield f"warning   {message}"
    for name, fact in provenance["facts"].items():
        yield f"fact      {name} = {json.dumps(fact, ensure_ascii=False)}"
    yield "columns"
    for field in pq.read_schema(path):
        known = (field.metadata or {}).items()
        notes = {key.decode(errors="replace"): text.decode(errors="replace") for key, text in known}
        where = ", ".join(filter(None, (notes.get("unit"), notes.get("frame"))))
        unit = f" [{where}]" if where else ""
        yield f"  {field.name}{unit}  {notes.get('meaning', '')}".rstrip()


def _made(made_by: dict[str, Any], title: str) -> Iterator[str]:
    known = made_by.get("libraries") or {}
    libraries = ", ".join(f"{name} {version}" for name, version in known.items())
    stage, version = made_by.get("stage", "?"), made_by.get("bsip_version", "?")
    yield f"{title:<9} bsip {stage} {version} with {libraries}"
    for name, digest in (made_by.get("inputs") or {}).items():
        yield f"  input   {name} sha256 {digest}"
    for name, value in (made_by.get("options") or {}).items():
        yield f"  option  {name} = {json.dumps(value, ensure_ascii=False)}"


# --- the papers' tables, and what in them cannot be true ------------------------------------------


def papers(what: str, paper: str | None) -> Iterator[str]:
    """The parts of the answer as Markdown: ``what`` is show or audit; of one paper, or of all.

    UsageError: there is no such paper.
    """
    from bsip_cli.report.tables.model import to_markdown  # heavy, with those below
    from bsip_cli.report.tables.published import audited, printed
    from bsip_cli.statistics.published import load_paper, names

    for one in (load_paper(name) for name in ([paper] if paper else names())):
        if what == "show":
            yield from (to_markdown(printed(one, table)) for table in one.tables)
        elif (slips := audited(one)).rows:
            yield to_markdown(slips)
        else:
            nothing = "nothing in it can be recomputed from what is printed"
            yield f"**{one.name}: {'its numbers agree' if one.is_audited else nothing}.**\n"
