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

# --- numbers as print gives them: every one stands for all that round to it -----------------------

_NUMBER = r"-?\d*\.?\d+"
_CELL = re.compile(rf"(?P<mean>{_NUMBER})(?:\((?P<sd>{_NUMBER})\))?(?P<marks>\D*)")
_RANGE = re.compile(rf"\[({_NUMBER}), ({_NUMBER})\]")


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
        ends = abs(self.low), abs(self.high)
        return Interval(0.0 if self.low <= 0.0 <= self.high else min(ends), max(ends))

    def __neg__(self) -> Interval:
        return Interval(-self.high, -self.low)

    def __sub__(self, other: Interval) -> Interval:
        return Interval(self.low - other.high, self.high - other.low)

    def words(self, decimals: int = 2) -> str:
        """2.41, or 2.41 to 2.45 where rounding matters."""
        low, high = f"{self.low:.{decimals}f}", f"{self.high:.{decimals}f}"
        return low if low == high else f"{low} to {high}"


def image(function: Callable[..., float], *arguments: Interval) -> Interval:
    """What a function makes of intervals; it must rise or fall with each argument throughout."""
    values = [function(*corner) for corner in product(*((x.low, x.high) for x in arguments))]
    return Interval(min(values), max(values))


def rounded_from(text: str) -> Interval:
    """The numbers that are printed as ``text``; ValueError if that is no number."""
    half = 0.5 * 10.0 ** -len(text.partition(".")[2])
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
        """The standard deviation; ValueError if none is printed."""
        if self.sd is None:
            raise ValueError(f"{self.text} has no standard deviation")
        return self.sd

    @classmethod
    def of(cls, text: str) -> Cell:
        """From print; ValueError if that is neither a number nor M(SD)."""
        found = _CELL.fullmatch(text)
        if found is None:
            raise ValueError(f"neither a number nor M(SD): {text!r}")
        sd = rounded_from(found["sd"]) if found["sd"] else None
        sd = sd and Interval(max(sd.low, 0.0), sd.high)
        return cls(text, rounded_from(found["mean"]), sd, found["marks"])


# --- tables and papers ----------------------------------------------------------------------------

Design = Literal["paired", "groups", "described", "summary"]
"""A difference of two methods in the same people; groups compared as if independent; means
alone; mean, median and maximum over so many values."""


@dataclass(frozen=True)
class Slip:
    """What a paper's own numbers contradict: ``printed`` beside ``recomputed`` as text;
    ``reading``: what was likely meant, if the numbers allow only one. is_remark : worth knowing,
    but no contradiction by itself."""

    paper: str
    table: int
    row: str
    what: str
    printed: str
    recomputed: str
    reading: str = ""
    is_remark: bool = False


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
    """``cells`` by method; ``tests`` as printed: t, p, d, F; ``ci_text`` the interval.

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
        """Of the interval of the mean difference; ValueError if none is printed."""
        found = _RANGE.fullmatch(self.ci_text)
        if found is None:
            raise ValueError(f"no range: {self.ci_text!r}")
        return rounded_from(found[1]), rounded_from(found[2])

    def middle(self) -> Interval:
        """Of the interval of the mean difference."""
        return image(lambda low, high: 0.5 * (low + high), *self.ends())

    def difference(self) -> Interval:
        """Of the first method's mean less the second's."""
        first, second = self.cells.values()
        return first.mean - second.mean

    def agrees(self) -> bool:
        """Whether the difference of the means is the middle of the interval."""
        return self.difference().meets(self.middle())


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
    """A paper by its key; UsageError if there is none."""
    if name not in names():
        raise UsageError(f"there is no paper {name!r}", expected=", ".join(names()))
    data = tomllib.loads((Path(__file__).parent / f"{name}.toml").read_text(encoding="utf-8"))
    data["tables"] = tuple(_table(data["key"], **one) for one in data["tables"])
    for key, read in (("body_mass_kg", Cell.of), ("sequence_s", rounded_from)):
        data |= {key: read(data[key])} if key in data else {}
    return Paper(**data)


def _table(
    paper: str, *, rows: list[dict[str, str]], methods: list[str], unit: str = "", **plain: Any
) -> PrintedTable:
    """A table of the file; ``plain``: what stands in it as it is."""
    plain["rows"] = tuple(_row(methods, {"unit": unit} | one) for one in rows)
    plain["marks"] = {sign: tuple(pair) for sign, pair in plain.get("marks", {}).items()}
    claims = (one | {"but": tuple(one.get("but", ()))} for one in plain.get("claims", ()))
    plain["claims"] = tuple(Claim(**one) for one in claims)
    table = PrintedTable(paper, methods=tuple(methods), **plain)
    unknown = {name for claim in table.claims for name in claim.but} - {r.name for r in table.rows}
    if unknown:
        raise ValueError(f"{paper}, table {table.number}: no rows {', '.join(unknown)}")
    return table


def _row(methods: list[str], printed: dict[str, str]) -> Row:
    key = printed.pop("key", "")
    plain = {"key": key, "compare": printed.pop("compare", key), "ci_text": printed.pop("ci", "")}
    for name in ("name", "unit", "error_of"):
        plain[name] = printed.pop(name, "")
    cells = {method: Cell.of(printed.pop(method)) for method in methods if method in printed}
    if unknown := set(printed) - {"t", "p", "d", "F"}:
        raise ValueError(f"row {plain['name']}: unknown {', '.join(sorted(unknown))}")
    return Row(cells=cells, tests=printed, **plain)


# --- what was likely meant: the one change of a table after which its numbers agree ---------------

Place = tuple[str, str, Cell]
"""A cell of a table, behind its row and method."""


def places(table: PrintedTable) -> list[Place]:
    """All cells."""
    return [(row.name, method, cell) for row in table.rows for method, cell in row.cells.items()]


def place_words(place: Place) -> str:
    row, method, cell = place
    return f"{row} {method} ({cell.text})"


def exchanged_cells(table: PrintedTable) -> tuple[PrintedTable, str]:
    """The table after the only exchange of two cells by which the means of all rows agree with
    their intervals, and which that is, in words; as it is, and nothing, if they agree as printed,
    or if no or several exchanges would do."""
    found: list[tuple[PrintedTable, str]] = []
    sound = all(row.agrees() for row in table.rows)
    for first, second in () if sound else combinations(places(table), 2):
        rows = {row.name: row for row in table.rows}
        for (name, method, _), (*_, cell) in ((first, second), (second, first)):
            rows[name] = replace(rows[name], cells={**rows[name].cells, method: cell})
        if all(row.agrees() for row in rows.values()):
            words = f"{place_words(first)} and {place_words(second)} are exchanged"
            found.append((replace(table, rows=tuple(rows.values())), words))
    return found[0] if len(found) == 1 else (table, "")


def as_meant(table: PrintedTable) -> PrintedTable:
    """The table with exchanged cells where they belong; as it is where none are."""
    return exchanged_cells(table)[0] if table.design == "paired" else table
