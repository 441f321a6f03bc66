"""Tables that compare two methods in the same people: interval, t, p and d from the means.

All that follows from M(SD), the 95 % interval of the mean difference and n; Student's paired t
test, and Cohen's d by whichever definition most rows of the table follow.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from math import inf

from scipy import stats

from bsip_cli.statistics.published.effect_sizes import Definition, definition_of, followers
from bsip_cli.statistics.published.paper import Paper, PrintedTable, Row
from bsip_cli.statistics.published.printed import Interval, image
from bsip_cli.statistics.published.readings import (
    agrees,
    exchanged_cells,
    mean_difference,
    middle_of,
    pairs_that_differ_by,
)
from bsip_cli.statistics.published.slip import Slip, range_words, slip

_NARROW = 1e-9  # less than the arithmetic of rounding is good for


def paired_slips(paper: Paper, table: PrintedTable) -> Iterator[Slip]:
    """What in a paired table contradicts the rest of it."""
    exchange = exchanged_cells(table)
    meant = table if exchange is None else exchange.undone(table)
    for row in table.rows:
        yield from _difference(table, row, "" if exchange is None else exchange.sentence())
        yield from _statistic(paper, table, row)
        yield from _p_value(paper, table, row)
        yield from _star(paper, table, row)
    yield from _effect_sizes(paper, table, meant)


def is_below(p: Interval, alpha: float) -> bool | None:
    """Whether a printed p is below alpha; None where it may be either."""
    return True if p.high <= alpha else False if p.low >= alpha else None


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
        printed=f"{first} - {second} = {mean_difference(table, row).middle:.2f}",
        recomputed=f"the interval's middle is {range_words(middle_of(row))}",
        reading=reading,
    )


def _statistic(paper: Paper, table: PrintedTable, row: Row) -> Iterator[Slip]:
    computed = t_of_interval(row.ends(), paper.participants - 1)
    if not computed.meets(row.printed("t")):
        found = f"{range_words(computed)} from the interval"
        yield slip(table, row.name, "t", printed=row.tests["t"], recomputed=found)


def t_of_interval(ends: tuple[Interval, Interval], df: int) -> Interval:
    """t = middle / (half width / t(0.975)) of a 95 % interval whose ends are rounded; without a
    bound where the width may be nothing."""
    wide = float(stats.t.ppf(0.975, df))
    corners = list(product(*((end.low, end.high) for end in ends)))
    found = [wide * (b + a) / (b - a) for a, b in corners if b - a > _NARROW]
    low, high = min(found, default=-inf), max(found, default=inf)
    if len(found) < len(corners):
        sums = [a + b for a, b in corners]
        low, high = (-inf if min(sums) < 0 else low), (inf if max(sums) > 0 else high)
    return Interval(low, high)


def _p_value(paper: Paper, table: PrintedTable, row: Row) -> Iterator[Slip]:
    df = paper.participants - 1
    computed = image(lambda t: float(2 * stats.t.sf(t, df)), row.printed("t").size())
    if not computed.meets(row.printed("p")):
        small = "below .001" if computed.high < 0.001 else range_words(computed, 3)
        found = f"{small} for the printed t with {df} degrees of freedom"
        yield slip(table, row.name, "p", printed=row.tests["p"], recomputed=found)


def _star(paper: Paper, table: PrintedTable, row: Row) -> Iterator[Slip]:
    is_small = is_below(row.printed("p"), paper.alpha)
    if is_small is None:
        return
    should = is_small if table.star == "p < alpha" else not is_small
    if should != row.tests["p"].endswith("*"):
        found = f"{table.star} has a star"
        yield slip(table, row.name, "star", printed=row.tests["p"], recomputed=found)


def _effect_sizes(paper: Paper, table: PrintedTable, meant: PrintedTable) -> Iterator[Slip]:
    """Cohen's d of the printed means, and of those that were meant."""
    what = "Cohen's d"
    definition = definition_of(paper, table)
    if definition is None:
        found = "no row follows any of the usual definitions"
        yield slip(table, "all rows", what, printed="d", recomputed=found)
        return
    for row, true in zip(table.rows, meant.rows, strict=True):
        computed = definition.of(table, row, paper)
        if not computed.meets(row.printed("d")):
            found = range_words(computed)
            yield slip(table, row.name, what, printed=row.tests["d"], recomputed=found)
        elif row != true:
            right = range_words(definition.of(table, true, paper))
            found = f"computed from the means as printed; {right} from those that were meant"
            yield slip(table, row.name, what, printed=row.tests["d"], recomputed=found)
    if not definition.is_paired:
        yield _definition(paper, table, definition)


def _definition(paper: Paper, table: PrintedTable, one: Definition) -> Slip:
    return slip(
        table,
        "all rows",
        "definition of Cohen's d",
        printed=f"{one.words(table)} in {followers(paper, table, one)} of {len(table.rows)} rows",
        recomputed="not the d of the differences, t / sqrt(n), though the test is paired",
        is_remark=True,
    )
