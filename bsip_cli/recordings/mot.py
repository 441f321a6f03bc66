"""MOT files: ground forces as OpenSim writes them, in the namings of many laboratories."""

from __future__ import annotations

import re
import unicodedata
from array import array
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from bsip_cli.errors import BadDataError, printable
from bsip_cli.files.regular import read_toml, shipped
from bsip_cli.recordings.model import Finding, refusal
from bsip_cli.recordings.plates import LIGHT_N
from bsip_cli.recordings.text_tables import (
    ROWS_LOOKED_AT,
    Dialect,
    LastDigit,
    Stamps,
    agreeing,
    check_names,
    dialect_of,
    head_of,
    number,
    parted,
    row_counts,
    separator_of,
    text_lines,
    values_of,
    without_end,
)
from bsip_cli.recordings.units import force_in_N, length_in_m, moment_in_Nm

_ROWS = re.compile(r"^(?:nrows\s*=|datarows)\s*(\d{1,12})$", re.IGNORECASE)
_TIME = re.compile(
    r"(?:(?:abs|rel|elapsed)\w*[\W_]+)?(?:times?|zeit|temps|tiempo|tempo)(?![a-z])"
    r"|(?:t|sec(?:onds?)?)$",
    re.IGNORECASE,
)
_AGAIN = "export the forces again"
_MOST_FORCES = 64  # as many plates are read of a C3D file
_NAMES_SHOWN = 12
_ZERO = -1  # the column of what is zero
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
    """What a MOT or STO file holds: times, each plate's force, and what was found odd."""

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
    force_N: float  # what a force of 1 is, in the unit of its column

    def unit(self, column: int) -> str:
        """In brackets behind the column's name, else in the row of units."""
        if column == 0 and (bracket := re.search(r"[\[(_]([^\[\]()]+)[\])]?$", self.names[0])):
            return bracket[1]
        return _without_unit(self.names[column])[1] or self.units[column].strip("[]() ")


def read_mot(path: Path, force_N: float = 1.0) -> Mot:
    """Read the ground forces of a MOT (or STO) file; force_N : what a force of 1 is.

    A missing point or moment of a force that is zero is zero: nothing acts there.
    """
    lines = text_lines(path)
    header, end = head_of(lines, lambda line: line.strip().lower() == "endheader" or _names(line))
    first = end if end and _names(end) else next((line for line in lines if line.strip()), "")
    if end is None or not first:
        raise _no_table(path)
    table = _read_table(lines, first, path, force_N)
    stated = next((float(m[1]) for line in header if (m := _ROWS.match(line.strip()))), np.nan)
    findings = row_counts("rows of forces", stated, len(table.values))
    if table.is_cut:
        found, action = "the last row of forces is cut", "left that row out"
        findings.append(Finding("layout", "", found, "a complete file", action, "warning"))
    findings += table.dialect.about_commas()
    times = table.values[:, 0]
    forces, about_columns = _forces(table, path)
    stamps = Stamps(times, table.time_digits.sizes(times), table.unit(0))
    return Mot(stamps, forces, (*findings, *about_columns))


def _names(line: str) -> bool:
    """Whether a line names columns: files without 'endheader'."""
    words = parted(line, separator_of(line))
    return len(words) > 3 and _time_column(words) is not None


def _time_column(names: list[str]) -> int | None:
    """The first, or the second behind numbers of frames."""
    first = [k for k, name in enumerate(names[:2]) if _TIME.match(name)]
    return first[0] if first and meaning_of(names[0]) is None else None


def _no_table(path: Path) -> BadDataError:
    return refusal(path, "no table after 'endheader'", "a MOT file", _AGAIN)


def _read_table(lines: Iterator[str], first: str, path: Path, force_N: float) -> _Table:
    """The table below the line of names, which may be parted otherwise than its rows."""
    mark = separator_of(first)
    check_names(parted(first, mark), "columns", path)
    rows = (line for line in lines if line.strip())
    top, units = list(islice(rows, ROWS_LOOKED_AT)), ""
    if top and not any(np.isfinite(number(word)) for word in re.split(r"[\s;,]+", top[0])):
        units, *top = top
    if not top:
        raise _no_table(path)
    alone = without_end(parted(first, mark)), dialect_of(mark, top)
    names, dialect = next(agreeing(first, top), alone)
    if (first_column := _time_column(names)) is None:
        found = f"first column '{printable(names[0][:40]) if names else ''}'"
        raise refusal(path, found, "time", _AGAIN)
    said = parted(units, separator_of(units))
    values, digits, is_cut = _values(chain(top, rows), len(names), first_column, dialect, path)
    units_of = said if len(said) == len(names) else [""] * len(names)
    names, units_of = names[first_column:], units_of[first_column:]
    return _Table(names, units_of, values, digits, is_cut, dialect, force_N)


