"""A table as text: CSV with every number in full precision and one unit per column, LaTeX, Markdown."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from math import isnan

from bsip_cli.report.tables.model import Cell, Column, Row, Table

UNIT_SUFFIXES = {
    "kg": "kg",
    "mm": "mm",
    "m": "m",
    "mm/s": "mm_s",
    "mm2": "mm2",
    "N": "N",
    "N m": "Nm",
    "% body weight": "percent_bw",
    "1": "",
}


def to_csv(table: Table) -> str:
    """Text of the file; a number that is not there is an empty cell."""
    units = tuple(dict.fromkeys(row.unit for row in table.rows))
    names = [name for column in table.columns for name in _names(column, units)]
    stream = io.StringIO()
    writer = csv.DictWriter(stream, names, restval="", lineterminator="\n")
    writer.writeheader()
    for row in table.rows:
        writer.writerow(_cells(table, row))
    return stream.getvalue()


def _names(column: Column, units: tuple[str, ...]) -> list[str]:
    if not column.in_row_unit:
        return list(column.fields)
    return [_with_unit(name, unit) for unit in units for name in column.fields]


def _with_unit(name: str, unit: str) -> str:
    return f"{name}_{UNIT_SUFFIXES[unit]}".rstrip("_")


def _cells(table: Table, row: Row) -> dict[str, str]:
    return {
        _with_unit(name, row.unit) if column.in_row_unit else name: _text(row.values[name])
        for column in table.columns
        for name in column.fields
    }


def _text(value: Cell) -> str:
    if isinstance(value, float):
        return "" if isnan(value) else repr(float(value))
    return str(value)


_SIGNS = {
    "\\": r"\textbackslash{}",
    "{": r"\{",
    "}": r"\}",
    "&": r"\&",
    "%": r"\%",
    "$": r"\$",
    "#": r"\#",
    "_": r"\_",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
    "²": r"\textsuperscript{2}",
    "†": r"\dag{}",
    "–": "--",
    "×": r"$\times$",
    "−": "$-$",
    "\n": " ",
}


def to_latex(table: Table) -> str:
    """A float that is no wider than the page, its notes below it."""
    columns = table.printed_columns()
    lines = [
        r"\begin{table}[htbp]",
        r"\centering",
        rf"\caption{{{escape_latex(table.title)}}}",
        rf"\label{{tab:{table.name}}}",
        r"\resizebox{\ifdim\width>\textwidth\textwidth\else\width\fi}{!}{%",
        rf"\begin{{tabular}}{{{''.join('l' if c.text else 'r' for c in columns)}}}",
        r"\toprule",
        _latex_line([escape_latex(column.heading) for column in columns]),
        r"\midrule",
        *_latex_body(table),
        r"\bottomrule",
        r"\end{tabular}}",
        *_latex_notes(table.notes),
        r"\end{table}",
    ]
    return "\n".join(lines) + "\n"


def escape_latex(text: str) -> str:
    """Text in which nothing is a command; a minus before a number becomes a minus."""
    escaped = "".join(_SIGNS.get(sign, sign) for sign in text)
    return re.sub(r"(?<![\w-])-(?=\.?\d)", "$-$", escaped)


def _latex_body(table: Table) -> list[str]:
    width, group, lines = len(table.printed_columns()), "", []
    for row in table.rows:
        if row.group != group:
            if group:
                lines.append(r"\addlinespace")
            group = row.group
            lines.append(rf"\multicolumn{{{width}}}{{l}}{{\textit{{{escape_latex(group)}}}}} \\")
        lines.append(_latex_line([escape_latex(cell) for cell in table.printed_cells(row)]))
    return lines


def _latex_line(cells: Sequence[str]) -> str:
    line = " & ".join(cells) + r" \\"
    return "{}" + line if line.startswith(("*", "[")) else line  # both mean something after \\\\


def _latex_notes(notes: Sequence[str]) -> list[str]:
    if not notes:
        return []
    text = [rf"{escape_latex(note)}\par" for note in notes]
    return [r"\par\medskip", r"\begin{minipage}{\textwidth}\footnotesize", *text, r"\end{minipage}"]


def to_markdown(table: Table) -> str:
    """Title, table with aligned columns, notes."""
    columns = table.printed_columns()
    header = [escape_markdown(column.heading) for column in columns]
    lines = [[escape_markdown(cell) for cell in cells] for cells in _markdown_lines(table)]
    widths = [max(len(line[k]) for line in [header, *lines]) for k in range(len(columns))]
    left = [column.text for column in columns]
    rule = [
        "-" * max(width, 3) if is_left else "-" * (max(width, 3) - 1) + ":"
        for width, is_left in zip(widths, left, strict=True)
    ]
    body = [_markdown_line(header, widths, left), _markdown_line(rule, widths, left)]
    body += [_markdown_line(line, widths, left) for line in lines]
    notes = "".join(f"\n{escape_markdown(note)}\n" for note in table.notes)
    return f"**{escape_markdown(table.title)}**\n\n" + "\n".join(body) + f"\n{notes}"


def escape_markdown(text: str) -> str:
    """Text in which nothing is a sign of Markdown; signs that mean nothing stay as they are."""
    text = re.sub(r"[\\|`]|(?<!\w)_(?=\S)|\*(?=\S)|^[*#>+-](?=\s)", lambda m: "\\" + m[0], text)
    return re.sub(r"<(?=[A-Za-z/!?])", "&lt;", text)


def _markdown_lines(table: Table) -> list[Sequence[str]]:
    """The rows' cells, a line with the group's name before its first row."""
    width, group = len(table.printed_columns()), ""
    lines: list[Sequence[str]] = []
    for row in table.rows:
        if row.group != group:
            group = row.group
            lines.append([group, *[""] * (width - 1)])
        lines.append(table.printed_cells(row))
    return lines


def _markdown_line(cells: Sequence[str], widths: Sequence[int], left: Sequence[bool]) -> str:
    padded = (
        cell.ljust(max(width, 3)) if is_left else cell.rjust(max(width, 3))
        for cell, width, is_left in zip(cells, widths, left, strict=True)
    )
    return "| " + " | ".join(padded) + " |"
