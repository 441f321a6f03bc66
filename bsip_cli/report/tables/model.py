"""A table as data, the tests of one table by what they are about, and numbers as the papers print
them; a number that is not there is a dash."""

from __future__ import annotations

import tomllib
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import groupby
from math import isnan
from pathlib import Path

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


def _rounded(value: float, decimals: int) -> str:
    if isnan(value):
        return ABSENT
    text = f"{value:.{decimals}f}"
    return text.removeprefix("-") if float(text) == 0.0 else text


def number(decimals: int) -> Callable[[float], str]:
    """A form with so many decimals, without a sign before zero."""
    return partial(_rounded, decimals=decimals)


def mean_sd(decimals: int) -> Callable[[float, float], str]:
    """M(SD), in whole numbers from a thousand on; one participant has no SD."""

    def form(mean: float, sd: float) -> str:
        places = number(0 if abs(mean) >= 1000.0 else decimals)
        return ABSENT if isnan(mean) else f"{places(mean)}({places(sd)})"

    return form


def interval(decimals: int) -> Callable[[float, float], str]:
    """A form of both ends in brackets; absent if one is."""

    def form(low: float, high: float) -> str:
        ends = [_rounded(end, decimals) for end in (low, high)]
        return ABSENT if ABSENT in ends else f"[{', '.join(ends)}]"

    return form


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
    "number": number(2),
    "interval": interval(2),
    "mean_sd": mean_sd(2),
    "mean_sd of 1": mean_sd(3),
    "p": p_value,
    "count": number(0),
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
