"""TRC files: marker positions as tab-separated text."""

from __future__ import annotations

import re
from array import array
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import chain, islice
from pathlib import Path

import numpy as np

from bsip_cli.errors import BadDataError, printable
from bsip_cli.recordings.missing_points import without_sentinels
from bsip_cli.recordings.model import Finding
from bsip_cli.recordings.scene_size import settle_unit, without_absurd
from bsip_cli.recordings.text_cells import (
    Dialect,
    LastDigit,
    dialect_of,
    is_missing,
    number,
    parted,
    separator_of,
    without_end,
)
from bsip_cli.recordings.text_lines import check_names, head_of, row_counts, text_lines
from bsip_cli.recordings.timebase import Stamps

_HEADER = re.compile(r"^\s*frame\s*#", re.IGNORECASE)
_ROWS_LOOKED_AT = 20  # to see how the table is written
_SOON = 100_000  # rows, a quarter of an hour at 100 Hz: the last marker is seen in one of them
_RATES = ("datarate", "camerarate", "origdatarate")


@dataclass(frozen=True, eq=False)
class Trc:
    """A TRC file's content, lab frame."""

    labels: tuple[str, ...]
    stamps: Stamps  # (n_frames,)
    positions_m: np.ndarray  # (n_frames, n_markers, 3), NaN = missing
    rates_hz: tuple[float, ...]  # DataRate, CameraRate, OrigDataRate as far as they are stated
    counts_frames: bool  # as many frames as the header says, numbered one after the other
    findings: tuple[Finding, ...]


def read_trc(path: Path) -> Trc:
    """Read a TRC file; trajectories without a label are left out."""
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
    mark = separator_of(heading)
    names, are_apart = _names(heading, mark)
    check_names([name for name in names if name], "labels", path)
    axes = next(lines, "").split()  # X1, Y1, Z1, X2, ...
    first = list(islice((line for line in lines if line.strip()), _ROWS_LOOKED_AT))
    are_counted = are_apart and len(axes) == 3 * len(names)
    rows = _Rows(_Heading(names, are_apart, are_counted), dialect_of(mark, first), path)
    rows.read(chain(first, lines))
    labels, positions = rows.labelled()
    about_points = without_sentinels(positions)
    unit = fields.get("units", "")
    size, about_unit = settle_unit(positions, labels, unit, "Units")
    positions *= size
    findings = (
        *_about_counts(fields, {len(labels), rows.n_trajectories()}, len(rows.times)),
        *rows.findings(len(labels)),
        *about_points,
        *about_unit,
        *without_absurd(positions),
    )
    times = np.array(rows.times)
    return Trc(
        labels,
        Stamps(times, rows.time_digits.sizes(times)),
        positions,
        tuple(_number(fields.get(name, "")) for name in _RATES),
        rows.are_numbered and _number(fields.get("numframes", "")) == len(times),
        findings,
    )


def _names(line: str, mark: str | None) -> tuple[list[str], bool]:
    """Names of the trajectories behind 'Frame#' and 'Time', '' for one without a name.

    Names stand three places apart, or another number; where one is missing, a place is empty.
    False: they stand anyhow, and the empty places say nothing.
    """
    if mark is None:
        return [printable(name) for name in _HEADER.sub("", line).split()[1:]], True
    cells = [printable(name) for name in without_end(parted(line, mark))[2:]]
    places = [k for k, name in enumerate(cells) if name]
    apart = np.diff(places)
    step = int(apart.min(initial=3 if len(places) < 2 else len(cells)))
    if (apart % step).any():
        return [cells[place] for place in places], False
    return cells[places[0] % step :: step] if places else [], True


def _header_fields(lines: list[str]) -> dict[str, str]:
    """The line of names above the line of values, as a mapping in lower case."""
    if len(lines) < 2:
        return {}
    mark = separator_of(lines[-2])
    names, values = parted(lines[-2], mark), parted(lines[-1], mark)
    if len(values) < 2:
        values = lines[-1].split()
    return {name.lower(): text for name, text in zip(names, values, strict=False)}


def _number(text: str) -> float:
    return number(text.replace(",", "."))


def _about_counts(fields: dict[str, str], n_markers: set[int], n_frames: int) -> list[Finding]:
    stated = _number(fields.get("nummarkers", ""))
    return [
        *(row_counts("markers", stated, min(n_markers)) if stated not in n_markers else []),
        *row_counts("frames", _number(fields.get("numframes", "")), n_frames),
    ]


@dataclass(frozen=True)
class _Heading:
    """The line of names. names : of each place, '' for an empty one."""

    names: list[str]
    are_apart: bool  # by one number of places, so that an empty place is a trajectory
    are_counted: bool  # the line below, X1, Y1, ..., has three for each place


