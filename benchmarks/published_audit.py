"""Everything in a paper that its own numbers contradict; writes what ``bsip published`` lists.

The papers are the files in `bsip_cli/statistics/published`, where `audit.csv` is written.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterator
from itertools import product
from math import copysign, inf, nan, pi, sqrt

import numpy as np
from scipy import stats
from scipy.optimize import minimize_scalar

from benchmarks.printed_paper import (
    Cell,
    Claim,
    Interval,
    Paper,
    PrintedTable,
    Row,
    Slip,
    as_meant,
    exchanged_cells,
    image,
    load_paper,
    place_words,
    places,
)
from bsip_cli.statistics.published import FOLDER, names


def _unlike(
    table: PrintedTable, row: Row, test: str, computed: Interval, found: str
) -> Iterator[Slip]:
    """A test whose printed number is none that was computed."""
    if not computed.meets(row.printed(test)):
        yield table.slip(row.name, test, row.tests[test], found)


# --- the ways in which papers compute Cohen's d of two methods in the same people -----------------

# A difference of means, over a standard deviation of which only that of the differences is paired
# as the test is; {a} and {b} are the first and the second method.
_PAIRED, _POOLED = "SD of the differences", "pooled SD of the two columns"
_HEDGES = f"{_POOLED}, corrected after Hedges"
_BELOW: dict[str, Callable[[float, float], float]] = {
    _POOLED: lambda a, b: sqrt((a**2 + b**2) / 2),
    _PAIRED: lambda a, b: nan,  # from t
    "mean of the two SDs": lambda a, b: (a + b) / 2,
    "SD of {a}": lambda a, _: a,
    "SD of {b}": lambda _, b: b,
    _HEDGES: lambda a, b: sqrt((a**2 + b**2) / 2),
}
_ABOVE: dict[str, Callable[[Interval], Interval]] = {
    "({b} - {a})": lambda d: d,
    "({a} - {b})": lambda d: -d,
    "|{b} - {a}|": Interval.size,
}


def effect_size(above: str, below: str, table: PrintedTable, row: Row, paper: Paper) -> Interval:
    """Cohen's d of a row by a definition."""

    def effect(mean_a: float, sd_a: float, mean_b: float, sd_b: float) -> float:
        sd, difference = _BELOW[below](sd_a, sd_b), mean_b - mean_a
        return difference / sd if sd > 0.0 else copysign(inf, difference) if difference else 0.0

    if below == _PAIRED:
        found = image(lambda t: -t / sqrt(paper.participants), row.printed("t"))
    else:
        a, b = (row.cells[method] for method in table.methods)
        found = image(effect, a.mean, a.spread(), b.mean, b.spread())
    if below == _HEDGES:
        found = image(lambda d: (1 - 3 / (8 * paper.participants - 9)) * d, found)
    return _ABOVE[above](found)


def definition_of(paper: Paper, table: PrintedTable) -> tuple[tuple[str, str], int]:
    """The definition that most rows follow, of equals the plainest, and how many do."""

    def followers(one: tuple[str, str]) -> int:
        found = ((effect_size(*one, table, row, paper), row.printed("d")) for row in table.rows)
        return sum(computed.meets(printed) for computed, printed in found)

    best = max(((above, below) for below in _BELOW for above in _ABOVE), key=followers)
    return best, followers(best)


# --- tables that compare methods as if they were groups of people: F and p from M(SD) and n -------

# One-way analysis of variance of k groups of n: F = n var(means) / mean(SD^2), k - 1 and k (n - 1)
# degrees of freedom.


