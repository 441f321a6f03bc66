"""Tables that compare methods as if they were groups of people: F and p from M(SD) and n.

One-way analysis of variance of k groups of n: F = n var(means) / mean(SD^2), k - 1 and k (n - 1)
degrees of freedom.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import inf

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
        [row.cells[method].spread() for method in table.methods],
        paper.participants,
    )
    if not computed.meets(row.printed("F")):
        found = range_words(computed)
        yield slip(table, row.name, "F", printed=row.tests["F"], recomputed=found)


def _p_value(paper: Paper, table: PrintedTable, row: Row) -> Iterator[Slip]:
    groups = len(table.methods)
    df = groups - 1, groups * (paper.participants - 1)
    computed = image(lambda f: float(stats.f.sf(max(f, 0.0), *df)), row.printed("F"))
    if not computed.meets(row.printed("p")):
        found = range_words(computed, 3)
        yield slip(table, row.name, "p", printed=row.tests["p"], recomputed=found)


def f_of_groups(means: list[Interval], sds: list[Interval], n: int) -> Interval:
    """F of groups of n whose means and standard deviations round to what is printed."""
    spread = image(lambda *x: float(np.var(x, ddof=1)), *means)
    noise = image(lambda *x: float(np.mean(np.square(x))), *sds)
    most = n * spread.high / noise.low if noise.low > 0.0 else inf
    return Interval(n * _least_variance(means) / noise.high, most)


def _least_variance(means: list[Interval]) -> float:
    """Of numbers in these intervals: each as near to a common value as it can be."""
    low, high = (np.array([getattr(one, end) for one in means]) for end in ("low", "high"))

    def variance(common: float) -> float:
        return float(np.var(np.clip(common, low, high), ddof=1))

    return float(minimize_scalar(variance, bounds=(low.min(), high.max()), method="bounded").fun)


def _marks(table: PrintedTable) -> Iterator[Slip]:
    """Signs where the legend has none, and signs of the legend that no cell has."""
    used = {sign for row in table.rows for cell in row.cells.values() for sign in cell.marks}
    unused = [sign for sign in table.marks if sign not in used]
    for row in table.rows:
        for method, cell in row.cells.items():
            wrong = _wrong_signs(table, method, cell.marks)
            if wrong:
                likely = [sign for sign in unused if method in table.marks[sign]]
                yield slip(
                    table,
                    f"{row.name} {method}",
                    "marks",
                    printed=cell.text,
                    recomputed="; ".join(wrong),
                    reading=f"one {cell.marks[-1]} for {likely[0]}" if len(likely) == 1 else "",
                )
    for sign in unused:
        found = "no cell has it"
        yield slip(table, "all rows", "marks", printed=f"{sign} in the legend", recomputed=found)


def _wrong_signs(table: PrintedTable, method: str, marks: str) -> list[str]:
    """What the legend has against the signs of a method's cell."""
    wrong = []
    for sign in dict.fromkeys(marks):
        if sign not in table.marks:
            wrong.append(f"the legend has no {sign}")
        elif method not in table.marks[sign]:
            wrong.append(f"{sign} is of {' and '.join(table.marks[sign])}")
        elif marks.count(sign) > 1:
            wrong.append(f"{sign} stands there {marks.count(sign)} times")
    return wrong
