"""Cohort: the papers' six tables, and the published values beside them, as CSV, Markdown and LaTeX.

Reads values, comparisons. Writes OUT/group/tables/*, tables-files.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

import pandas as pd

from bsip_cli.artifacts import write_atomically
from bsip_cli.report.tables.build import RENDERERS, build_tables, folder
from bsip_cli.running.unit import Unit
from bsip_cli.statistics.cohort import Criteria


def run(unit: Unit) -> None:
    options = unit.config.stats
    facts = unit.facts("values")
    tables = build_tables(
        unit.read("comparisons"),
        Criteria(options.alpha, options.equivalence_percent),
        facts["fitted_on"],
        facts["missing"],
    )
    written = []
    for table in tables:
        for ending, render in RENDERERS.items():
            path = folder(unit.out) / f"{table.name}.{ending}"
            text = render(table)
            _write(path, text)
            file = path.relative_to(unit.out).as_posix()
            written.append({"file": file, "sha256": hashlib.sha256(text.encode()).hexdigest()})
    unit.write("tables-files", pd.DataFrame(written))


def _write(path: Path, text: str) -> None:
    write_atomically(path, lambda temporary: temporary.write_bytes(text.encode()))
