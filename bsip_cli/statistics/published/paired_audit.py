"""Tables that compare two methods in the same people: interval, t, p and d from the means.

All that follows from M(SD), the 95 % interval of the mean difference and n; Student's paired t
test, and Cohen's d by whichever definition most rows of the table follow.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import sqrt

from scipy import stats

from bsip_cli.statistics.published.paper import Paper, PrintedTable, Row
from bsip_cli.statistics.published.printed import Cell, Interval, image
from bsip_cli.statistics.published.readings import (
    agrees,
    exchanged_cells,
    mean_difference,
    middle_of,
    pairs_that_differ_by,
)
from bsip_cli.statistics.published.slip import Slip, range_words, slip, words


@dataclass(frozen=True)
class Definition:
    """A way to compute Cohen's d from a row."""

    formula: str
    of: Callable[[Row, PrintedTable, Paper], Interval]
    is_paired: bool = False


def paired_slips(paper: Paper, table: PrintedTable) -> Iterator[Slip]:
    """What in a paired table contradicts the rest of it."""
    definition = definition_of_d(paper, table)
    exchange = exchanged_cells(table)
    meant = table if exchange is None else exchange.undone(table)
    for row, true in zip(table.rows, meant.rows, strict=True):
        yield from _difference(table, row, "" if exchange is None else exchange.sentence())
        yield from _statistic(paper, table, row)
        yield from _p_value(paper, table, row)
        yield from _star(paper, table, row)
        yield from _effect(paper, table, row, true, definition)
    if not definition.is_paired:
        yield _definition(paper, table, definition)


def definition_of_d(paper: Paper, table: PrintedTable) -> Definition:
    """The definition that most rows follow; of equals the first."""
    return max(DEFINITIONS, key=lambda one: _followers(paper, table, one))


def _followers(paper: Paper, table: PrintedTable, one: Definition) -> int:
    return sum(one.of(row, table, paper).meets(row.printed("d")) for row in table.rows)


# --- checks -----------------------------------------------------------------------------------


def _difference(table: PrintedTable, row: Row, exchange: str) -> Iterator[Slip]:
    if agrees(table, row):
        return
    first, second = table.methods
    reading = exchange
    if not reading:
        found = pairs_that_differ_by(table, middle_of(row))
        if len(found) == 1:
            (a, b) = found[0]
            reading = f"interval and t belong to {a.words()} less {b.words()}"
    yield slip(
        table,
        row.name,
        "means and interval",
        f"{first} - {second} = {words(mean_difference(table, row))}",
        f"the interval's middle is {words(middle_of(row))}",
        reading,
    )


def _statistic(paper: Paper, table: PrintedTable, row: Row) -> Iterator[Slip]:
    computed = _t_of_interval(paper, row)
    if not computed.meets(row.printed("t")):
        yield slip(table, row.name, "t", row.tests["t"], f"{words(computed)} from the interval")


def _p_value(paper: Paper, table: PrintedTable, row: Row) -> Iterator[Slip]:
    computed = image(lambda t: _p(t, paper.participants - 1), row.printed("t"))
    if not computed.meets(row.printed("p")):
        small = "below .001" if computed.high < 0.001 else range_words(computed, 3)
        found = f"{small} for the printed t with {paper.participants - 1} degrees of freedom"
        yield slip(table, row.name, "p", row.tests["p"], found)


def _star(paper: Paper, table: PrintedTable, row: Row) -> Iterator[Slip]:
    is_small = row.printed("p").middle < paper.alpha
    should = is_small if table.star == "p < alpha" else not is_small
    if should != row.tests["p"].endswith("*"):
        yield slip(table, row.name, "star", row.tests["p"], f"{table.star} has a star")


def _effect(
    paper: Paper, table: PrintedTable, row: Row, true: Row, definition: Definition
) -> Iterator[Slip]:
    """Of the printed means, and of those that were meant."""
    computed = definition.of(row, table, paper)
    if not computed.meets(row.printed("d")):
        yield slip(table, row.name, "Cohen's d", row.tests["d"], words(computed))
    elif row != true:
        meant = definition.of(true, table, paper)
        found = f"computed from the means as printed; {words(meant)} from those that were meant"
        yield slip(table, row.name, "Cohen's d", row.tests["d"], found)


def _definition(paper: Paper, table: PrintedTable, one: Definition) -> Slip:
    followers = _followers(paper, table, one)
    first, second = table.methods
    formula = one.formula.format(first=first, second=second)
    return slip(
        table,
        "all rows",
        "definition of Cohen's d",
        f"{formula} in {followers} of {len(table.rows)} rows",
        "the test is paired, for which d is t / sqrt(n)",
    )


# --- arithmetic -------------------------------------------------------------------------------


def _t_of_interval(paper: Paper, row: Row) -> Interval:
    wide = float(stats.t.ppf(0.975, paper.participants - 1))
    return image(lambda low, high: wide * (high + low) / (high - low), *row.ends())


def _p(t: float, df: int) -> float:
    return float(2 * stats.t.sf(abs(t), df))


def _pooled(row: Row, table: PrintedTable, _: Paper) -> Interval:
    first, second = (row.cells[method] for method in table.methods)
    return image(_d, first.mean, _sd(first), second.mean, _sd(second))


def _d(mean_x: float, sd_x: float, mean_y: float, sd_y: float) -> float:
    return (mean_y - mean_x) / sqrt((sd_x**2 + sd_y**2) / 2)


def _sd(cell: Cell) -> Interval:
    if cell.sd is None:
        raise ValueError(f"{cell.text} has no standard deviation")
    return cell.sd


def _negative(values: Interval) -> Interval:
    return Interval(-values.high, -values.low)


def _size(values: Interval) -> Interval:
    return values if values.middle >= 0 else _negative(values)


def _of_differences(row: Row, _: PrintedTable, paper: Paper) -> Interval:
    root = sqrt(paper.participants)
    return image(lambda t: t / root, row.printed("t"))


DEFINITIONS = (
    Definition("mean of the differences / their SD", _of_differences, is_paired=True),
    Definition("({second} - {first}) / pooled SD of the two columns", _pooled),
    Definition(
        "({first} - {second}) / pooled SD of the two columns",
        lambda row, table, paper: _negative(_pooled(row, table, paper)),
    ),
    Definition(
        "|{second} - {first}| / pooled SD of the two columns",
        lambda row, table, paper: _size(_pooled(row, table, paper)),
    ),
)
