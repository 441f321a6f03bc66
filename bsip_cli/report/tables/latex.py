"""A table as LaTeX for ``\\usepackage{booktabs}`` and ``\\usepackage{graphicx}``."""

from __future__ import annotations

import re
from collections.abc import Sequence

from bsip_cli.report.tables.model import Table

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
        rf"\caption{{{escape(table.title)}}}",
        rf"\label{{tab:{table.name}}}",
        r"\resizebox{\ifdim\width>\textwidth\textwidth\else\width\fi}{!}{%",
        rf"\begin{{tabular}}{{{''.join('l' if c.text else 'r' for c in columns)}}}",
        r"\toprule",
        _line([escape(column.heading) for column in columns]),
        r"\midrule",
        *_body(table),
        r"\bottomrule",
        r"\end{tabular}}",
        *_notes(table.notes),
        r"\end{table}",
    ]
    return "\n".join(lines) + "\n"


def escape(text: str) -> str:
    """Text in which nothing is a command; a minus before a number becomes a minus."""
    escaped = "".join(_SIGNS.get(sign, sign) for sign in text)
    return re.sub(r"(?<![\w-])-(?=\.?\d)", "$-$", escaped)


def _body(table: Table) -> list[str]:
    width, group, lines = len(table.printed_columns()), "", []
    for row in table.rows:
        if row.group != group:
            if group:
                lines.append(r"\addlinespace")
            group = row.group
            lines.append(rf"\multicolumn{{{width}}}{{l}}{{\textit{{{escape(group)}}}}} \\")
        lines.append(_line([escape(cell) for cell in table.printed_cells(row)]))
    return lines


def _line(cells: Sequence[str]) -> str:
    line = " & ".join(cells) + r" \\"
    return "{}" + line if line.startswith(("*", "[")) else line  # both mean something after \\\\


def _notes(notes: Sequence[str]) -> list[str]:
    if not notes:
        return []
    text = [rf"{escape(note)}\par" for note in notes]
    return [r"\par\medskip", r"\begin{minipage}{\textwidth}\footnotesize", *text, r"\end{minipage}"]