def group_slips(paper: Paper, table: PrintedTable) -> Iterator[Slip]:
    """What in a table of groups contradicts the rest of it."""
    groups = len(table.methods)
    df = groups - 1, groups * (paper.participants - 1)
    for row in table.rows:
        cells = [row.cells[method] for method in table.methods]
        means, sds = [cell.mean for cell in cells], [cell.spread() for cell in cells]
        f = f_of_groups(means, sds, paper.participants)
        yield from _unlike(table, row, "F", f, f.words())
        p = image(lambda f: float(stats.f.sf(max(f, 0.0), *df)), row.printed("F"))
        yield from _unlike(table, row, "p", p, p.words(3))
    yield from _marks(table)


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
                reading = f"one {cell.marks[-1]} for {likely[0]}" if len(likely) == 1 else ""
                where, found = f"{row.name} {method}", "; ".join(wrong)
                yield table.slip(where, "marks", cell.text, found, reading=reading)
    for sign in unused:
        yield table.slip("all rows", "marks", f"{sign} in the legend", "no cell has it")


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
    meant, exchange = exchanged_cells(table)
    df = paper.participants - 1
    for row in table.rows:
        yield from _difference(table, row, exchange)
        t = t_of_interval(row.ends(), df)
        yield from _unlike(table, row, "t", t, f"{t.words()} from the interval")
        p = image(lambda t: float(2 * stats.t.sf(t, df)), row.printed("t").size())
        small = "below .001" if p.high < 0.001 else p.words(3)
        found = f"{small} for the printed t with {df} degrees of freedom"
        yield from _unlike(table, row, "p", p, found)
        yield from _star(paper, table, row)
    yield from _effect_sizes(paper, table, meant)


def _difference(table: PrintedTable, row: Row, exchange: str) -> Iterator[Slip]:
    if row.agrees():
        return
    every = places(table)
    alike = [
        f"{place_words(a)} less {place_words(b)}"
        for a, b in product(every, repeat=2)
        if (a[2].mean - b[2].mean).meets(row.middle())
    ]
    only = f"interval and t belong to {alike[0]}" if len(alike) == 1 else ""
    printed = f"{' - '.join(table.methods)} = {row.difference().middle:.2f}"
    middle = f"the interval's middle is {row.middle().words()}"
    yield table.slip(row.name, "means and interval", printed, middle, reading=exchange or only)


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


def _star(paper: Paper, table: PrintedTable, row: Row) -> Iterator[Slip]:
    is_small = row.printed("p").is_below(paper.alpha)
    if is_small is None:
        return
    should = is_small if table.star == "p < alpha" else not is_small
    if should != row.tests["p"].endswith("*"):
        yield table.slip(row.name, "star", row.tests["p"], f"{table.star} has a star")


def _effect_sizes(paper: Paper, table: PrintedTable, meant: PrintedTable) -> Iterator[Slip]:
    """Cohen's d of the printed means, and of those that were meant."""
    what = "Cohen's d"
    definition, count = definition_of(paper, table)
    if not count:
        yield table.slip("all rows", what, "d", "no row follows any of the usual definitions")
        return
    for row, true in zip(table.rows, meant.rows, strict=True):
        computed = effect_size(*definition, table, row, paper)
        if not computed.meets(row.printed("d")):
            yield table.slip(row.name, what, row.tests["d"], computed.words())
        elif row != true:
            right = effect_size(*definition, table, true, paper).words()
            found = f"computed from the means as printed; {right} from those that were meant"
            yield table.slip(row.name, what, row.tests["d"], found)
    if _PAIRED not in definition:
        a, b = table.methods
        formula = " / ".join(definition).format(a=a, b=b)
        printed = f"{formula} in {count} of {len(table.rows)} rows"
        found = "not the d of the differences, t / sqrt(n), though the test is paired"
        what = "definition of Cohen's d"
        yield table.slip("all rows", what, printed, found, is_remark=True)


# --- sway: what the measures of one path say of each other, and of its unit -----------------------

# mean velocity = length / duration; area of the 95 % ellipse = pi chi2(0.95, 2) sd_ap sd_ml
# sqrt(1 - r^2), at most that of r = 0. The root mean square of two paths' difference is at least
# the difference of their root mean squares, in the mean over people too; it is at most their sum if
# both are about the same place and no constant offset sets the paths apart.

METRES = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}
STRAIGHT = 0.95  # correlation of the axes beyond which a path is a line
# Of the least spread over people of the other measures of the same table: lengths, areas and the
# other axis follow how much a person sways, so the root mean square should too.
EVEN = 0.2
_ELLIPSE = pi * float(stats.chi2.ppf(0.95, 2))
VELOCITY, LENGTH, AREA, AP, ML = "mean_velocity", "sway_length", "ellipse_area", "rms_ap", "rms_ml"


