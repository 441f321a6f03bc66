"""Sway: what the measures of one path say of each other, and of its unit.

mean velocity = length / duration; area of the 95 % ellipse = pi chi2(0.95, 2) sd_ap sd_ml
sqrt(1 - r^2), at most that of r = 0. The root mean square of two paths' difference is at least the
difference of their root mean squares, in the mean over people too; it is at most their sum if both
are about the same place and no constant offset sets the paths apart.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import inf, pi, sqrt

from scipy import stats

from bsip_cli.statistics.published.paper import (
    Interval,
    Paper,
    PrintedTable,
    Row,
    Slip,
    image,
    range_words,
    slip,
)
from bsip_cli.statistics.published.readings import as_meant

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
    yield from _duration(paper, table, rows)
    if table.errors_in:
        yield from _unit(paper, table)
    yield from _about_an_origin(table, rows)


def _duration(paper: Paper, table: PrintedTable, rows: dict[str, Row]) -> Iterator[Slip]:
    if paper.sequence_s is None:
        return
    stated = paper.sequence_s
    found = [_ratio(rows[LENGTH], rows[VELOCITY], method) for method in table.methods]
    if all(one.meets(stated) for one in found):
        return
    whole = Interval(min(one.low for one in found), max(one.high for one in found))
    steps = (METRES[a] / METRES[b] for a in METRES for b in METRES)
    fits = any(Interval(whole.low * k, whole.high * k).meets(stated) for k in steps)
    yield slip(
        table,
        f"{rows[LENGTH].name} / {rows[VELOCITY].name}",
        "duration",
        printed=f"the sequence lasts {stated.middle:g} s",
        recomputed=f"{range_words(whole)} s",
        reading="" if fits else "no choice of units makes it so",
    )


def _ratio(above: Row, below: Row, method: str) -> Interval:
    return image(lambda a, b: a / b, above.cells[method].mean, below.cells[method].mean)


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
        yield slip(
            table,
            f"{row.name} {method}",
            "unit",
            printed=f"{row.cells[method].text} beside {beside} {row.unit}",
            recomputed=f"the two paths are {error.middle:.2f} mm apart (root mean square)",
            reading=f"the unit is {unit}, unless an offset sets the paths apart" if unit else "",
        )


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
            yield slip(
                table,
                row.name,
                "origin",
                printed=f"{row.cells[method].text}, equal in all people within {100 * mine:.1g} %",
                recomputed=f"about {likely.middle:.1g} from the area, if about the mean",
                reading="the distance from an origin that all share, not about the mean",
                is_remark=True,
            )


def _evenness(row: Row, method: str) -> Interval:
    """Standard deviation over people as a part of the mean."""
    cell = row.cells[method]
    if cell.mean.low <= 0.0:
        return Interval(0.0, inf)
    return image(lambda sd, mean: sd / mean, cell.spread(), cell.mean)
