"""MOT files: ground forces as OpenSim writes them, in the namings of many laboratories."""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path

import numpy as np

from bsip_cli.errors import BadDataError, printable
from bsip_cli.recordings.force_columns import PlateColumns, by_plate, meaning_of
from bsip_cli.recordings.model import Finding
from bsip_cli.recordings.text_cells import (
    Dialect,
    LastDigit,
    agreeing,
    dialect_of,
    is_missing,
    number,
    parted,
    separator_of,
    without_end,
)
from bsip_cli.recordings.text_lines import check_names, head_of, row_counts, text_lines
from bsip_cli.recordings.timebase import Stamps
from bsip_cli.recordings.units import force_in_N

_ROWS = re.compile(r"^(?:nrows\s*=|datarows)\s*(\d{1,12})$", re.IGNORECASE)
_TIME = re.compile(r"^times?\b|^t$", re.IGNORECASE)
_MOST_FORCES = 64  # as many plates are read of a C3D file
_NAMES_TOLD = 12
_ROWS_LOOKED_AT = 20  # to see how the table is written
_NO_FORCE = 1e-9  # of the trial's largest force: where its point lies says nothing


@dataclass(frozen=True, eq=False)
class GroundForce:
    """One force: as written, lab frame."""

    name: str
    force_N: np.ndarray  # (n, 3)
    point: np.ndarray | None  # (n, 3), unit unknown; None: the file has no such columns
    moment: np.ndarray | None  # (n, 3), unit and reference point unknown; None: no such columns
    point_unit: str = ""  # as the file says in brackets or in a row of units, "" if it does not
    moment_unit: str = ""


@dataclass(frozen=True, eq=False)
class Mot:
    stamps: Stamps  # (n,)
    forces: tuple[GroundForce, ...]
    findings: tuple[Finding, ...]


@dataclass(frozen=True, eq=False)
class _Table:
    names: list[str]
    units: list[str]  # a row of units below the names, empty strings without one
    values: np.ndarray  # (n, n_columns), NaN = missing
    time_digits: LastDigit
    is_cut: bool
    dialect: Dialect


def read_mot(path: Path) -> Mot:
    """Read the ground forces of a MOT (or STO) file.

    A missing point or moment of a force that is zero is zero: nothing acts there.
    """
    lines = text_lines(path)
    header, end = head_of(lines, lambda line: line.strip().lower() == "endheader" or _names(line))
    first = end if end and _names(end) else next((line for line in lines if line.strip()), "")
    if end is None or not first:
        raise _no_table(path)
    table = _read_table(lines, first, path)
    findings = row_counts("rows of forces", _stated_rows(header), len(table.values))
    if table.is_cut:
        findings.append(
            Finding(
                "layout",
                "",
                "the last row of forces is cut",
                "a complete file",
                "left that row out",
                "warning",
            )
        )
    findings += table.dialect.about_commas()
    times = table.values[:, 0]
    forces, about_columns = _forces(table, path)
    stamps = Stamps(times, table.time_digits.sizes(times), _unit(table, 0))
    return Mot(stamps, forces, (*findings, *about_columns))


def _names(line: str) -> bool:
    """Whether a line names columns: files without 'endheader'."""
    words = parted(line, separator_of(line))
    return len(words) > 3 and _TIME.match(words[0]) is not None


def _no_table(path: Path) -> BadDataError:
    return BadDataError(
        "no table after 'endheader'",
        expected="a MOT file",
        remedy="export the forces again",
        file=path,
    )


def _stated_rows(header: list[str]) -> float:
    """nRows=... or datarows ...; NaN if the header says nothing."""
    for line in header:
        if match := _ROWS.match(line.strip()):
            return float(match[1])
    return float("nan")


def _read_table(lines: Iterator[str], first: str, path: Path) -> _Table:
    """The table below the line of names, which may be parted otherwise than its rows."""
    check_names(parted(first, separator_of(first)), "columns", path)
    rows = (line for line in lines if line.strip())
    top, units = list(islice(rows, _ROWS_LOOKED_AT)), ""
    if top and not any(np.isfinite(number(word)) for word in re.split(r"[\s;,]+", top[0])):
        units, *top = top
    if not top:
        raise _no_table(path)
    mark = separator_of(first)
    alone = without_end(parted(first, mark)), dialect_of(mark, top)
    names, dialect = next(agreeing(first, top), alone)
    if not names or not _TIME.match(names[0]):
        raise BadDataError(
            f"first column '{printable(names[0][:40]) if names else ''}'",
            expected="time",
            remedy="export the forces again",
            file=path,
        )
    said = parted(units, separator_of(units))
    values, digits, is_cut = _values(chain(top, rows), len(names), dialect, path)
    units_of = said if len(said) == len(names) else [""] * len(names)
    return _Table(names, units_of, values, digits, is_cut, dialect)


def _values(
    rows: Iterator[str], n_columns: int, dialect: Dialect, path: Path
) -> tuple[np.ndarray, LastDigit, bool]:
    """(n_rows, n_columns), eight bytes for each cell and no more; whether the last row is cut."""
    values, digits, short = array("d"), LastDigit(), 0
    for row in rows:
        if short:
            raise _misfit(short, n_columns, path)
        cells = dialect.cells(row)
        while len(cells) > n_columns and not cells[-1]:
            cells.pop()
        if len(cells) != n_columns:
            short = len(cells)
            continue
        digits.add(cells[0])
        values.extend(_numbers(cells, path))
    is_cut = 0 < short < n_columns and len(values) > 0
    if short and not is_cut:
        raise _misfit(short, n_columns, path)
    table = np.array(values).reshape(-1, n_columns)
    table[~np.isfinite(table)] = np.nan
    return table, digits, is_cut


