"""What the papers print, as data, what of it cannot be true, and what was likely meant.

A TOML file per paper as printed. What its own numbers contradict is found by ``python -m
benchmarks.published_audit``: `audit.csv`, and in the TOML ``exchanged`` (two cells in each other's
place) and ``fits_unit`` (of lengths, whatever the text says).
"""

from __future__ import annotations

import csv
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from bsip_cli.errors import UsageError

FOLDER = Path(__file__).parent
TESTS = ("t", "p", "d", "F")
_CELL = re.compile(r"(?P<mean>[^()*+]+)(?:\((?P<sd>[^)]+)\))?[*+]*")


@dataclass(frozen=True)
class Cell:
    """M(SD) as printed, marks behind it; ``sd`` is nan where only one number is printed."""

    text: str
    mean: float
    sd: float

    @classmethod
    def of(cls, text: str) -> Cell:
        found = _CELL.fullmatch(text)
        if found is None:
            raise ValueError(f"neither a number nor M(SD): {text!r}")
        return cls(text, float(found["mean"]), float(found["sd"] or "nan"))


@dataclass(frozen=True)
class Row:
    """``cells`` by method; ``tests`` as printed: t, p, d, F; ``ci_text`` the interval.

    compare : this study's variable, and its task after a space. error_of : the row of errors of the
    same path.
    """

    name: str
    unit: str
    compare: str
    error_of: str
    ci_text: str
    cells: Mapping[str, Cell]
    tests: Mapping[str, str]


@dataclass(frozen=True)
class PrintedTable:
    """exchanged : row and method of two cells that stand in each other's place. fits_unit : the one
    that its lengths fit, where that is known."""

    number: int
    about: str
    methods: tuple[str, ...]
    rows: tuple[Row, ...]
    exchanged: tuple[tuple[str, str], ...]
    fits_unit: str

    def as_meant(self) -> PrintedTable:
        """The table with exchanged cells where they belong; as it is where none are."""
        rows = {row.name: row for row in self.rows}
        moved = {place: rows[place[0]].cells[place[1]] for place in self.exchanged}
        for (name, method), cell in zip(self.exchanged, reversed(moved.values()), strict=True):
            rows[name] = replace(rows[name], cells={**rows[name].cells, method: cell})
        return replace(self, rows=tuple(rows.values()))


@dataclass(frozen=True)
class Paper:
    """slips : what its own numbers contradict, as of `audit.csv`. is_audited : whether anything in
    it can be recomputed from what is printed."""

    key: str
    name: str
    citation: str
    url: str
    tables: tuple[PrintedTable, ...]
    slips: tuple[Mapping[str, str], ...]
    is_audited: bool

    def table(self, number: int) -> PrintedTable:
        return next(table for table in self.tables if table.number == number)


def names() -> tuple[str, ...]:
    """The papers that are there."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.toml")))


@cache
def load_paper(name: str) -> Paper:
    """A paper by its key.

    UsageError: there is none.
    """
    if name not in names():
        raise UsageError(f"there is no paper {name!r}", expected=", ".join(names()))
    data = tomllib.loads((FOLDER / f"{name}.toml").read_text(encoding="utf-8"))
    tables = data["tables"]
    lines = (FOLDER / "audit.csv").read_text(encoding="utf-8").splitlines()
    slips = tuple(slip for slip in csv.DictReader(lines) if slip["paper"] == name)
    is_audited = any(one["design"] != "described" or "claims" in one for one in tables)
    about = data["key"], data["name"], data["citation"], data["url"]
    return Paper(*about, tuple(map(_table, tables)), slips, is_audited)


def _table(data: Mapping[str, Any]) -> PrintedTable:
    methods, rows = tuple(data["methods"]), []
    for printed in data["rows"]:
        unit = printed.get("unit", data.get("unit", ""))
        compare = printed.get("compare", printed.get("key", ""))
        words = printed["name"], unit, compare, printed.get("error_of", "")
        cells = {method: Cell.of(printed[method]) for method in methods if method in printed}
        tests = {name: printed[name] for name in TESTS if name in printed}
        rows.append(Row(*words, printed.get("ci", ""), cells, tests))
    exchanged = tuple((row, method) for row, method in data.get("exchanged", ()))
    head = data["number"], data["about"], methods
    return PrintedTable(*head, tuple(rows), exchanged, data.get("fits_unit", ""))
