"""TRC files: marker positions as tab-separated text."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.units import length_in_m

_MISSING = {"", "nan", "na", "n/a", "none"}


@dataclass(frozen=True)
class Trc:
    """A TRC file's content, lab frame."""

    labels: tuple[str, ...]
    time_s: np.ndarray  # (n_frames,), as written
    positions_m: np.ndarray  # (n_frames, n_markers, 3), NaN = missing
    rate_hz: float  # DataRate of the header; NaN if it is none
    unit: str


def read_trc(path: Path) -> Trc:
    """Read a TRC file; the labels' line may have empty columns."""
    lines = read_lines(path)
    header_at = next((i for i, line in enumerate(lines) if line.startswith("Frame#")), None)
    if header_at is None or header_at < 1:
        raise BadDataError("no line 'Frame#'", expected="a TRC file", file=path)
    fields = _header_fields(lines[:header_at])
    labels = tuple(name.strip() for name in lines[header_at].split("\t")[2:] if name.strip())
    unit = fields.get("units", "")
    size = length_in_m(unit)
    if size is None:
        raise BadDataError(f"Units '{unit}'", expected="m or mm", file=path)
    table = _table(lines[header_at + 2 :], 2 + 3 * len(labels), path)
    positions = table[:, 2:].reshape(len(table), len(labels), 3) * size
    positions[(positions == 0).all(axis=-1)] = np.nan
    return Trc(labels, table[:, 1], positions, _number(fields.get("datarate", "")), unit)


def read_lines(path: Path) -> list[str]:
    """A text file's lines; what cannot be opened or is no text is refused."""
    try:
        lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError as error:
        raise BadDataError(f"cannot be opened ({error.strerror})", file=path) from error
    if not lines:
        raise BadDataError("the file is empty", file=path)
    return lines


def _header_fields(lines: list[str]) -> dict[str, str]:
    """The line of names above the line of values, as a mapping in lower case."""
    if len(lines) < 2:
        return {}
    names, values = lines[-2].split(), lines[-1].split()
    return {name.lower(): text for name, text in zip(names, values, strict=False)}


def _table(lines: list[str], n_columns: int, path: Path) -> np.ndarray:
    rows = [_row(line, n_columns, path) for line in lines if line.strip()]
    if not rows or n_columns <= 2:
        raise BadDataError("no marker data", expected="a TRC file with markers", file=path)
    return np.array(rows)


def _row(line: str, n_columns: int, path: Path) -> list[float]:
    """One row; cells left empty are missing values, rows cut short are refused."""
    cells = line.split()
    if len(cells) != n_columns:
        cells = [cell.strip() for cell in line.rstrip("\r\n").split("\t")]
        cells += [""] * (n_columns - len(cells))
    if any(cells[n_columns:]):
        raise BadDataError(f"a row of {len(cells)} cells", expected=f"{n_columns} cells", file=path)
    numbers = [_number(cell) for cell in cells[:n_columns]]
    if not np.isfinite(numbers[1]):
        raise BadDataError("a row without a time", expected="times in column 2", file=path)
    return numbers


def _number(cell: str) -> float:
    if cell.lower() in _MISSING:
        return float("nan")
    try:
        return float(cell)
    except ValueError:
        return float("nan")