def _misfit(n_cells: int, n_columns: int, path: Path) -> BadDataError:
    return BadDataError(
        f"a row of {n_cells} cells",
        expected=f"{n_columns}, as many as there are columns",
        remedy="export the forces again",
        file=path,
    )


def _numbers(cells: list[str], path: Path) -> list[float]:
    try:
        return list(map(float, cells))
    except ValueError:
        word = next((c for c in cells if not is_missing(c) and np.isnan(number(c))), "")
    if word:
        raise BadDataError(
            f"its table cannot be read: '{printable(word[:40])}' is no number",
            expected="numbers, and empty cells or nan where one is missing",
            remedy="export the forces again",
            file=path,
        )
    return list(map(number, cells))


def _forces(table: _Table, path: Path) -> tuple[tuple[GroundForce, ...], list[Finding]]:
    plates, twice = by_plate(table.names)
    if twice:
        one, other = twice[0]
        raise BadDataError(
            f"columns '{one}' and '{other}', which say the same of one plate",
            expected="a column for each axis of each plate",
            remedy="rename one of them",
            file=path,
        )
    if len(plates) > _MOST_FORCES:
        raise BadDataError(
            f"{len(plates)} ground forces",
            expected=f"at most {_MOST_FORCES}",
            remedy="export the forces again",
            file=path,
        )
    if not plates:
        raise BadDataError(
            "no ground force among the columns " + ", ".join(table.names[:8]),
            expected="columns like ground_force_1_vx",
            remedy="rename the columns or export the forces again",
            file=path,
        )
    used = {0}
    read = [_force(str(k + 1), plate, table, used, path) for k, plate in enumerate(plates)]
    largest = max(np.abs(f.force_N[np.isfinite(f.force_N)]).max(initial=0) for f in read)
    forces = tuple(_without_idle(force, _NO_FORCE * largest) for force in read)
    return forces, _about_columns([n for i, n in enumerate(table.names) if i not in used])


def _force(
    name: str, plate: PlateColumns, table: _Table, used: set[int], path: Path
) -> GroundForce:
    """One plate's columns; marks them in ``used``."""
    found: dict[str, list[int] | None] = {}
    for quantity, columns in plate.columns.items():
        found[quantity] = plate.of(quantity)
        if found[quantity] is None:
            axes = " and ".join(sorted(columns))
            raise BadDataError(
                f"only {axes} of the {quantity} of plate '{printable(plate.plate) or name}' "
                f"(column '{printable(table.names[next(iter(columns.values()))])}')",
                expected="columns for x, y and z",
                remedy="export all three, or add a column of zeros where it is zero by definition "
                "(the height of a point on the floor, a torque about a level axis)",
                file=path,
            )
    force, point = found["force"], found.get("point")
    one, other = found.get("torque"), found.get("moment")
    moment = one or other if point else other or one
    for chosen in (force, point, moment):
        used.update(chosen or ())
    assert force is not None
    return GroundForce(
        name,
        table.values[:, force] * _newtons(table, force, path),
        table.values[:, point] if point else None,
        table.values[:, moment] if moment else None,
        _unit(table, point[0]) if point else "",
        _unit(table, moment[0]) if moment else "",
    )


def _newtons(table: _Table, columns: Sequence[int], path: Path) -> float:
    unit = _unit(table, columns[0])
    size = force_in_N(unit) if unit else 1.0
    if size is None:
        raise BadDataError(
            f"forces in '{printable(unit[:20])}'",
            expected="N or kN",
            remedy="export the forces in N",
            file=path,
        )
    return size


def _unit(table: _Table, column: int) -> str:
    """In brackets behind the column's name, else in the row of units."""
    if (meaning := meaning_of(table.names[column])) is not None and meaning.unit:
        return meaning.unit
    if column == 0 and (bracket := re.search(r"[\[(_]([^\[\]()]+)[\])]?$", table.names[0])):
        return bracket[1]
    return table.units[column].strip("[]() ")


def _without_idle(force: GroundForce, least_N: float) -> GroundForce:
    """With zero for a missing point or moment where the force is zero."""
    idle = (np.abs(force.force_N) <= least_N).all(axis=1)
    for values in (force.point, force.moment):
        if values is not None:
            values[idle & ~np.isfinite(values).all(axis=1)] = 0.0
    return force


def _about_columns(unknown: list[str]) -> list[Finding]:
    if not unknown:
        return []
    told = ", ".join(printable(name[:40]) for name in unknown[:_NAMES_TOLD])
    more = f" and {len(unknown) - _NAMES_TOLD} more" if len(unknown) > _NAMES_TOLD else ""
    return [
        Finding(
            check="columns",
            subject="",
            found=f"{len(unknown)} columns of the forces that are not understood: {told}{more}",
            expected="force, point and moment of each plate, by axis",
            action="left them out",
            level="info",
        )
    ]
