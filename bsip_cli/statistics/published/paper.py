"""The papers' tables as data: one file per paper beside this one."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any, Literal

from bsip_cli.errors import UsageError
from bsip_cli.statistics.published.printed import Cell, Interval, range_of, rounded_from

Design = Literal["paired", "groups", "described", "summary"]
"""A difference of two methods in the same people; groups compared as if independent; means
alone; mean, median and maximum over so many values."""


@dataclass(frozen=True)
class Claim:
    """What the caption or the text says of a table's rows: all are different, equal, or smaller
    by a method, but those named."""

    where: str
    says: Literal["different", "equal", "smaller"]
    but: tuple[str, ...] = ()
    method: str = ""


@dataclass(frozen=True)
class Row:
    """``cells`` by method; ``tests`` as printed: t, p, d, F; ``ci`` the ends of the interval.

    key : the variable. compare : this study's variable, and its task after a space.
    error_of : the row of errors of the same path.
    """

    name: str
    key: str
    unit: str
    cells: Mapping[str, Cell]
    tests: Mapping[str, str]
    compare: str = ""
    ci_text: str = ""
    error_of: str = ""

    def printed(self, name: str) -> Interval:
        """A test's number without its star."""
        return rounded_from(self.tests[name].rstrip("*+"))

    def ends(self) -> tuple[Interval, Interval]:
        """Of the interval of the mean difference.

        Raises
        ------
        ValueError
            None is printed.
        """
        return range_of(self.ci_text)

    def with_cell(self, method: str, cell: Cell) -> Row:
        return replace(self, cells={**self.cells, method: cell})


@dataclass(frozen=True)
class PrintedTable:
    """star : what a star behind p means, `p < alpha` or `p > alpha`. marks : of cells, between
    which methods they say a difference. values : behind each mean of a summary. errors_in : number
    of the table with the errors of these paths.
    """

    paper: str
    number: int
    about: str
    design: Design
    methods: tuple[str, ...]
    rows: tuple[Row, ...]
    star: str = ""
    adds_up_to_body_mass: bool = False
    marks: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    claims: tuple[Claim, ...] = ()
    values: int = 0
    errors_in: int = 0

    def row(self, name: str) -> Row:
        return next(row for row in self.rows if row.name == name)


@dataclass(frozen=True)
class Paper:
    key: str
    name: str
    citation: str
    url: str
    tables: tuple[PrintedTable, ...]
    participants: int = 0
    alpha: float = 0.05
    body_mass_kg: Cell | None = None
    sequence_s: Interval | None = None

    def table(self, number: int) -> PrintedTable:
        return next(table for table in self.tables if table.number == number)


def names() -> tuple[str, ...]:
    """The papers that are there."""
    return tuple(sorted(path.stem for path in Path(__file__).parent.glob("*.toml")))


@cache
def load_paper(name: str) -> Paper:
    """A paper by its key.

    Raises
    ------
    UsageError
        There is no such paper.
    """
    if name not in names():
        raise UsageError(f"there is no paper {name!r}", expected=", ".join(names()))
    text = (Path(__file__).parent / f"{name}.toml").read_text(encoding="utf-8")
    data = tomllib.loads(text)
    mass, duration = data.get("body_mass_kg"), data.get("sequence_s")
    return Paper(
        data["key"],
        data["name"],
        data["citation"],
        data["url"],
        tuple(_table(data["key"], one) for one in data["tables"]),
        data.get("participants", 0),
        data.get("alpha", 0.05),
        mass and Cell.of(mass),
        duration and rounded_from(duration),
    )


_TABLE_KEYS = {
    "number",
    "about",
    "design",
    "unit",
    "methods",
    "star",
    "adds_up_to_body_mass",
    "claims",
    "marks",
    "values",
    "errors_in",
    "rows",
}
_ROW_KEYS = {"name", "key", "compare", "unit", "error_of", "ci", "t", "p", "d", "F"}


def _table(paper: str, data: dict[str, Any]) -> PrintedTable:
    _refuse_unknown(data, _TABLE_KEYS, f"{paper}, table {data['number']}")
    methods, unit = tuple(data["methods"]), data.get("unit", "")
    rows = tuple(_row(one, methods, unit) for one in data["rows"])
    claims = tuple(_claim(one) for one in data.get("claims", ()))
    named = {row.name for row in rows}
    unknown = [name for claim in claims for name in claim.but if name not in named]
    if unknown:
        raise ValueError(f"{paper}, table {data['number']}: no rows {', '.join(unknown)}")
    return PrintedTable(
        paper=paper,
        number=data["number"],
        about=data["about"],
        design=data["design"],
        methods=methods,
        rows=rows,
        star=data.get("star", ""),
        adds_up_to_body_mass=data.get("adds_up_to_body_mass", False),
        marks={sign: tuple(pair) for sign, pair in data.get("marks", {}).items()},
        claims=claims,
        values=data.get("values", 0),
        errors_in=data.get("errors_in", 0),
    )


def _claim(data: dict[str, Any]) -> Claim:
    _refuse_unknown(data, {"where", "says", "but", "method"}, "a claim")
    return Claim(data["where"], data["says"], tuple(data.get("but", ())), data.get("method", ""))


def _row(data: dict[str, str], methods: tuple[str, ...], unit: str) -> Row:
    _refuse_unknown(data, _ROW_KEYS | set(methods), f"row {data['name']}")
    return Row(
        name=data["name"],
        key=data.get("key", ""),
        unit=data.get("unit", unit),
        cells={method: Cell.of(data[method]) for method in methods if method in data},
        tests={name: data[name] for name in ("t", "p", "d", "F") if name in data},
        compare=data.get("compare", data.get("key", "")),
        ci_text=data.get("ci", ""),
        error_of=data.get("error_of", ""),
    )


def _refuse_unknown(data: dict[str, Any], known: set[str], where: str) -> None:
    unknown = sorted(set(data) - known)
    if unknown:
        raise ValueError(f"{where}: unknown {', '.join(unknown)}")
