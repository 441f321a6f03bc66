"""A table as data and as text (CSV, LaTeX, Markdown), the tests of one table by what they are about,
and numbers as the papers print them; a number that is not there is a dash."""

from __future__ import annotations

import re
import tomllib
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import groupby
from math import isnan
from pathlib import Path

import pandas as pd

from bsip_cli.report.words import segment_label
from bsip_cli.statistics.cohort import Comparison, Topic, all_reasons
from bsip_cli.statistics.methods import OM, RM

Cell = str | float | int
Number = tuple[str, str, str, str]
"""A number of a test: the test, the number's name, and the two methods."""


@dataclass(frozen=True)
class Column:
    """One printed column, made of one or more CSV columns.

    fields : names of the CSV columns, which are also the keys of a row's values.
    heading : what is printed above; empty for columns that only the CSV has.
    form : the values of the fields as printed text.
    in_row_unit : the CSV names get the unit of the row, so that each holds one unit only.
    text : aligned to the left.
    of : the numbers of the fields; empty for what a row brings itself.
    """

    fields: tuple[str, ...]
    heading: str = ""
    form: Callable[..., str] = str
    in_row_unit: bool = False
    text: bool = False
    of: tuple[Number, ...] = ()


@dataclass(frozen=True)
class Row:
    """One line. `marks` are signs after a printed cell, by heading, that the notes explain.

    `group` is printed once as a line of its own above the rows that share it.
    """

    values: Mapping[str, Cell]
    unit: str = ""
    group: str = ""
    marks: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Table:
    """`name` is the file's stem, `notes` the legend below, a sentence or two each."""

    name: str
    title: str
    columns: tuple[Column, ...]
    rows: tuple[Row, ...]
    notes: tuple[str, ...] = ()

    def printed_columns(self) -> tuple[Column, ...]:
        return tuple(column for column in self.columns if column.heading)

    def printed_cells(self, row: Row) -> tuple[str, ...]:
        """The row as text, marks included, in the order of the printed columns."""
        return tuple(_printed(column, row) for column in self.printed_columns())

    def printed_groups(self) -> Iterator[tuple[str, list[tuple[str, ...]]]]:
        """Name of each group of rows, empty where they have none, and its rows as text."""
        for group, rows in groupby(self.rows, key=lambda row: row.group):
            yield group, [self.printed_cells(row) for row in rows]


def _printed(column: Column, row: Row) -> str:
    values = [row.values[name] for name in column.fields]
    if all(value == "" for value in values):
        return ""
    return column.form(*values) + row.marks.get(column.heading, "")


class Results:
    """`topics` in the order in which they were computed."""

    def __init__(self, comparisons: Iterable[Comparison]) -> None:
        self._about: dict[Topic, list[Comparison]] = defaultdict(list)
        self._rows: dict[tuple[Topic, str, str, str], Comparison] = {}
        for row in comparisons:
            self._about[row.topic].append(row)
            self._rows[row.topic, row.test, row.method_a, row.method_b] = row
        self.topics = tuple(self._about)

    def find(self, topic: Topic, test: str, first: str = OM, second: str = RM) -> Comparison:
        """The row, or one without any number if there is none."""
        nothing = Comparison(topic, test, "added", first, second, reason="There are no such data.")
        return self._rows.get((topic, test, first, second), nothing)

    def values(self, topic: Topic, columns: Iterable[Column]) -> dict[str, Cell]:
        """The numbers of those columns that are made of tests."""
        return {
            name: getattr(self.find(topic, test, *pair), number)
            for one in columns
            for name, (test, number, *pair) in zip(one.fields, one.of, strict=False)
        }

    def about(self, topic: Topic) -> Sequence[Comparison]:
        """Every row on the topic."""
        return self._about.get(topic, ())

    def reasons(self, topic: Topic) -> str:
        """Why tests on the topic are not possible, each reason once."""
        return all_reasons(*(row.reason for row in self.about(topic)))


# --- numbers as text ------------------------------------------------------------------------------

ABSENT = "-"


def unit_label(unit: str) -> str:
    """A column's unit as print has it."""
    return {"mm2": "mm²", "% body weight": "% BW"}.get(unit, unit)


def number(value: float, decimals: int = 2) -> str:
    """Without a sign before zero."""
    if isnan(value):
        return ABSENT
    text = f"{value:.{decimals}f}"
    return text.removeprefix("-") if float(text) == 0.0 else text


def mean_sd(mean: float, sd: float, decimals: int = 2) -> str:
    """M(SD), in whole numbers from a thousand on; one participant has no SD."""
    digits = 0 if abs(mean) >= 1000.0 else decimals
    return ABSENT if isnan(mean) else f"{number(mean, digits)}({number(sd, digits)})"


def interval(low: float, high: float) -> str:
    """Both ends in brackets; absent if one is."""
    ends = number(low), number(high)
    return ABSENT if ABSENT in ends else f"[{', '.join(ends)}]"


def p_value(p: float) -> str:
    """Three decimals without the leading zero."""
    if isnan(p):
        return ABSENT
    return "<.001" if p < 0.0005 else f"{p:.3f}".removeprefix("0")


def counts_of(a: float, b: float, n: float) -> str:
    """How many for the one, how many for the other, of how many."""
    return ABSENT if isnan(a) or n == 0 else f"{a:.0f} : {b:.0f} of {n:.0f}"


AXES = {"cop_ap": "AP", "cop_ml": "ML"}
FORMS: dict[str, Callable[..., str]] = {
    "": str,
    "number": number,
    "interval": interval,
    "mean_sd": mean_sd,
    "mean_sd of 1": partial(mean_sd, decimals=3),
    "p": p_value,
    "count": partial(number, decimals=0),
    "counts": counts_of,
    "segment": segment_label,
    "axis": AXES.__getitem__,
}


TEXTS, _COLUMNS = (
    tomllib.loads(Path(__file__).with_name(name).read_text(encoding="utf-8"))
    for name in ("texts.toml", "columns.toml")
)
_GROUPS: dict[str, list[list[str]]] = _COLUMNS["groups"]


def columns(group: str, **words: str) -> tuple[Column, ...]:
    """Those of ``columns.toml`` by that name; ``words`` go into the headings."""
    found = []
    for line in _GROUPS[group]:
        names, of, heading, form, methods, how = line + [""] * (6 - len(line))
        first, second = (methods or f"{OM}:{RM}").split(":")
        tests = (one.split(".") for one in of.split())
        numbers = tuple((test, name, first, second) for test, name in tests)
        how_printed = heading.format(**words), FORMS[form], how == "unit", how == "text"
        found.append(Column(tuple(names.split()), *how_printed, numbers))
    return tuple(found)


def columns_of(table: str, **words: str) -> tuple[Column, ...]:
    """All of one of the papers' tables."""
    return tuple(c for group in _COLUMNS["tables"][table] for c in columns(group, **words))


# --- a table as text: CSV with every number in full precision and one unit per column, LaTeX, Markdown

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
        [row.values[name] if unit in (None, row.unit) else "" for name, unit in fields]
        for row in table.rows
    ]
    head = [name if unit is None else name + _SUFFIXES[unit] for name, unit in fields]
    return pd.DataFrame(lines, columns=head, dtype=object).to_csv(index=False, lineterminator="\n")


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
