"""Section 6: the papers' six tables with their legends."""

from __future__ import annotations

from pathlib import PurePosixPath

from bsip_cli.report.blocks import Block, Cell, Grid, Heading, Paragraph, Section
from bsip_cli.report.cohort.record import CohortRecord
from bsip_cli.report.tables.model import Table


def section(record: CohortRecord) -> Section:
    blocks: list[Block] = []
    for table in record.tables:
        blocks += [Heading(table.title), *_grid(table)]
        blocks += [Paragraph(note, "note") for note in table.notes]
    if not record.tables:
        blocks.append(Paragraph("No tables were made.", "warning"))
    if record.table_files:
        rows = tuple(
            (Cell(PurePosixPath(file).name, link=f"../{file}"),) for file in record.table_files
        )
        blocks += [Heading("The tables as files"), Grid(("file",), rows)]
    return Section("tables", "The papers' tables", tuple(blocks))


def _grid(table: Table) -> list[Block]:
    columns = table.printed_columns()
    if not table.rows:
        return [Paragraph("There are no numbers for this table.", "note")]
    words = next((k for k, column in enumerate(columns) if not column.text), len(columns))
    rows: list[tuple[str | Cell, ...]] = []
    group = ""
    for row in table.rows:
        if row.group != group:
            group = row.group
            rows.append((Cell(group, "group"), *[""] * (len(columns) - 1)))
        rows.append(table.printed_cells(row))
    return [Grid(tuple(column.heading for column in columns), tuple(rows), words=max(1, words))]