def _values(
    rows: Iterator[str], n_columns: int, first_column: int, dialect: Dialect, path: Path
) -> tuple[np.ndarray, LastDigit, bool]:
    """(n_rows, n_columns) without those before the first, eight bytes for each cell and no more;
    whether the last row is cut."""
    values, digits, short, goes_on = array("d"), LastDigit(), 0, False
    for row in rows:
        if goes_on := short > 0:
            break
        cells = dialect.cells(row)
        while len(cells) > n_columns and not cells[-1]:
            cells.pop()
        if len(cells) != n_columns:
            short = len(cells)
            continue
        cells = cells[first_column:]
        row_values, words = values_of(cells)
        if words:
            found = f"its table cannot be read: '{printable(words[0][:40])}' is no number"
            expected = "numbers, and empty cells or nan where one is missing"
            raise refusal(path, found, expected, _AGAIN)
        digits.add(cells[0])
        values.extend(row_values)
    is_cut = 0 < short < n_columns and len(values) > 0 and not goes_on
    if short and not is_cut:
        expected = f"{n_columns}, as many as there are columns"
        raise refusal(path, f"a row of {short} cells", expected, _AGAIN)
    table = np.array(values).reshape(-1, n_columns - first_column)
    table[~np.isfinite(table)] = np.nan
    return table, digits, is_cut


# --- what the columns mean ------------------------------------------------------------------------

_SAID = read_toml(shipped("column_words.toml"))
_WORDS, _SHORT = (
    {word: meaning for meaning, words in _SAID[kind].items() for word in words.split()}
    for kind in ("quantities", "short")
)
_MEANINGS = _WORDS | _SHORT | {"fp": "ground"}
_LINKS = "|".join(_SAID["links"]["all"].split())
_LINKS += "|(?:d|l|dell)(?=['\N{RIGHT SINGLE QUOTATION MARK}])"
_LETTERS = {"v": "force", "f": "force", "p": "point", "c": "point", "m": "moment", "t": "torque"}
_LETTERS |= {"a": "kistler"}  # Ax and Ay are points there, and accelerations elsewhere
# As OpenSim names ahead, up and to the right; session_reading looks which way they really go.
_NAMED = {
    r"anter(?:ior|o)[\W_]*posterior|ap": "x",
    r"medi(?:al|o)[\W_]*lateral|ml": "z",
    "vertical|vert|v": "y",
}
# An axis comes with or without the letter of its quantity (vx, Fx, px, x).
_KNOWN = "|".join(sorted(_WORDS, key=len, reverse=True))
_BEGINS = "(?:(?<![a-z])|(?<=cop)|(?<=grf)|(?<=force)|(?<=moment)|(?<=torque))"
_AXIS = rf"(?:[vfpcmta]?[xyz](?=[lr]?(?![a-z]))|(?<![a-z])[xyz](?={_KNOWN})"
_AXIS += rf"|{_BEGINS}[fpcmt]?(?:{'|'.join(_NAMED)})(?:(?![a-z])|(?={_KNOWN})))"
_TOKEN = re.compile(
    rf"(?P<word>{_KNOWN}|fp(?![a-z])|(?<![a-z])(?:{'|'.join(_SHORT)})(?=[xyz]?(?![a-z])))"
    rf"|(?<![a-z])(?:{_LINKS})(?![a-z])|(?P<number>\d+)|(?P<axis>{_AXIS})"
    rf"|(?P<other>[lr](?={_AXIS})|[a-z]+?(?={_KNOWN}|{_AXIS}|[^a-z]|$))"
)
_PRESSURE_PLATE = re.compile(r"pressure(?=[\W_]*plat)")  # says nothing of points
_JOINT_REACTION = re.compile(r"_on_.+_in_")  # OpenSim's: body_on_body_in_frame
_BRACKET = re.compile(r"[\[(]([^\[\]()]*)[\])]")
_PLATE = re.compile(r"[^\W\d]*[\W_]*\d{1,2}|[lrgdise]", re.IGNORECASE)