class _Rows:
    """What has been read of the table; eight bytes for each cell and no more."""

    def __init__(self, heading: _Heading, dialect: Dialect, path: Path) -> None:
        self.heading, self.dialect, self.path = heading, dialect, path
        self.n_labels = sum(map(bool, heading.names))
        self.times, self.positions, self.widths = array("d"), array("d"), array("L")
        self.time_digits = LastDigit()
        self.widest = 0
        self.n_words, self.a_word = 0, ""
        self.are_numbered, self.is_cut = True, False
        self._frame = 0.0
        self._most_cells = path.stat().st_size

    def read(self, lines: Iterable[str]) -> None:
        last: list[str] = []
        n_of_last = 0
        for n_written, cells in self._table(lines):
            if last:
                self.add(last)
            last, n_of_last = cells, n_written
        if not last or not self.n_labels:
            raise BadDataError(
                "no marker data",
                expected="a TRC file with markers",
                remedy="export the trial again",
                file=self.path,
            )
        self.is_cut = len(self.times) > 0 and n_of_last < 2 + 3 * self.n_labels
        if not self.is_cut:
            self.add(last)
        if not self._fit():
            raise self.refusal(self.widest)
        if not np.isfinite(self.times).all():
            raise BadDataError(
                "a row without a time",
                expected="times in column 2, numbers of one kind",
                remedy="export the trial again",
                file=self.path,
            )

    def _table(self, lines: Iterable[str]) -> Iterator[tuple[int, list[str]]]:
        """Of each row that is not blank the number of its cells, and those with something in them.

        By blanks where that gives a cell for each label and tabs do not.
        """
        for line in lines:
            if not line.strip():
                continue
            cells = self.dialect.cells(line)
            if len(cells) < (n := 2 + 3 * self.n_labels):
                words = replace(self.dialect, separator=None).cells(line)
                cells = words if len(words) == n else cells
            yield len(cells), _whole(cells)

    def add(self, cells: list[str]) -> None:
        """Editors cut empty cells at the end, whole markers of them; else cells are shifted."""
        if len(cells) < 2 or (len(cells) - 2) % 3:
            raise self.refusal(len(cells))
        self.widest = max(self.widest, len(cells))
        row, words = _numbers(cells)
        self.are_numbered &= not self.times or row[0] == self._frame + 1
        self._frame = row[0]
        self.time_digits.add(cells[1])
        self.times.append(row[1])
        self.positions.extend(row[2:])
        self.widths.append(len(row) - 2)
        if words:
            self.n_words += len(words)
            self.a_word = self.a_word or words[0]
        if self.n_trajectories() < self.n_labels and len(self.times) > _SOON:
            raise self.refusal(self.widest)
        if len(self.times) * (self.widest - 2) > self._most_cells:
            raise BadDataError(
                f"{self.n_trajectories()} trajectories over rows that are all but empty",
                expected="positions under the labels",
                remedy="export the trial with the markers that were seen",
                file=self.path,
            )

    def _fit(self) -> bool:
        """As many trajectories as labels, or as places in the heading, or more behind them."""
        n = self.n_trajectories()
        enough = self.n_labels if self.heading.are_counted else len(self.heading.names)
        return n == self.n_labels or (n >= enough and self.heading.are_apart)

    def n_trajectories(self) -> int:
        return (self.widest - 2) // 3

    def labelled(self) -> tuple[tuple[str, ...], np.ndarray]:
        """The labels, and the positions below them (n_frames, n_labels, 3), NaN = missing.

        Trajectories behind those that the heading names have no name; nor have the empty places
        of the heading, unless there are only as many trajectories as labels.
        """
        widths, n_columns = np.array(self.widths, np.int64), self.widest - 2
        values = np.frombuffer(self.positions)
        if (widths != n_columns).any():
            whole = np.full((len(widths), n_columns), np.nan)
            whole[np.arange(n_columns) < widths[:, None]] = values
            values = whole
        positions = values.reshape(len(widths), -1, 3)
        names = self.heading.names
        n_empty = max(len(names) - self.n_trajectories(), 0)
        if n_empty and self.heading.are_counted:
            positions = np.pad(positions, ((0, 0), (0, n_empty), (0, 0)), constant_values=np.nan)
        elif n_empty:
            names = [name for name in names if name]
        kept = [k for k, name in enumerate(names) if name]
        if kept != list(range(positions.shape[1])):
            positions = positions[:, kept]
        positions[~np.isfinite(positions).all(axis=-1) | (positions == 0).all(axis=-1)] = np.nan
        return tuple(names[k] for k in kept), positions

    def refusal(self, width: int) -> BadDataError:
        return BadDataError(
            f"a row of {width} cells under {self.n_labels} labels",
            expected=f"{2 + 3 * self.n_labels} cells: frame, time and three for each label",
            remedy="export the trial again",
            file=self.path,
        )

    def findings(self, n_labels: int) -> list[Finding]:
        found = []
        if self.is_cut:
            found.append(_finding("the last row is cut", "a complete file", "left that row out"))
        if unnamed := self.n_trajectories() - n_labels:
            found.append(
                _finding(
                    f"{unnamed} trajectories without a label",
                    "a label for each",
                    f"left them out and read {n_labels}",
                    "info",
                )
            )
        found += self.dialect.about_commas()
        if self.n_words:
            found.append(
                _finding(
                    f"{self.n_words} cells that are no numbers, as '{printable(self.a_word[:20])}'",
                    "numbers, or empty cells where a marker is missing",
                    "took them as missing",
                )
            )
        return found


def _whole(cells: list[str]) -> list[str]:
    """Without the empty cells behind the last marker that has a cell with something in it."""
    n = len(without_end(cells))
    return cells[: n + (2 - n) % 3 if n > 2 else n]


def _numbers(cells: list[str]) -> tuple[list[float], list[str]]:
    """A row's values, and those of its cells behind the time that are words."""
    try:
        return list(map(float, cells)), []
    except ValueError:
        row = list(map(number, cells))
    positions = zip(cells[2:], row[2:], strict=True)
    return row, [cell for cell, x in positions if np.isnan(x) and not is_missing(cell)]


def _finding(found: str, expected: str, action: str, level: str = "warning") -> Finding:
    return Finding("layout", "", found, expected, action, level)
