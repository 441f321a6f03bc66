"""A table as data, and the comparisons of one table, found by what they are about."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

from bsip_cli.statistics.cohort_values import Comparison, Topic, joined
from bsip_cli.statistics.methods import OM, RM

Cell = str | float | int


@dataclass(frozen=True)
class Column:
    """One printed column, made of one or more CSV columns.

    fields : names of the CSV columns, which are also the keys of a row's values.
    heading : what is printed above; empty for columns that only the CSV has.
    form : the values of the fields as printed text.
    in_row_unit : the CSV names get the unit of the row, so that each holds one unit only.
    text : aligned to the left.
    """

    fields: tuple[str, ...]
    heading: str = ""
    form: Callable[..., str] = str
    in_row_unit: bool = False
    text: bool = False


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


def _printed(column: Column, row: Row) -> str:
    values = [row.values[name] for name in column.fields]
    if all(value == "" for value in values):
        return ""
    return column.form(*values) + row.marks.get(column.heading, "")


class Results:
    """`topics` in the order in which they were computed."""

    def __init__(self, comparisons: Iterable[Comparison]) -> None:
        rows = tuple(comparisons)
        self.topics = tuple(dict.fromkeys(row.topic for row in rows))
        self._by_topic = {
            topic: tuple(row for row in rows if row.topic == topic) for topic in self.topics
        }
        self._rows = {(row.topic, row.test, row.method_a, row.method_b): row for row in rows}

    def find(self, topic: Topic, test: str, first: str = OM, second: str = RM) -> Comparison:
        """The row, or one without any number if there is none."""
        nothing = Comparison(topic, test, "added", first, second, reason="There are no such data.")
        return self._rows.get((topic, test, first, second), nothing)

    def about(self, topic: Topic) -> tuple[Comparison, ...]:
        """Every row on the topic."""
        return self._by_topic.get(topic, ())

    def reasons(self, topic: Topic) -> str:
        """Why tests on the topic are not possible, each reason once."""
        return joined(*(row.reason for row in self.about(topic)))
