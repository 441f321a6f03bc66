"""Everything in a paper that its own numbers contradict."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product
from math import copysign, inf, sqrt

import numpy as np
from scipy import stats
from scipy.optimize import minimize_scalar

from bsip_cli.statistics.published.paper import (
    Claim,
    Interval,
    Paper,
    PrintedTable,
    Row,
    Slip,
    image,
    range_words,
    slip,
)
from bsip_cli.statistics.published.readings import (
    agrees,
    as_meant,
    exchanged_cells,
    mean_difference,
    middle_of,
    pairs_that_differ_by,
)
from bsip_cli.statistics.published.sway_audit import sway_slips

# --- the ways in which papers compute Cohen's d of two methods in the same people -----------------


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


# --- tables that compare methods as if they were groups of people: F and p from M(SD) and n -------

# One-way analysis of variance of k groups of n: F = n var(means) / mean(SD^2), k - 1 and k (n - 1)
# degrees of freedom.


def group_slips(paper: Paper, table: PrintedTable) -> Iterator[Slip]:
    """What in a table of groups contradicts the rest of it."""
    for row in table.rows:
        yield from _f_value(paper, table, row)
        yield from _p_of_groups(paper, table, row)
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


def _p_of_groups(paper: Paper, table: PrintedTable, row: Row) -> Iterator[Slip]:
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


# --- tables that compare two methods in the same people: interval, t, p and d from the means ------

# All that follows from M(SD), the 95 % interval of the mean difference and n; Student's paired t
# test, and Cohen's d by whichever definition most rows of the table follow.


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


# --------------------------------------------------------------------------------------------------


def audit(paper: Paper) -> tuple[Slip, ...]:
    """All slips, table by table, each once."""
    return tuple(dict.fromkeys(one for table in paper.tables for one in _slips(paper, table)))


def _slips(paper: Paper, table: PrintedTable) -> Iterator[Slip]:
    if table.design == "paired":
        yield from paired_slips(paper, table)
    elif table.design == "groups":
        yield from group_slips(paper, table)
        yield from sway_slips(paper, table)
    elif table.design == "summary":
        yield from _means_of_few(table)
    if table.adds_up_to_body_mass:
        yield from _sums(paper, table)
    for claim in table.claims:
        yield from _claim(paper, table, claim)


def _sums(paper: Paper, table: PrintedTable) -> Iterator[Slip]:
    """Each method's segments beside the body's mass."""
    if paper.body_mass_kg is None:
        return
    for method in table.methods:
        parts = [row.cells[method].mean for row in table.rows]
        whole = Interval(sum(one.low for one in parts), sum(one.high for one in parts))
        if not whole.meets(paper.body_mass_kg.mean):
            yield slip(
                table,
                "sum of all rows",
                "body mass",
                printed=f"people of {paper.body_mass_kg.text} kg",
                recomputed=f"the segments of {method} add up to {range_words(whole)} kg",
            )


def _means_of_few(table: PrintedTable) -> Iterator[Slip]:
    """A mean of n values that are not negative is at least their maximum over n."""
    for row in table.rows:
        mean, most = row.cells["mean"].mean, row.cells["max"].mean
        least = most.low / table.values
        if mean.high < least:
            yield slip(
                table,
                row.name,
                "mean",
                printed=row.cells["mean"].text,
                recomputed=f"at least {least:.3f} if over {table.values} values, of which one is "
                f"{row.cells['max'].text}",
            )


def _claim(paper: Paper, table: PrintedTable, claim: Claim) -> Iterator[Slip]:
    """What caption or text says, beside the table."""
    false = [row.name for row in table.rows if _is_false(paper, table, row, claim)]
    if not false:
        return
    but = f" but {', '.join(claim.but)}" if claim.but else ""
    whole = len(false) == len(table.rows)
    meant = as_meant(table)
    is_put_right = not any(_is_false(paper, meant, row, claim) for row in meant.rows)
    yield slip(
        table,
        "all rows" if whole else ", ".join(false),
        f"the {claim.where}",
        printed=f"{f'{claim.method} ' if claim.method else 'all rows '}{claim.says}{but}",
        recomputed="the table says the opposite" if whole else "not in these rows",
        reading="true once the exchanged cells are corrected" if is_put_right else "",
    )


def _is_false(paper: Paper, table: PrintedTable, row: Row, claim: Claim) -> bool:
    """Whether no numbers that round to the printed ones make the claim true of a row."""
    if claim.says == "smaller":
        mine = row.cells[claim.method].mean
        rest = (cell.mean for method, cell in row.cells.items() if method != claim.method)
        return any(mine.low >= other.high for other in rest)
    is_different = is_below(row.printed("p"), paper.alpha)
    should = (claim.says == "different") != (row.name in claim.but)
    return is_different is not None and is_different != should
