"""A table as data. Three renderers print it and know nothing of its content."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

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
