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
from bsip_cli.recordings.gaps import without_absurd, without_sentinels
from bsip_cli.recordings.model import Finding, refusal
from bsip_cli.recordings.scene import decided_unit
from bsip_cli.recordings.text_tables import (
    ROWS_LOOKED_AT,
    Dialect,
    LastDigit,
    Stamps,
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

_HEADER = re.compile(r"^\s*frame\s*#", re.IGNORECASE)
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
        raise refusal(path, "no line that begins with 'Frame#'", "a TRC file")
    fields = _header_fields(above)
    mark = separator_of(heading)
    names, apart = _names(heading, mark)
    check_names([name for name in names if name], "labels", path)
    below = next(lines, "")  # X1, Y1, Z1, X2, ..., or a row where that line is left out
    frame_and_time = [_number(cell) for cell in below.split()[:2]]
    is_row = len(frame_and_time) == 2 and np.isfinite(frame_and_time).all()
    lines = chain([below] if is_row else [], lines)
    first = list(islice((line for line in lines if line.strip()), ROWS_LOOKED_AT))
    are_counted = apart > 0 and len(below.split()) == 3 * len(names)
    rows = _Rows(names, apart, are_counted, dialect_of(mark, first), path)
    rows.read(chain(first, lines))
    labels, positions = rows.labelled()
    about_points = without_sentinels(positions)
    unit = fields.get("units", "")
    size, about_unit = decided_unit(positions, labels, unit, "Units")
    positions *= size
    times, rates = np.array(rows.times), [_number(fields.get(name, "")) for name in _RATES]
    n_stated, n_frames = (_number(fields.get(name, "")) for name in ("nummarkers", "numframes"))
    n_markers = {len(labels), rows.n_trajectories()}
    findings = (
        *(row_counts("markers", n_stated, min(n_markers)) if n_stated not in n_markers else []),
        *row_counts("frames", n_frames, len(times)),
        *rows.findings(len(labels)),
        *about_points,
        *about_unit,
        *without_absurd(positions),
    )
    stamps = Stamps(times, rows.time_digits.sizes(times))
    counts_frames = (np.diff(rows.frames) == 1).all() and n_frames == len(times)
    return Trc(labels, stamps, positions, tuple(rates), bool(counts_frames), findings)


def _names(line: str, mark: str | None) -> tuple[list[str], int]:
    """Names of the trajectories behind 'Frame#' and 'Time', '' for one without a name.

    Names stand three places apart, or another number; where one is missing, a place is empty.
    0: they stand anyhow, and the empty places say nothing.
    """
    if mark is None:
        return [printable(name) for name in _HEADER.sub("", line).split()[1:]], 1
    cells = [printable(name) for name in without_end(parted(line, mark))[2:]]
    places = [k for k, name in enumerate(cells) if name]
    apart = np.diff(places)
    step = int(apart.min(initial=3 if len(places) < 2 else len(cells)))
    if (apart % step).any():
        return [cells[place] for place in places], 0
    return cells[places[0] % step :: step] if places else [], step


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


class _Rows:
    """What has been read of the table; eight bytes for each cell and no more."""

    def __init__(
        self, names: list[str], apart: int, are_counted: bool, dialect: Dialect, path: Path
    ) -> None:
        """names : of each place of the heading, '' for an empty one. apart : by how many places,
        so that an empty place is a trajectory; 0 if anyhow. are_counted : the line below, X1, Y1,
        ..., has three for each place."""
        self.names, self.apart, self.are_counted = names, apart, are_counted
        self.dialect, self.path = dialect, path
        self.n_labels = sum(map(bool, names))
        self.frames, self.times = array("d"), array("d")
        self.positions, self.widths = array("d"), array("L")
        self.time_digits = LastDigit()
        self.widest = 0
        self.n_words, self.a_word = 0, ""
        self.is_cut = False
        self._most_cells = path.stat().st_size

    def read(self, lines: Iterable[str]) -> None:
        last: list[str] = []
        n_of_last = 0
        for n_written, cells in self._table(lines):
            if last:
                self.add(last)
            last, n_of_last = cells, n_written
        if not last or not self.n_labels:
            raise refusal(self.path, "no marker data", "a TRC file with markers")
        self.is_cut = len(self.times) > 0 and n_of_last < 2 + 3 * self.n_labels
        if not self.is_cut:
            self.add(last)
        # As many trajectories as labels, or as places in the heading, or more behind them.
        n, enough = self.n_trajectories(), self.n_labels if self.are_counted else len(self.names)
        if n != self.n_labels and not (n >= enough and self.apart):
            raise self.misfit(self.widest)
        if self.apart > 3 and self.widest == 2 + self.apart * len(self.names):
            raise self.misfit(self.widest)  # so many columns for each, of which X, Y, Z are three
        if not np.isfinite(self.times).all():
            expected = "times in column 2, numbers of one kind"
            raise refusal(self.path, "a row without a time", expected)

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
            raise self.misfit(len(cells))
        self.widest = max(self.widest, len(cells))
        frame, time = map(number, cells[:2])
        positions, words = values_of(cells[2:])
        self.time_digits.add(cells[1])
        self.frames.append(frame)
        self.times.append(time)
        self.positions.extend(positions)
        self.widths.append(len(positions))
        if words:
            self.n_words += len(words)
            self.a_word = self.a_word or words[0]
        if self.n_trajectories() < self.n_labels and len(self.times) > _SOON:
            raise self.misfit(self.widest)
        if len(self.times) * (self.widest - 2) > self._most_cells:
            found = f"{self.n_trajectories()} trajectories over rows that are all but empty"
            remedy = "export the trial with the markers that were seen"
            raise refusal(self.path, found, "positions under the labels", remedy)

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
        names = self.names
        n_empty = max(len(names) - self.n_trajectories(), 0)
        if n_empty and self.are_counted:
            positions = np.pad(positions, ((0, 0), (0, n_empty), (0, 0)), constant_values=np.nan)
        elif n_empty:
            names = [name for name in names if name]
        kept = [k for k, name in enumerate(names) if name]
        if kept != list(range(positions.shape[1])):
            positions = positions[:, kept]
        positions[~np.isfinite(positions).all(axis=-1) | (positions == 0).all(axis=-1)] = np.nan
        return tuple(names[k] for k in kept), positions

    def misfit(self, width: int) -> BadDataError:
        found = f"a row of {width} cells under {self.n_labels} labels"
        expected = f"{2 + 3 * self.n_labels} cells: frame, time and three for each label"
        return refusal(self.path, found, expected)

    def findings(self, n_labels: int) -> list[Finding]:
        unnamed, found = self.n_trajectories() - n_labels, []
        if self.is_cut:
            found.append(("the last row is cut", "a complete file", "left that row out", "warning"))
        if unnamed:
            action = f"left them out and read {n_labels}"
            words = f"{unnamed} trajectories without a label"
            found.append((words, "a label for each", action, "info"))
        about = [Finding("layout", "", *words) for words in found] + self.dialect.about_commas()
        if self.n_words:
            words = f"{self.n_words} cells that are no numbers, as '{printable(self.a_word[:20])}'"
            expected = "numbers, or empty cells where a marker is missing"
            about.append(Finding("layout", "", words, expected, "took them as missing", "warning"))
        return about


def _whole(cells: list[str]) -> list[str]:
    """Without the empty cells behind the last marker that has a cell with something in it."""
    n = len(without_end(cells))
    return cells[: n + (2 - n) % 3 if n > 2 else n]
