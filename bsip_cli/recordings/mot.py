"""MOT files: ground forces as OpenSim writes them, in several namings."""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.model import Finding
from bsip_cli.recordings.text_lines import check_names, head_of, row_counts, text_lines

_COLUMN = re.compile(
    r"^(?P<before>.*?)(?P<what>force|torque|moment|grf|grm|cop)(?P<between>.*?)"
    r"(?P<kind>[vpmtf]?)_?(?P<axis>[xyz])$"
)
_SHORT = re.compile(  # F1_x, P1_x, M1_x and FP1_Fx, FP1_Px, FP1_Mx
    r"^(?:(?P<kind1>[fpmt])(?P<id1>\d+)|fp(?P<id2>\d+)_(?P<kind2>[fpmt]))_?(?P<axis>[xyz])$"
)
_ROWS = re.compile(r"^(?:nrows\s*=|datarows)\s*(\d{1,12})$", re.IGNORECASE)
_MOST_FORCES = 64  # as many plates are read of a C3D file
_KINDS = {"v": "force", "f": "force", "p": "point", "m": "torque", "t": "torque"}
_BARE = {
    "force": "force",
    "grf": "force",
    "torque": "torque",
    "moment": "torque",
    "grm": "torque",
    "cop": "point",
}


@dataclass(frozen=True, eq=False)
class GroundForce:
    """One force: as written, lab frame."""

    name: str
    force_N: np.ndarray  # (n, 3)
    point: np.ndarray | None  # (n, 3), in the file's length unit
    moment: np.ndarray | None  # (n, 3), as written


@dataclass(frozen=True, eq=False)
class Mot:
    time_s: np.ndarray  # (n,)
    forces: tuple[GroundForce, ...]
    findings: tuple[Finding, ...]


def read_mot(path: Path) -> Mot:
    """Read the ground forces of a MOT (or STO) file."""
    lines = text_lines(path)
    header, end = head_of(lines, lambda line: line.strip().lower() == "endheader")
    first = next((line for line in lines if line.strip()), "") if end else ""
    names = first.replace(",", " ").split()
    if not names:
        raise _no_table(path)
    check_names(names, "columns", path)
    if names[0].lower() != "time":
        raise BadDataError(
            f"first column '{names[0]}'",
            expected="time",
            remedy="export the forces again",
            file=path,
        )
    table = _table(lines, len(names), "," in first, path)
    if not len(table):
        raise _no_table(path)
    findings = row_counts("rows of forces", _stated_rows(header), len(table))
    return Mot(table[:, 0], _forces(names, table, path), tuple(findings))


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


def _table(lines: Iterator[str], n_columns: int, by_commas: bool, path: Path) -> np.ndarray:
    """(n_rows, n_columns); eight bytes for each cell and no more."""
    values = array("d")
    for line in lines:
        cells = (line.replace(",", " ") if by_commas else line).split()
        if cells and len(cells) != n_columns:
            raise BadDataError(
                f"a row of {len(cells)} cells",
                expected=f"{n_columns}, as many as there are columns",
                remedy="export the forces again",
                file=path,
            )
        try:
            values.extend(map(float, cells))
        except ValueError as error:
            raise BadDataError(
                f"its table cannot be read: {str(error)[:80]}",
                expected="numbers with a decimal point",
                remedy="export the forces again",
                file=path,
            ) from error
    return np.frombuffer(values).reshape(-1, n_columns)


def _forces(names: list[str], table: np.ndarray, path: Path) -> tuple[GroundForce, ...]:
    columns: dict[str, dict[tuple[str, str], int]] = {}
    for i, name in enumerate(names):
        if (meaning := _meaning(name)) is not None:
            identity, kind, axis = meaning
            columns.setdefault(identity, {}).setdefault((kind, axis), i)
    forces: list[GroundForce] = []
    for found in columns.values():
        if all(("force", axis) in found for axis in "xyz"):
            parts = {k: _vector(found, k, table) for k in ("force", "point", "torque")}
            assert parts["force"] is not None
            name = str(len(forces) + 1)
            forces.append(GroundForce(name, parts["force"], parts["point"], parts["torque"]))
    if len(forces) > _MOST_FORCES:
        raise BadDataError(
            f"{len(forces)} ground forces",
            expected=f"at most {_MOST_FORCES}",
            remedy="export the forces again",
            file=path,
        )
    if not forces:
        raise BadDataError(
            "no ground force among the columns " + ", ".join(names[:8]),
            expected="columns like ground_force_1_vx",
            remedy="rename the columns or export the forces again",
            file=path,
        )
    return tuple(forces)


def _meaning(name: str) -> tuple[str, str, str] | None:
    """A column's plate, kind and axis: '1_ground_force_px' is ('1', 'point', 'x')."""
    if short := _SHORT.match(name.lower()):
        kind = _KINDS[short["kind1"] or short["kind2"]]
        return short["id1"] or short["id2"], kind, short["axis"]
    match = _COLUMN.match(name.lower()) if name.lower().endswith(("x", "y", "z")) else None
    if match is None:
        return None
    kind = _KINDS.get(match["kind"]) or _BARE[match["what"]]
    identity = re.sub(r"ground|reaction|[_\s]", "", match["before"] + match["between"])
    return identity, kind, match["axis"]


def _vector(found: dict[tuple[str, str], int], kind: str, table: np.ndarray) -> np.ndarray | None:
    """Three columns of the table, (n, 3); None where the file has none."""
    if not any((kind, axis) in found for axis in "xyz"):
        return None
    zero = np.zeros(len(table))
    return np.column_stack(
        [table[:, found[kind, axis]] if (kind, axis) in found else zero for axis in "xyz"]
    )