class Meaning(NamedTuple):
    """What one column holds."""

    plate: str  # "" where the name says none
    quantity: str  # force, point, moment, torque; kistler: a point, or an acceleration
    axis: str  # x, y, z


def meaning_of(name: str) -> Meaning | None:
    """A column's meaning: '1_ground_force_px' is x of the point of plate '1'.

    None for a name with no axis, with two, or with no word or letter for a quantity, and for the
    force between two bodies.
    """
    letters = unicodedata.normalize("NFKD", _without_unit(name)[0].lower())
    plain = _PRESSURE_PLATE.sub("", "".join(x for x in letters if not unicodedata.combining(x)))
    tokens = list(_TOKEN.finditer(plain))
    axes = [token["axis"] for token in tokens if token["axis"]]
    if len(axes) != 1 or _JOINT_REACTION.search(plain):
        return None
    said = [_MEANINGS[token["word"]] for token in tokens if token["word"]]
    plate = [part for token in tokens if (part := token["number"] or token["other"])]
    plate += [word[0] for token in tokens if _MEANINGS.get(word := token["word"]) == "side"]
    letter, axis = _axis(axes[0])
    if letter == "v" and not {"force", "ground"} & set(said):
        return None  # a velocity
    quantities = [one for one in said if one in _LETTERS.values()]
    # The centre of pressure of a force, the moment on a force plate.
    quantities = [one for one in quantities if one != "force"] or quantities
    quantity = _LETTERS[letter] if letter else quantities[-1] if quantities else ""
    if not quantity and (alone := next((part for part in plate if part in _LETTERS), "")):
        plate.remove(alone)  # F1_x
        quantity = _LETTERS[alone]
    return Meaning("".join(plate), quantity, axis) if quantity else None


def _axis(token: str) -> tuple[str, str]:
    """The letter of a quantity, if there is one, and x, y or z."""
    for names, axis in _NAMED.items():
        if named := re.fullmatch(rf"([a-z]?)(?:{names})", token):
            return named[1], axis
    return token[:-1], token[-1]


def _without_unit(name: str) -> tuple[str, str]:
    """A name and the unit in its brackets: what stands at its end and is no plate, or is known."""
    for bracket in _BRACKET.finditer(name):
        inside = bracket[1].strip()
        is_known = any(size(inside) for size in (length_in_m, force_in_N, moment_in_Nm))
        is_last = not name[bracket.end() :].strip()
        if is_known or (is_last and not _PLATE.fullmatch(inside)):
            return f"{name[: bracket.start()]} {name[bracket.end() :]}".strip(), inside
    return name, ""


def _forces(table: _Table, path: Path) -> tuple[tuple[GroundForce, ...], list[Finding]]:
    """The forces of each plate that has some, and the columns that are not understood."""
    plates: dict[str, dict[str, dict[str, int]]] = defaultdict(lambda: defaultdict(dict))
    for i, name in enumerate(table.names):
        if (meaning := meaning_of(name)) is None:
            continue
        first = plates[meaning.plate][meaning.quantity].setdefault(meaning.axis, i)
        if first != i:
            found = f"columns '{table.names[first]}' and '{name}', which say the same of one plate"
            expected = "a column for each axis of each plate"
            raise refusal(path, found, expected, "rename one of them")
    plates = _with_their_points(plates)
    if len(plates) > _MOST_FORCES:
        found = f"{len(plates)} ground forces"
        raise refusal(path, found, f"at most {_MOST_FORCES}", _AGAIN)
    if not plates:
        found = "no ground force among the columns " + ", ".join(table.names[:8])
        remedy = f"rename the columns or {_AGAIN}"
        raise refusal(path, found, "columns like ground_force_1_vx", remedy)
    forces, used, about = [], {0}, []
    for k, (plate, of_plate) in enumerate(plates.items()):
        columns = _columns_of(plate or str(k + 1), of_plate, table, path)
        forces.append(_force(str(k + 1), columns, table, path))
        used.update(chain(*columns.values()))
        if some := [quantity for quantity, own in columns.items() if _ZERO in own]:
            found = f"no columns for a part of its {' and '.join(some)}"
            action = "took the height of points, and torques about level axes, as zero"
            about.append(Finding("columns", str(k + 1), found, "x, y and z", action, "info"))
    largest = max(np.abs(f.force_N[np.isfinite(f.force_N)]).max(initial=0) for f in forces)
    for force in forces:  # a missing point or moment of no force is zero
        idle = (np.abs(force.force_N) <= _NO_FORCE * largest).all(axis=1)
        light = np.linalg.norm(force.force_N, axis=1) < LIGHT_N
        for values in (force.point, force.moment):
            if values is not None:
                values[idle & ~np.isfinite(values).all(axis=1)] = 0.0
                _hold_nearest(values, light & ~np.isfinite(values).all(axis=1), ~light)
    unknown = [name for i, name in enumerate(table.names) if i not in used]
    told = ", ".join(printable(name[:40]) for name in unknown[:_NAMES_SHOWN])
    more = f" and {len(unknown) - _NAMES_SHOWN} more" if len(unknown) > _NAMES_SHOWN else ""
    found = f"{len(unknown)} columns of the forces that are not understood: {told}{more}"
    expected = "force, point and moment of each plate, by axis"
    left_out = Finding("columns", "", found, expected, "left them out", "info")
    return tuple(forces), [*about, *([left_out] if unknown else [])]


