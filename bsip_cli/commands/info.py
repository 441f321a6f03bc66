"""``bsip info`` and ``bsip published``: versions, what an artifact holds, what is in the papers."""

from __future__ import annotations

import json
import platform
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq

from bsip_cli import __version__
from bsip_cli.artifacts import read_header
from bsip_cli.errors import printable
from bsip_cli.files.regular import check_regular
from bsip_cli.report.tables.model import to_markdown
from bsip_cli.report.tables.published import audited, printed
from bsip_cli.running.unit import library_versions
from bsip_cli.schemas import SCHEMAS
from bsip_cli.statistics.published import load_paper, names


def versions() -> Iterator[str]:
    """A line each for bsip, Python and the libraries that numbers depend on."""
    yield f"bsip {__version__}"
    yield f"python {platform.python_version()}"
    for name, version in library_versions().items():
        yield f"{name} {version}"


def artifact_info(path: Path) -> Iterator[str]:
    """The lines of what an artifact holds and what made it.

    BadDataError: it is not there, or no artifact.
    """
    check_regular(path)
    yield from map(printable, _lines(path))


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


# --- ``bsip published``: the papers' tables, and what in them cannot be true ----------------------


def papers(what: str, paper: str | None) -> Iterator[str]:
    """The parts of the answer as Markdown: ``what`` is show or audit; of one paper, or of all.

    UsageError: there is no such paper.
    """
    for one in (load_paper(name) for name in ([paper] if paper else names())):
        if what == "show":
            yield from (to_markdown(printed(one, table)) for table in one.tables)
        elif (slips := audited(one)).rows:
            yield to_markdown(slips)
        else:
            nothing = "nothing in it can be recomputed from what is printed"
            yield f"**{one.name}: {'its numbers agree' if one.is_audited else nothing}.**\n"
