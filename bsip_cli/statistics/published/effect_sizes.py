"""The ways in which papers compute Cohen's d of two methods in the same people."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import copysign, inf, sqrt

from bsip_cli.statistics.published.paper import Paper, PrintedTable, Row
from bsip_cli.statistics.published.printed import Interval, image


@dataclass(frozen=True)
class Definition:
    """formula : with {a} and {b} for the first and the second method. is_paired : of the
    differences, as the paired test is."""

    formula: str
    of: Callable[[PrintedTable, Row, Paper], Interval]
    is_paired: bool = False

    def words(self, table: PrintedTable) -> str:
        a, b = table.methods
        return self.formula.format(a=a, b=b)


def definition_of(paper: Paper, table: PrintedTable) -> Definition | None:
    """The definition that most rows follow, of equals the plainest; None if no row follows any."""
    best = max(DEFINITIONS, key=lambda one: followers(paper, table, one))
    return best if followers(paper, table, best) else None


def followers(paper: Paper, table: PrintedTable, one: Definition) -> int:
    """How many rows print what a definition gives."""
    return sum(one.of(table, row, paper).meets(row.printed("d")) for row in table.rows)


def _over(denominator: Callable[[float, float], float]) -> Callable[..., Interval]:
    """(second - first) / a function of both standard deviations."""

    def effect(mean_a: float, sd_a: float, mean_b: float, sd_b: float) -> float:
        below = denominator(sd_a, sd_b)
        above = mean_b - mean_a
        return above / below if below > 0.0 else copysign(inf, above) if above else 0.0

    def of(table: PrintedTable, row: Row, _: Paper) -> Interval:
        a, b = (row.cells[method] for method in table.methods)
        return image(effect, a.mean, a.spread(), b.mean, b.spread())

    return of


def _of_differences(_: PrintedTable, row: Row, paper: Paper) -> Interval:
    """t / sqrt(n) of first - second, turned."""
    root = sqrt(paper.participants)
    return image(lambda t: -t / root, row.printed("t"))


def _hedges(table: PrintedTable, row: Row, paper: Paper) -> Interval:
    factor = 1 - 3 / (8 * paper.participants - 9)
    return image(lambda d: factor * d, _pooled(table, row, paper))


_pooled = _over(lambda a, b: sqrt((a**2 + b**2) / 2))
_DENOMINATORS: tuple[tuple[str, Callable[[PrintedTable, Row, Paper], Interval], bool], ...] = (
    ("pooled SD of the two columns", _pooled, False),
    ("SD of the differences", _of_differences, True),
    ("mean of the two SDs", _over(lambda a, b: (a + b) / 2), False),
    ("SD of {a}", _over(lambda a, _: a), False),
    ("SD of {b}", _over(lambda _, b: b), False),
    ("pooled SD of the two columns, corrected after Hedges", _hedges, False),
)


def _signed() -> tuple[Definition, ...]:
    found = []
    for below, of, is_paired in _DENOMINATORS:
        found += [
            Definition(f"({{b}} - {{a}}) / {below}", of, is_paired),
            Definition(f"({{a}} - {{b}}) / {below}", _turned(of), is_paired),
            Definition(f"|{{b}} - {{a}}| / {below}", _unsigned(of), is_paired),
        ]
    return tuple(found)


def _turned(of: Callable[..., Interval]) -> Callable[..., Interval]:
    return lambda *row: of(*row).negative()


def _unsigned(of: Callable[..., Interval]) -> Callable[..., Interval]:
    return lambda *row: of(*row).size()


DEFINITIONS = _signed()
