"""Tables that compare methods as if they were groups of people: F and p from M(SD) and n.

One-way analysis of variance of k groups of n: F = n var(means) / mean(SD^2), k - 1 and k (n - 1)
degrees of freedom.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy import stats
from scipy.optimize import minimize_scalar

from bsip_cli.statistics.published.paper import Paper, PrintedTable, Row
from bsip_cli.statistics.published.printed import Interval, image
from bsip_cli.statistics.published.slip import Slip, range_words, slip


def group_slips(paper: Paper, table: PrintedTable) -> Iterator[Slip]:
    """What in a table of groups contradicts the rest of it."""
    for row in table.rows:
        yield from _f_value(paper, table, row)
        yield from _p_value(paper, table, row)
    yield from _marks(table)


def _f_value(paper: Paper, table: PrintedTable, row: Row) -> Iterator[Slip]:
    computed = f_of_groups(
        [row.cells[method].mean for method in table.methods],
        [sd for method in table.methods if (sd := row.cells[method].sd) is not None],
        paper.participants,
    )
    if not computed.meets(row.printed("F")):
        yield slip(table, row.name, "F", row.tests["F"], range_words(computed))


def _p_value(paper: Paper, table: PrintedTable, row: Row) -> Iterator[Slip]:
    groups = len(table.methods)
    df = groups - 1, groups * (paper.participants - 1)
    computed = image(lambda f: float(stats.f.sf(max(f, 0.0), *df)), row.printed("F"))
    if not computed.meets(row.printed("p")):
        yield slip(table, row.name, "p", row.tests["p"], range_words(computed, 3))


def f_of_groups(means: list[Interval], sds: list[Interval], n: int) -> Interval:
    """F of groups of n whose means and standard deviations round to what is printed."""
    spread = image(lambda *x: float(np.var(x, ddof=1)), *means)
    noise = image(lambda *x: float(np.mean(np.square(x))), *(_positive(sd) for sd in sds))
    return Interval(n * _least_variance(means) / noise.high, n * spread.high / noise.low)


def _positive(sd: Interval) -> Interval:
    return Interval(max(sd.low, 1e-12), sd.high)


def _least_variance(means: list[Interval]) -> float:
    """Of numbers in these intervals: each as near to a common value as it can be."""
    low, high = (np.array([getattr(one, end) for one in means]) for end in ("low", "high"))

    def variance(common: float) -> float:
        return float(np.var(np.clip(common, low, high), ddof=1))

    return float(minimize_scalar(variance, bounds=(low.min(), high.max()), method="bounded").fun)


def _marks(table: PrintedTable) -> Iterator[Slip]:
    """Signs that the legend does not explain, and explained ones that no cell has."""
    used = {cell.marks: row.name for row in table.rows for cell in row.cells.values()}
    for sign, row in used.items():
        if sign and sign not in table.marks:
            yield slip(table, row, "marks", sign, "the legend has no such sign")
    for sign in set(table.marks) - set(used):
        yield slip(table, "all rows", "marks", f"{sign} in the legend", "no cell has it")
