"""TRC files: marker positions as tab-separated text."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bsip_cli.errors import BadDataError
from bsip_cli.files import check_regular
from bsip_cli.recordings.model import Finding
from bsip_cli.recordings.printable import printable
from bsip_cli.recordings.scene_size import settle_unit, without_absurd
from bsip_cli.recordings.units import length_in_m

_MISSING = {"", "nan", "na", "n/a", "none"}
_HEADER = re.compile(r"^\s*frame\s*#", re.IGNORECASE)
_LARGEST_TEXT = 2**30  # bytes


@dataclass(frozen=True, eq=False)
class Trc:
    """A TRC file's content, lab frame."""

    labels: tuple[str, ...]
    time_s: np.ndarray  # (n_frames,), as written
    positions_m: np.ndarray  # (n_frames, n_markers, 3), NaN = missing
    rate_hz: float  # DataRate of the header; NaN if it is none
    findings: tuple[Finding, ...]


@dataclass(frozen=True, eq=False)
class _Table:
    values: np.ndarray  # (n_rows, n_columns)
    findings: tuple[Finding, ...]


def read_trc(path: Path) -> Trc:
    """Read a TRC file; the labels' line may have empty columns."""
    lines = read_lines(path)
    header_at = next((i for i, line in enumerate(lines) if _HEADER.match(line)), None)
    if header_at is None or header_at < 1:
        raise BadDataError(
            "no line that begins with 'Frame#'",
            expected="a TRC file",
            remedy="export the trial again",
            file=path,
        )
    fields = _header_fields(lines[:header_at])
    labels = _labels(lines[header_at])
    table = _table(lines[header_at + 2 :], labels, path)
    raw = table.values[:, 2:].reshape(len(table.values), len(labels), 3)
    raw[(raw == 0).all(axis=-1)] = np.nan
    unit = fields.get("units", "")
    size, about_unit = settle_unit(raw, unit, length_in_m(unit), "Units")
    positions = raw * size
    findings = (
        *_about_counts(fields, len(labels), len(table.values)),
        *table.findings,
        *about_unit,
        *without_absurd(positions),
    )
    rate_hz = _number(fields.get("datarate", ""))
    return Trc(labels, table.values[:, 1], positions, rate_hz, findings)


def read_lines(path: Path) -> list[str]:
    """A text file's lines; what cannot be opened or is no text is refused."""
    check_regular(path)
    try:
        if path.stat().st_size > _LARGEST_TEXT:
            raise BadDataError(
                f"a text of {path.stat().st_size / 1e9:.1f} GB",
                expected=f"at most {_LARGEST_TEXT / 1e9:.1f} GB",
                remedy="cut the trial into shorter ones",
                file=path,
            )
        lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    except OSError as error:
        raise BadDataError(
            f"cannot be opened ({error.strerror})",
            expected="a readable text file",
            remedy="check the file",
            file=path,
        ) from error
    if not lines:
        raise BadDataError(
            "the file is empty",
            expected="a text file",
            remedy="copy or export the trial again",
            file=path,
        )
    return lines


def row_counts(what: str, stated: float, found: int) -> list[Finding]:
    """A warning where a header counts other rows or columns than the file has."""
    if not np.isfinite(stated) or stated == found:
        return []
    return [
        Finding(
            check="layout",
            subject="",
            found=f"the header counts {stated:g} {what}, the file has {found}",
            expected="one count",
            action=f"read {found}",
            level="warning",
        )
    ]


def _labels(line: str) -> tuple[str, ...]:
    """Names behind 'Frame#' and 'Time', apart by tabs, or by blanks in a line without tabs."""
    if "\t" in line:
        return tuple(printable(name.strip()) for name in line.split("\t")[2:] if name.strip())
    return tuple(map(printable, _HEADER.sub("", line).split()[1:]))


def _header_fields(lines: list[str]) -> dict[str, str]:
    """The line of names above the line of values, as a mapping in lower case."""
    if len(lines) < 2:
        return {}
    names, values = lines[-2].split(), lines[-1].split()
    return {name.lower(): text for name, text in zip(names, values, strict=False)}


def _about_counts(fields: dict[str, str], n_markers: int, n_frames: int) -> list[Finding]:
    return [
        *row_counts("markers", _number(fields.get("nummarkers", "")), n_markers),
        *row_counts("frames", _number(fields.get("numframes", "")), n_frames),
    ]


def _table(lines: list[str], labels: tuple[str, ...], path: Path) -> _Table:
    n_columns = 2 + 3 * len(labels)
    rows = [_cells(line, n_columns) for line in lines if line.strip()]
    if not rows or not labels:
        raise BadDataError(
            "no marker data",
            expected="a TRC file with markers",
            remedy="export the trial again",
            file=path,
        )
    findings = []
    if len(rows) > 1 and len(rows[-1]) < n_columns:
        rows.pop()
        findings.append(_cut_row())
    _check_widths(rows, n_columns, labels, path)
    table = np.array([[_number(cell) for cell in _padded(row, n_columns)] for row in rows])
    if not np.isfinite(table[:, 1]).all():
        raise BadDataError(
            "a row without a time",
            expected="times in column 2, numbers with a decimal point",
            remedy="export the trial again",
            file=path,
        )
    findings += _about_words(rows)
    return _Table(table, tuple(findings))


def _cells(line: str, n_columns: int) -> list[str]:
    """A row's cells: by blanks if that gives the right number, else by tabs; empty ones at
    its end are dropped."""
    cells = line.split()
    if len(cells) == n_columns:
        return cells
    cells = [cell.strip() for cell in line.rstrip("\r\n").split("\t")]
    while len(cells) > n_columns and not cells[-1]:
        cells.pop()
    return cells


def _check_widths(
    rows: list[list[str]], n_columns: int, labels: tuple[str, ...], path: Path
) -> None:
    """Editors cut empty cells at the end, whole markers of them; else cells are shifted."""
    widths = {len(row) for row in rows}
    shifted = [w for w in widths if w > n_columns or (n_columns - w) % 3]
    if max(widths) == n_columns and not shifted:
        return
    raise BadDataError(
        f"a row of {max(shifted or widths)} cells under {len(labels)} labels",
        expected=f"{n_columns} cells: frame, time and three for each label",
        remedy="export the trial again",
        file=path,
    )


def _padded(row: list[str], n_columns: int) -> list[str]:
    return row + [""] * (n_columns - len(row))


def _cut_row() -> Finding:
    return Finding(
        check="layout",
        subject="",
        found="the last row is cut",
        expected="a complete file",
        action="left that row out",
        level="warning",
    )


def _about_words(rows: list[list[str]]) -> list[Finding]:
    words = [
        cell
        for row in rows
        for cell in row[2:]
        if cell.lower() not in _MISSING and not np.isfinite(_number(cell))
    ]
    if not words:
        return []
    return [
        Finding(
            check="layout",
            subject="",
            found=f"{len(words)} cells that are no numbers, as '{words[0][:20]}'",
            expected="numbers, or empty cells where a marker is missing",
            action="took them as missing",
            level="warning",
        )
    ]


def _number(cell: str) -> float:
    if cell.lower() in _MISSING:
        return float("nan")
    try:
        return float(cell)
    except ValueError:
        return float("nan")