def sway_slips(paper: Paper, table: PrintedTable) -> Iterator[Slip]:
    """What in a table of sway measures contradicts the rest of it, or the errors of the same
    paths in another table."""
    rows = {row.key: row for row in table.rows}
    if not {VELOCITY, LENGTH, AREA, AP, ML} <= set(rows):
        return
    if paper.sequence_s is not None:
        yield from _duration(paper.sequence_s, table, rows)
    if table.errors_in:
        yield from _unit(paper, table)
    yield from _about_an_origin(table, rows)


def _duration(stated: Interval, table: PrintedTable, rows: dict[str, Row]) -> Iterator[Slip]:
    found = []
    for method in table.methods:
        length, velocity = (rows[key].cells[method].mean for key in (LENGTH, VELOCITY))
        found.append(image(lambda a, b: a / b, length, velocity))
    if all(one.meets(stated) for one in found):
        return
    whole = Interval(min(one.low for one in found), max(one.high for one in found))
    steps = (METRES[a] / METRES[b] for a in METRES for b in METRES)
    fits = any(Interval(whole.low * k, whole.high * k).meets(stated) for k in steps)
    where = f"{rows[LENGTH].name} / {rows[VELOCITY].name}"
    printed, computed = f"the sequence lasts {stated.middle:g} s", f"{whole.words()} s"
    reading = "" if fits else "no choice of units makes it so"
    yield table.slip(where, "duration", printed, computed, reading=reading)


def unit_of_length(paper: Paper, table: PrintedTable) -> str:
    """The only unit in which no path contradicts its error; empty if none or several would do."""
    if not table.errors_in:
        return ""
    fitting = [unit for unit in METRES if not list(_impossible(paper, table, unit))]
    return fitting[0] if len(fitting) == 1 else ""


def _unit(paper: Paper, table: PrintedTable) -> Iterator[Slip]:
    """Paths that cannot be as far apart as another table says, in the printed unit."""
    unit = unit_of_length(paper, table)
    linked = next(row for row in table.rows if row.error_of)
    for row, method, error in _impossible(paper, table, linked.unit):
        beside = f"{table.methods[0]} {row.cells[table.methods[0]].text}"
        printed = f"{row.cells[method].text} beside {beside} {row.unit}"
        found = f"the two paths are {error.middle:.2f} mm apart (root mean square)"
        reading = f"the unit is {unit}, unless an offset sets the paths apart" if unit else ""
        yield table.slip(f"{row.name} {method}", "unit", printed, found, reading=reading)


def _impossible(
    paper: Paper, table: PrintedTable, unit: str
) -> Iterator[tuple[Row, str, Interval]]:
    """Rows and methods whose path can have no such error if root mean squares are in a unit."""
    errors = as_meant(paper.table(table.errors_in))
    for row in (one for one in table.rows if one.error_of):
        reference = row.cells[table.methods[0]].mean
        for method, cell in errors.row(row.error_of).cells.items():
            scale = METRES[unit] / METRES["mm"]
            path = row.cells[method].mean
            most = scale * (path.high + reference.high)
            least = scale * max(path.low - reference.high, reference.low - path.high, 0.0)
            if cell.mean.low > most or cell.mean.high < least:
                yield row, method, cell.mean


def _about_an_origin(table: PrintedTable, rows: dict[str, Row]) -> Iterator[Slip]:
    """A root mean square that hardly differs between people while all else does, and is far larger
    than the area allows, is a distance from somewhere, no sway about the mean."""
    method = table.methods[0]
    for key, other in ((ML, AP), (AP, ML)):
        row = rows[key]
        rest = min(_evenness(one, method).low for name, one in rows.items() if name != key)
        mine = _evenness(row, method).high
        likely = image(
            lambda area, side: area / (_ELLIPSE * side),
            rows[AREA].cells[method].mean,
            rows[other].cells[method].mean,
        )
        most = likely.high / sqrt(1 - STRAIGHT**2)
        if mine < EVEN * rest and row.cells[method].mean.low > most:
            printed = f"{row.cells[method].text}, equal in all people within {100 * mine:.1g} %"
            found = f"about {likely.middle:.1g} from the area, if about the mean"
            reading = "the distance from an origin that all share, not about the mean"
            remark = {"reading": reading, "is_remark": True}
            yield table.slip(row.name, "origin", printed, found, **remark)


