"""The cells of text tables: how they are parted, how their numbers are spelt."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import isfinite, nan

import numpy as np

from bsip_cli.recordings.model import Finding

_MISSING = re.compile(r"[-+]?(?:nan\b.*|#?n/?a|none|null|1\.#.*|inf|infinity|-|\.)?", re.IGNORECASE)
_THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2}(,\d{3})+(\.\d*)?")
_SEPARATORS = ("\t", ";", ",", None)  # None: blanks


@dataclass(frozen=True)
class Dialect:
    """How a table is written."""

    separator: str | None  # None: blanks, any number of them
    comma: str = ","  # what a comma within a number means: "." or "" between thousands

    def cells(self, line: str) -> list[str]:
        """The cells of a row, empty ones at its end too."""
        return parted(line.replace(",", self.comma), self.separator)

    def about_commas(self) -> list[Finding]:
        """What is said of commas within numbers."""
        if self.separator == "," or self.comma == ",":
            return []
        found = "decimal commas" if self.comma else "commas between thousands"
        return [Finding("layout", "", found, "decimal points", "read them so", "corrected")]


def dialect_of(separator: str | None, rows: Sequence[str]) -> Dialect:
    """The dialect of rows: commas in all numbers above 999 only are between thousands."""
    if separator == "," or not any("," in row for row in rows):
        return Dialect(separator)
    cells = [cell for row in rows for cell in parted(row, separator) if "," in cell]
    return Dialect(separator, "" if all(map(_THOUSANDS.fullmatch, cells)) else ".")


def parted(line: str, separator: str | None) -> list[str]:
    """Words or cells of a line, without the blanks around them."""
    if separator is None:
        return line.split()
    return [cell.strip() for cell in line.strip("\r\n").split(separator)]


def separator_of(line: str) -> str | None:
    """What parts the words of a heading: tabs before semicolons before commas before blanks."""
    return next((mark for mark in _SEPARATORS if mark is None or mark in line), None)


def agreeing(heading: str, rows: Sequence[str]) -> Iterator[tuple[list[str], Dialect]]:
    """The heading's names and the rows' dialect, wherever the first row has as many cells."""
    for own in _SEPARATORS:
        cells = without_end(parted(rows[0], own))
        for mark in (own, *_SEPARATORS):
            names = without_end(parted(heading, mark))
            if len(names) == len(cells) > 1:
                yield names, dialect_of(own, rows)


def without_end(cells: list[str]) -> list[str]:
    """The cells without empty ones at the end."""
    n = len(cells)
    while n and not cells[n - 1]:
        n -= 1
    return cells[:n]


def is_missing(cell: str) -> bool:
    """Whether it is one of the ways to write that there is no number."""
    return _MISSING.fullmatch(cell) is not None


def number(cell: str) -> float:
    """A cell's number, NaN if it is none or infinite."""
    try:
        value = float(cell) if cell else nan
    except ValueError:
        return nan
    return value if isfinite(value) else nan


class LastDigit:
    """The sizes of the last digit of a column: as printed, and without zeros at the end."""

    def __init__(self) -> None:
        self._printed, self._used = 0, 0

    def add(self, cell: str) -> None:
        mantissa, _, exponent = cell.lower().partition("e")
        digits = mantissa.partition(".")[2]
        shift = int(exponent) if exponent.lstrip("+-").isdigit() else 0
        self._printed = max(self._printed, len(digits) - shift)
        self._used = max(self._used, len(digits.rstrip("0")) - shift)

    def sizes(self, values: np.ndarray) -> tuple[float, float]:
        """In the column's unit; numbers that all have single precision are no finer than that."""
        printed = 10.0 ** -min(self._printed, 300)
        used = 10.0 ** -min(self._used, 300)
        with np.errstate(over="ignore", invalid="ignore"):
            single = values.astype(np.float32)
            if (np.abs(single - values) <= 0.5 * printed).all():
                used = max(used, float(np.spacing(np.abs(single).max(initial=0))))
        return printed, used
