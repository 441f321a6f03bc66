"""Cohort: the papers' six tables, and the published values beside them, as CSV, Markdown and LaTeX.

Reads values, comparisons. Writes OUT/group/tables/*, tables-files.
"""

from __future__ import annotations

from bsip_cli.artifacts import file_rows, write_bytes
from bsip_cli.report.tables.build import RENDERERS, build_tables, folder
from bsip_cli.running.unit import Unit
from bsip_cli.statistics.cohort import Criteria


def run(unit: Unit) -> None:
    options, facts = unit.config.stats, unit.facts("values")
    criteria, told = Criteria(options.alpha, options.equivalence_percent), unit.read("comparisons")
    files = [
        write_bytes(folder(unit.out) / f"{table.name}.{ending}", render(table).encode())
        for table in build_tables(told, criteria, facts["fitted_on"], facts["missing"])
        for ending, render in RENDERERS.items()
    ]
    unit.write("tables-files", file_rows(unit.out, files))
