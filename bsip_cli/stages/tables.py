"""Cohort: the papers' six tables, and the published values beside them, as CSV, Markdown and LaTeX.

Reads values, comparisons. Writes OUT/group/tables/*, tables-files.
"""

from __future__ import annotations

from bsip_cli.artifacts import file_rows, write_bytes
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
    files = []
    for table in tables:
        for ending, render in RENDERERS.items():
            path = folder(unit.out) / f"{table.name}.{ending}"
            files.append(write_bytes(path, render(table).encode()))
    unit.write("tables-files", file_rows(unit.out, files))
