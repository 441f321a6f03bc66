"""The papers' tables as data: one file per paper beside this one."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any, Literal

from bsip_cli.errors import UsageError

# --- one thing that a paper's own numbers say cannot be as printed --------------------------------


@dataclass(frozen=True)
class Slip:
    """``printed`` beside ``recomputed`` as text; ``reading``: what was likely meant, if the numbers
    allow only one. is_remark : worth knowing, but no contradiction by itself."""

    paper: str
    table: int
    row: str
    what: str
    printed: str
    recomputed: str
    reading: str = ""
    is_remark: bool = False


def slip(
    table: PrintedTable,
    row: str,
    what: str,
    *,
    printed: str,
    recomputed: str,
    reading: str = "",
    is_remark: bool = False,
) -> Slip:
    """Of a row of a table."""
    return Slip(table.paper, table.number, row, what, printed, recomputed, reading, is_remark)


def range_words(values: Interval, decimals: int = 2) -> str:
    """2.41, or 2.41 to 2.45 where rounding matters."""
    low, high = f"{values.low:.{decimals}f}", f"{values.high:.{decimals}f}"
    return low if low == high else f"{low} to {high}"


# --- numbers as print gives them: every one stands for all that round to it -----------------------


_NUMBER = r"-?\d*\.?\d+"
_CELL = re.compile(rf"(?P<mean>{_NUMBER})(?:\((?P<sd>{_NUMBER})\))?(?P<marks>\D*)")
_RANGE = re.compile(rf"\[(?P<low>{_NUMBER}), (?P<high>{_NUMBER})\]")


@dataclass(frozen=True)
class Interval:
    """All numbers from ``low`` to ``high``."""

    low: float
    high: float

    @property
    def middle(self) -> float:
        return 0.5 * (self.low + self.high)

    def meets(self, other: Interval) -> bool:
        """Whether some number lies in both."""
        return self.low <= other.high and other.low <= self.high

    def size(self) -> Interval:
        """Of the numbers without their sign."""
        if self.low <= 0.0 <= self.high:
            return Interval(0.0, max(-self.low, self.high))
        return Interval(*sorted((abs(self.low), abs(self.high))))

    def negative(self) -> Interval:
        return Interval(-self.high, -self.low)

    def __sub__(self, other: Interval) -> Interval:
        return Interval(self.low - other.high, self.high - other.low)


def image(function: Callable[..., float], *arguments: Interval) -> Interval:
    """What a function makes of intervals; it must rise or fall with each argument throughout."""
    corners = product(*((one.low, one.high) for one in arguments))
    values = [function(*corner) for corner in corners]
    return Interval(min(values), max(values))


def rounded_from(text: str) -> Interval:
    """The numbers that are printed as ``text``.

    Raises
    ------
    ValueError
        `text` is no number.
    """
    _, _, decimals = text.partition(".")
    half = 0.5 * 10.0 ** -len(decimals)
    return Interval(float(text) - half, float(text) + half)


@dataclass(frozen=True)
class Cell:
    """M(SD) with the marks behind it; ``sd``, never below 0, is None where only one number is
    printed."""

    text: str
    mean: Interval
    sd: Interval | None
    marks: str

    def spread(self) -> Interval:
        """The standard deviation.

        Raises
        ------
        ValueError
            None is printed.
        """
        if self.sd is None:
            raise ValueError(f"{self.text} has no standard deviation")
        return self.sd

    @classmethod
    def of(cls, text: str) -> Cell:
        """From print.

        Raises
        ------
        ValueError
            `text` is neither a number nor M(SD).
        """
        found = _CELL.fullmatch(text)
        if found is None:
            raise ValueError(f"neither a number nor M(SD): {text!r}")
        sd = rounded_from(found["sd"]) if found["sd"] else None
        if sd is not None:
            sd = Interval(max(sd.low, 0.0), sd.high)
        return cls(text, rounded_from(found["mean"]), sd, found["marks"])


def range_of(text: str) -> tuple[Interval, Interval]:
    """Both ends of a printed [low, high].

    Raises
    ------
    ValueError
        `text` is no such range.
    """
    found = _RANGE.fullmatch(text)
    if found is None:
        raise ValueError(f"no range: {text!r}")
    return rounded_from(found["low"]), rounded_from(found["high"])


# --------------------------------------------------------------------------------------------------


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