def _evenness(row: Row, method: str) -> Interval:
    """Standard deviation over people as a part of the mean."""
    cell = row.cells[method]
    if cell.mean.low <= 0.0:
        return Interval(0.0, inf)
    return image(lambda sd, mean: sd / mean, cell.spread(), cell.mean)


# --- all of it --------------------------------------------------------------------------------


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
    if table.adds_up_to_body_mass and paper.body_mass_kg is not None:
        yield from _sums(paper.body_mass_kg, table)
    for claim in table.claims:
        yield from _claim(paper, table, claim)


def _sums(body_mass_kg: Cell, table: PrintedTable) -> Iterator[Slip]:
    """Each method's segments against the body's mass."""
    for method in table.methods:
        parts = [row.cells[method].mean for row in table.rows]
        whole = Interval(sum(one.low for one in parts), sum(one.high for one in parts))
        if not whole.meets(body_mass_kg.mean):
            found = f"the segments of {method} add up to {whole.words()} kg"
            printed = f"people of {body_mass_kg.text} kg"
            yield table.slip("sum of all rows", "body mass", printed, found)


def _means_of_few(table: PrintedTable) -> Iterator[Slip]:
    """A mean of n values that are not negative is at least their maximum over n."""
    for row in table.rows:
        mean, most = row.cells["mean"].mean, row.cells["max"].mean
        least = most.low / table.values
        if mean.high < least:
            top = row.cells["max"].text
            found = f"at least {least:.3f} if over {table.values} values, of which one is {top}"
            yield table.slip(row.name, "mean", row.cells["mean"].text, found)


def _claim(paper: Paper, table: PrintedTable, claim: Claim) -> Iterator[Slip]:
    """What caption or text says, beside the table."""
    false = [row.name for row in table.rows if _is_false(paper, table, row, claim)]
    if not false:
        return
    but = f" but {', '.join(claim.but)}" if claim.but else ""
    whole = len(false) == len(table.rows)
    meant = as_meant(table)
    is_put_right = not any(_is_false(paper, meant, row, claim) for row in meant.rows)
    where, what = "all rows" if whole else ", ".join(false), f"the {claim.where}"
    printed = f"{claim.method or 'all rows'} {claim.says}{but}"
    found = "the table says the opposite" if whole else "not in these rows"
    reading = "true once the exchanged cells are corrected" if is_put_right else ""
    yield table.slip(where, what, printed, found, reading=reading)


def _is_false(paper: Paper, table: PrintedTable, row: Row, claim: Claim) -> bool:
    """Whether no numbers that round to the printed ones make the claim true of a row."""
    if claim.says == "smaller":
        mine = row.cells[claim.method].mean
        rest = (cell.mean for method, cell in row.cells.items() if method != claim.method)
        return any(mine.low >= other.high for other in rest)
    is_different = row.printed("p").is_below(paper.alpha)
    should = (claim.says == "different") != (row.name in claim.but)
    return is_different is not None and is_different != should


# --- what ships -----------------------------------------------------------------------------------

COLUMNS = ("paper", "table", "row", "what", "printed", "recomputed", "reading")


def audit_csv() -> str:
    """The slips of all papers."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for slip in (slip for name in names() for slip in audit(load_paper(name))):
        what = f"{slip.what} (remark)" if slip.is_remark else slip.what
        writer.writerow([what if name == "what" else getattr(slip, name) for name in COLUMNS])
    return text.getvalue()


if __name__ == "__main__":
    (FOLDER / "audit.csv").write_text(audit_csv(), encoding="utf-8")