def _with_their_points(
    plates: dict[str, dict[str, dict[str, int]]],
) -> dict[str, dict[str, dict[str, int]]]:
    """Those that have a force: a single one with what belongs to no plate by its name."""
    known = {name: columns for name, columns in plates.items() if "force" in columns}
    if len(known) == 1:
        known = {name: plates.get("", {}) | columns for name, columns in known.items()}
    for columns in known.values():
        aims = columns.pop("kistler", {})
        if len(aims) == 2 and "point" not in columns:
            columns["point"] = aims
    return known


def _hold_nearest(values: np.ndarray, missing: np.ndarray, known: np.ndarray) -> None:
    """Fill missing rows (n, 3) by those nearest in time that are known under load, in place."""
    rows = np.flatnonzero(known & np.isfinite(values).all(axis=1))
    if len(rows):
        here = np.flatnonzero(missing)
        after = np.searchsorted(rows, here).clip(1, len(rows) - 1) if len(rows) > 1 else 0 * here
        before = (after - 1).clip(0)
        is_nearer = here - rows[before] < rows[after] - here
        values[here] = values[np.where(is_nearer, rows[before], rows[after])]


def _columns_of(
    plate: str, columns: dict[str, dict[str, int]], table: _Table, path: Path
) -> dict[str, list[int]]:
    """Of force, point and moment, as far as a plate has them, the columns x, y and z; `_ZERO` for
    the height of a point, and level torques at it, where these are left out.

    Of moments and torques it is these beside a point: free ones.
    """
    sizes = {axis: np.nansum(np.abs(table.values[:, k])) for axis, k in columns["force"].items()}
    up = max(sizes, key=sizes.__getitem__)
    for quantity, axes in columns.items():
        known = set(axes)
        is_flat = quantity == "point" and known | {up} == set("xyz")
        is_free = quantity in ("moment", "torque") and known == {up} and "point" in columns
        if len(known) < 3 and not (len(sizes) == 3 and (is_flat or is_free)):
            column = printable(table.names[next(iter(axes.values()))])
            found = (
                f"only {' and '.join(sorted(axes))} of the {quantity} of plate "
                f"'{printable(plate)}' (column '{column}')"
            )
            remedy = (
                "export all three, or add a column of zeros where it is zero by definition "
                "(the height of a point on the floor, a torque about a level axis)"
            )
            raise refusal(path, found, "columns for x, y and z", remedy)
    own = {
        quantity: [axes.get(axis, _ZERO) for axis in "xyz"] for quantity, axes in columns.items()
    }
    moments = [own.pop(name) for name in ("torque", "moment") if name in own]
    return own | ({"moment": moments[0 if "point" in own else -1]} if moments else {})


def _force(name: str, columns: dict[str, list[int]], table: _Table, path: Path) -> GroundForce:
    values = {
        quantity: np.where(np.array(own) == _ZERO, 0.0, table.values[:, own])
        for quantity, own in columns.items()
    }
    units = {quantity: table.unit(max(own)) for quantity, own in columns.items()}
    size = force_in_N(units["force"]) if units["force"] else 1.0
    if size is None:
        found, remedy = f"forces in '{printable(units['force'][:20])}'", "export the forces in N"
        raise refusal(path, found, "N or kN", remedy)
    return GroundForce(
        name,
        values["force"] * size * table.force_N,
        values.get("point"),
        values["moment"] * table.force_N if "moment" in values else None,
        units.get("point", ""),
        units.get("moment", ""),
    )
