"""A table as text: CSV with every number in full precision and one unit per column, LaTeX, Markdown."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Sequence
from math import isnan

from bsip_cli.report.tables.model import Cell, Table

_SUFFIXES = {unit: f"_{unit}" for unit in ("kg", "mm", "m", "mm2", "N")}
_SUFFIXES |= {"mm/s": "_mm_s", "N m": "_Nm", "% body weight": "_percent_bw", "1": ""}
"""Of a unit, behind the names of its columns."""


def to_csv(table: Table) -> str:
    """Text of the file; a number that is not there is an empty cell."""
    units = dict.fromkeys(row.unit for row in table.rows)
    fields = [
        (name, unit)
        for column in table.columns
        for unit in (units if column.in_row_unit else (None,))
        for name in column.fields
    ]
    lines = [
        [_text(row.values[name]) if unit in (None, row.unit) else "" for name, unit in fields]
        for row in table.rows
    ]
    head = [name if unit is None else name + _SUFFIXES[unit] for name, unit in fields]
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows([head, *lines])
    return stream.getvalue()


def _text(value: Cell) -> str:
    if isinstance(value, float):
        return "" if isnan(value) else repr(float(value))
    return str(value)


_NAMED = {"\\": "backslash", "~": "asciitilde", "^": "asciicircum"}
_NAMED |= {"<": "less", ">": "greater", "|": "bar"}
_SIGNS: dict[str | int, str | int | None] = {sign: rf"\{sign}" for sign in "{}&%$#_"}
_SIGNS |= {sign: rf"\text{name}{{}}" for sign, name in _NAMED.items()}
_SIGNS |= {"²": r"\textsuperscript{2}", "†": r"\dag{}", "–": "--", "×": r"$\times$", "−": "$-$"}
_SIGNS |= {"\n": " "}


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
        _latex_line([column.heading for column in columns]),
        r"\midrule",
        *_latex_body(table),
        r"\bottomrule",
        r"\end{tabular}}",
    ]
    if table.notes:
        lines += [r"\par\medskip", r"\begin{minipage}{\textwidth}\footnotesize"]
        lines += [*(rf"{escape_latex(note)}\par" for note in table.notes), r"\end{minipage}"]
    return "\n".join([*lines, r"\end{table}", ""])


def escape_latex(text: str) -> str:
    """Text in which nothing is a command; a minus before a number becomes a minus."""
    return re.sub(r"(?<![\w-])-(?=\.?\d)", "$-$", text.translate(str.maketrans(_SIGNS)))


def _latex_body(table: Table) -> Iterator[str]:
    width = len(table.printed_columns())
    for k, (group, rows) in enumerate(table.printed_groups()):
        if group:
            yield from [r"\addlinespace"] * (k > 0)
            yield rf"\multicolumn{{{width}}}{{l}}{{\textit{{{escape_latex(group)}}}}} \\"
        yield from map(_latex_line, rows)


def _latex_line(cells: Sequence[str]) -> str:
    line = " & ".join(map(escape_latex, cells)) + r" \\"
    return "{}" + line if line.startswith(("*", "[")) else line  # both mean something after \\\\


def to_markdown(table: Table) -> str:
    """Title, table with aligned columns, notes; a line with a group's name before its first row."""
    columns = table.printed_columns()
    lines: list[Sequence[str]] = [[column.heading for column in columns]]
    for group, rows in table.printed_groups():
        lines += [[group, *[""] * (len(columns) - 1)]] if group else []
        lines += rows
    lines = [[escape_markdown(cell) for cell in line] for line in lines]
    widths = [max(3, *map(len, cells)) for cells in zip(*lines, strict=True)]
    ends = [
        "-" * w if c.text else "-" * (w - 1) + ":" for w, c in zip(widths, columns, strict=True)
    ]
    pads = [str.ljust if column.text else str.rjust for column in columns]
    body = "".join(
        f"| {' | '.join(pad(x, w) for pad, x, w in zip(pads, line, widths, strict=True))} |\n"
        for line in (lines[0], ends, *lines[1:])
    )
    notes = "".join(f"\n{escape_markdown(note)}\n" for note in table.notes)
    return f"**{escape_markdown(table.title)}**\n\n{body}{notes}"


def escape_markdown(text: str) -> str:
    """Text in which nothing is a sign of Markdown; signs that mean nothing stay as they are."""
    text = re.sub(r"[\\|`]|(?<!\w)_(?=\S)|\*(?=\S)|^[*#>+-](?=\s)", lambda m: "\\" + m[0], text)
    return re.sub(r"<(?=[A-Za-z/!?])", "&lt;", text)
