"""Sway: what the measures of one path say of each other, and of its unit.

mean velocity = length / duration; area of the 95 % ellipse = pi chi2(0.95, 2) sd_ap sd_ml
sqrt(1 - r^2), at most that of r = 0; the root mean squares of two paths and of their difference
obey the triangle inequality, in the mean over people too.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import pi, sqrt

from scipy import stats

from bsip_cli.statistics.published.paper import Paper, PrintedTable, Row
from bsip_cli.statistics.published.printed import Interval, image
from bsip_cli.statistics.published.readings import as_meant
from bsip_cli.statistics.published.slip import Slip, slip, words

METRES = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}
STRAIGHT = 0.95  # correlation of the axes beyond which a path is a line
EVEN = 0.2  # of the least spread over people of the other measures: no measure of sway is so even
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
    if any(one.meets(stated) for one in found):
        return
    whole = Interval(min(one.low for one in found), max(one.high for one in found))
    steps = (METRES[a] / METRES[b] for a in METRES for b in METRES)
    fits = any(Interval(whole.low * k, whole.high * k).meets(stated) for k in steps)
    yield slip(
        table,
        f"{rows[LENGTH].name} / {rows[VELOCITY].name}",
        "duration",
        f"the sequence lasts {stated.middle:g} s",
        f"{words(whole)} s",
        "" if fits else "no choice of units makes it so: they are of different stretches or rates",
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
        reference = table.methods[0]
        yield slip(
            table,
            f"{row.name} {method}",
            "unit",
            f"{row.cells[method].text} beside {reference} {row.cells[reference].text} {row.unit}",
            f"the two paths are {words(error)} mm apart (root mean square)",
            f"the unit is {unit}" if unit else "",
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
        mine, rest = _evenness(row, method), [_evenness(r, method) for r in rows.values()]
        likely = image(
            lambda area, side: area / (_ELLIPSE * side),
            rows[AREA].cells[method].mean,
            rows[other].cells[method].mean,
        )
        most = likely.high / sqrt(1 - STRAIGHT**2)
        others = [one for one in rest if one != mine]
        if mine < EVEN * min(others) and row.cells[method].mean.low > most:
            yield slip(
                table,
                row.name,
                "origin",
                f"{row.cells[method].text}, the same in all people within {100 * mine:.0f} %",
                f"about {likely.middle:.1g} from the area, if about the mean",
                "the distance from an origin that all share, not about the mean",
            )


def _evenness(row: Row, method: str) -> float:
    """Standard deviation over people beside the mean."""
    cell = row.cells[method]
    return cell.sd.middle / cell.mean.middle if cell.sd is not None else float("inf")
