"""A table as CSV: every number in full precision, one unit per column, names before numbers."""

from __future__ import annotations

import csv
import io
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
