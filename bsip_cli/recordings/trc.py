"""TRC files: marker positions as tab-separated text."""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from math import isfinite, nan
from pathlib import Path

import numpy as np

from bsip_cli.errors import BadDataError, printable
from bsip_cli.recordings.model import Finding
from bsip_cli.recordings.scene_size import settle_unit, without_absurd
from bsip_cli.recordings.text_lines import check_names, head_of, row_counts, text_lines
from bsip_cli.recordings.units import length_in_m

_MISSING = {"", "nan", "na", "n/a", "none"}
_SOON = 100_000  # rows, a quarter of an hour at 100 Hz: the last marker is seen in one of them
_HEADER = re.compile(r"^\s*frame\s*#", re.IGNORECASE)


@dataclass(frozen=True, eq=False)
class Trc:
    """A TRC file's content, lab frame."""

    labels: tuple[str, ...]
    time_s: np.ndarray  # (n_frames,), as written
    positions_m: np.ndarray  # (n_frames, n_markers, 3), NaN = missing
    rate_hz: float  # DataRate of the header; NaN if it is none
    findings: tuple[Finding, ...]


def read_trc(path: Path) -> Trc:
    """Read a TRC file; the labels' line may have empty columns."""
    lines = text_lines(path)
    above, heading = head_of(lines, _HEADER.match)
    if heading is None or not above:
        raise BadDataError(
            "no line that begins with 'Frame#'",
            expected="a TRC file",
            remedy="export the trial again",
            file=path,
        )
    fields = _header_fields(above)
    labels = _labels(heading)
    check_names(labels, "labels", path)
    next(lines, None)  # X1, Y1, Z1, X2, ...
    rows = _rows(lines, labels, path)
    positions = np.frombuffer(rows.positions).reshape(len(rows.times), len(labels), 3)
    positions[(positions == 0).all(axis=-1)] = np.nan
    unit = fields.get("units", "")
    size, about_unit = settle_unit(positions, unit, length_in_m(unit), "Units")
    positions *= size
    findings = (
        *_about_counts(fields, len(labels), len(rows.times)),
        *rows.findings(),
        *about_unit,
        *without_absurd(positions),
    )
    rate_hz = _number(fields.get("datarate", ""))
    return Trc(labels, np.frombuffer(rows.times), positions, rate_hz, findings)


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


class _Rows:
    """What has been read of the table; eight bytes for each cell and no more."""

    def __init__(self, labels: tuple[str, ...], path: Path) -> None:
        self.labels, self.path = labels, path
        self.n_columns = 2 + 3 * len(labels)
        self.times, self.positions = array("d"), array("d")
        self.widest = 0
        self.n_words, self.a_word = 0, ""
        self.is_cut = False
        self._most_cells = path.stat().st_size

    def add(self, cells: list[str]) -> None:
        """Editors cut empty cells at the end, whole markers of them; else cells are shifted."""
        missing = self.n_columns - len(cells)
        if missing < 0 or missing % 3:
            raise self.refusal(len(cells))
        self.widest = max(self.widest, len(cells))
        row, words = _numbers(cells)
        self.times.append(row[1])
        self.positions.extend(row[2:])
        if missing:
            self.positions.extend([nan] * missing)
        if words:
            self.n_words += len(words)
            self.a_word = self.a_word or words[0]
        if self.widest < self.n_columns and len(self.times) > _SOON:
            raise self.refusal(self.widest)
        if len(self.positions) > self._most_cells:
            raise BadDataError(
                f"{len(self.labels)} labels over rows that are all but empty",
                expected="positions under the labels",
                remedy="export the trial with the markers that were seen",
                file=self.path,
            )

    def refusal(self, width: int) -> BadDataError:
        return BadDataError(
            f"a row of {width} cells under {len(self.labels)} labels",
            expected=f"{self.n_columns} cells: frame, time and three for each label",
            remedy="export the trial again",
            file=self.path,
        )

    def findings(self) -> list[Finding]:
        found = [_finding("the last row is cut", "a complete file", "left that row out")]
        found = found if self.is_cut else []
        if self.n_words:
            found.append(
                _finding(
                    f"{self.n_words} cells that are no numbers, as '{printable(self.a_word[:20])}'",
                    "numbers, or empty cells where a marker is missing",
                    "took them as missing",
                )
            )
        return found


def _rows(lines: Iterable[str], labels: tuple[str, ...], path: Path) -> _Rows:
    rows = _Rows(labels, path)
    last: list[str] = []
    for cells in _table(lines, rows.n_columns):
        if last:
            rows.add(last)
        last = cells
    if not last or not labels:
        raise BadDataError(
            "no marker data",
            expected="a TRC file with markers",
            remedy="export the trial again",
            file=path,
        )
    rows.is_cut = len(rows.times) > 0 and len(last) < rows.n_columns
    if not rows.is_cut:
        rows.add(last)
    if rows.widest < rows.n_columns:
        raise rows.refusal(rows.widest)
    if not np.isfinite(rows.times).all():
        raise BadDataError(
            "a row without a time",
            expected="times in column 2, numbers with a decimal point",
            remedy="export the trial again",
            file=path,
        )
    return rows


def _table(lines: Iterable[str], n_columns: int) -> Iterator[list[str]]:
    """The cells of each row that is not blank: by blanks if that gives the right number, else by
    tabs; empty ones at its end are dropped."""
    for line in lines:
        cells = line.split()
        if len(cells) == n_columns:
            yield cells
        elif cells:
            cells = [cell.strip() for cell in line.rstrip("\r\n").split("\t")]
            while len(cells) > n_columns and not cells[-1]:
                cells.pop()
            yield cells


def _numbers(cells: list[str]) -> tuple[list[float], list[str]]:
    """A row's values, and those of its cells behind the time that are words."""
    try:
        row = list(map(float, cells))
    except ValueError:
        row = list(map(_number, cells))
    if isfinite(sum(row)):
        return row, []
    positions = zip(cells[2:], row[2:], strict=True)
    return row, [c for c, x in positions if not isfinite(x) and c.lower() not in _MISSING]


def _number(cell: str) -> float:
    try:
        return float(cell) if cell else nan
    except ValueError:
        return nan


def _finding(found: str, expected: str, action: str) -> Finding:
    return Finding("layout", "", found, expected, action, "warning")
