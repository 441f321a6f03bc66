"""The papers' tables as data, one file per paper beside this one, and what was likely meant."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import combinations, product
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

    def is_below(self, border: float) -> bool | None:
        """None where the number may be on either side."""
        return True if self.high <= border else False if self.low >= border else None

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

    ValueError: `text` is no number.
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

        ValueError: none is printed.
        """
        if self.sd is None:
            raise ValueError(f"{self.text} has no standard deviation")
        return self.sd

    @classmethod
    def of(cls, text: str) -> Cell:
        """From print.

        ValueError: `text` is neither a number nor M(SD).
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

    ValueError: `text` is no such range.
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

        ValueError: none is printed.
        """
        return range_of(self.ci_text)


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

    def slip(self, row: str, what: str, printed: str, recomputed: str, **more: Any) -> Slip:
        """In a row; ``more`` as the last fields of :class:`Slip`."""
        return Slip(self.paper, self.number, row, what, printed, recomputed, **more)


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
    data = tomllib.loads((Path(__file__).parent / f"{name}.toml").read_text(encoding="utf-8"))
    mass, duration = data.pop("body_mass_kg", ""), data.pop("sequence_s", "")
    return Paper(
        tables=tuple(_table(data["key"], **one) for one in data.pop("tables")),
        body_mass_kg=Cell.of(mass) if mass else None,
        sequence_s=rounded_from(duration) if duration else None,
        **data,
    )


def _table(
    paper: str,
    *,
    rows: list[dict],
    methods: list[str],
    unit: str = "",
    claims: list[dict] | None = None,
    marks: dict[str, list[str]] | None = None,
    **plain: Any,
) -> PrintedTable:
    """A table of the file; ``plain``: what stands in it as it is."""
    printed = tuple(_row(methods, **{"unit": unit} | one) for one in rows)
    said = tuple(Claim(**one | {"but": tuple(one.get("but", ()))}) for one in claims or ())
    unknown = {name for claim in said for name in claim.but} - {row.name for row in printed}
    if unknown:
        raise ValueError(f"{paper}, table {plain['number']}: no rows {', '.join(unknown)}")
    signs = {sign: tuple(pair) for sign, pair in (marks or {}).items()}
    named = tuple(methods)
    return PrintedTable(paper, methods=named, rows=printed, claims=said, marks=signs, **plain)


def _row(
    methods: list[str], *, name: str, unit: str, key: str = "", ci: str = "", **printed: str
) -> Row:
    compare, error_of = printed.pop("compare", key), printed.pop("error_of", "")
    cells = {method: Cell.of(printed.pop(method)) for method in methods if method in printed}
    if unknown := set(printed) - {"t", "p", "d", "F"}:
        raise ValueError(f"row {name}: unknown {', '.join(sorted(unknown))}")
    return Row(name, key, unit, cells, printed, compare, ci, error_of)


# --- what was likely meant: the one change of a table after which its numbers agree ---------------


@dataclass(frozen=True)
class Place:
    """A cell of a table."""

    row: str
    method: str
    cell: Cell

    def words(self) -> str:
        return f"{self.row} {self.method} ({self.cell.text})"


def exchanged_cells(table: PrintedTable) -> tuple[PrintedTable, str]:
    """The table after the only exchange of two cells by which the means of all rows agree with
    their intervals, and which that is, in words; as it is, and nothing, if they agree as printed,
    or if no or several exchanges would do."""
    found: list[tuple[PrintedTable, str]] = []
    for first, second in () if _agree(table) else combinations(_places(table), 2):
        rows = {row.name: row for row in table.rows}
        for here, there in ((first, second), (second, first)):
            cells = {**rows[here.row].cells, here.method: there.cell}
            rows[here.row] = replace(rows[here.row], cells=cells)
        undone = replace(table, rows=tuple(rows.values()))
        if _agree(undone):
            found.append((undone, f"{first.words()} and {second.words()} are exchanged"))
    return found[0] if len(found) == 1 else (table, "")


def pairs_that_differ_by(table: PrintedTable, difference: Interval) -> list[tuple[Place, Place]]:
    """All two cells of a table whose means differ by so much."""
    places = _places(table)
    return [(a, b) for a in places for b in places if (a.cell.mean - b.cell.mean).meets(difference)]


def as_meant(table: PrintedTable) -> PrintedTable:
    """The table with exchanged cells where they belong; as it is where none are."""
    return exchanged_cells(table)[0] if table.design == "paired" else table


def middle_of(row: Row) -> Interval:
    """Of the printed interval."""
    return image(lambda low, high: 0.5 * (low + high), *row.ends())


def mean_difference(table: PrintedTable, row: Row) -> Interval:
    """Of the first method's mean less the second's."""
    first, second = (row.cells[method] for method in table.methods)
    return first.mean - second.mean


def agrees(table: PrintedTable, row: Row) -> bool:
    """Whether the difference of a row's means is the middle of its interval."""
    return mean_difference(table, row).meets(middle_of(row))


def _agree(table: PrintedTable) -> bool:
    return all(agrees(table, row) for row in table.rows)


def _places(table: PrintedTable) -> list[Place]:
    return [Place(row.name, m, cell) for row in table.rows for m, cell in row.cells.items()]
