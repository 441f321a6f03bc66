"""A table as Markdown that also reads well as plain text."""

from __future__ import annotations

import re
from collections.abc import Sequence

from bsip_cli.report.tables.model import Table


def to_markdown(table: Table) -> str:
    """Title, table with aligned columns, notes."""
    columns = table.printed_columns()
    header = [escape(column.heading) for column in columns]
    lines = [[escape(cell) for cell in cells] for cells in _lines(table)]
    widths = [max(len(line[k]) for line in [header, *lines]) for k in range(len(columns))]
    left = [column.text for column in columns]
    rule = [
        "-" * max(width, 3) if is_left else "-" * (max(width, 3) - 1) + ":"
        for width, is_left in zip(widths, left, strict=True)
    ]
    body = [_line(header, widths, left), _line(rule, widths, left)]
    body += [_line(line, widths, left) for line in lines]
    notes = "".join(f"\n{escape(note)}\n" for note in table.notes)
    return f"**{escape(table.title)}**\n\n" + "\n".join(body) + f"\n{notes}"


def escape(text: str) -> str:
    """Text in which nothing is a sign of Markdown; signs that mean nothing stay as they are."""
    text = re.sub(r"[\\|`]|(?<!\w)_(?=\S)|\*(?=\S)|^[*#>+-](?=\s)", lambda m: "\\" + m[0], text)
    return re.sub(r"<(?=[A-Za-z/!?])", "&lt;", text)


def _lines(table: Table) -> list[Sequence[str]]:
    """The rows' cells, a line with the group's name before its first row."""
    width, group = len(table.printed_columns()), ""
    lines: list[Sequence[str]] = []
    for row in table.rows:
        if row.group != group:
            group = row.group
            lines.append([group, *[""] * (width - 1)])
        lines.append(table.printed_cells(row))
    return lines


def _line(cells: Sequence[str], widths: Sequence[int], left: Sequence[bool]) -> str:
    padded = (
        cell.ljust(max(width, 3)) if is_left else cell.rjust(max(width, 3))
        for cell, width, is_left in zip(cells, widths, left, strict=True)
    )
    return "| " + " | ".join(padded) + " |"
