"""What TRC and MOT files share: lines read within limits, cells, and how numbers are spelt."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from math import isfinite, nan
from pathlib import Path

import numpy as np

from bsip_cli.files.regular import check_regular
from bsip_cli.recordings.model import Finding, refusal

# A C3D file counts its points in 16 bits and names them with at most 255 letters.
MOST_NAMES, _LONGEST_NAME = 0xFFFF, 255
ROWS_LOOKED_AT = 20  # to see how the table is written
_LARGEST_TEXT = 2**30  # bytes
_LONGEST_NUMBER = 25  # characters, with what parts it from the next: -1.2345678901234567e-100
_LONGEST_LINE = _LONGEST_NUMBER * (2 + 3 * MOST_NAMES)
_MOST_HEADER_LINES = 1000  # a TRC file has 3, MOT files with notes some 20
_LONGEST_FACT = 1000  # characters of a header's line that are kept
_MISSING = re.compile(r"[-+]?(?:nan\b.*|#?n/?a|none|null|1\.#.*|inf|infinity|-|\.)?", re.IGNORECASE)
_THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2}(,\d{3})+(\.\d*)?")
_SEPARATORS = ("\t", ";", ",", None)  # None: blanks


def text_lines(path: Path) -> Iterator[str]:
    """A text file's lines one after the other.

    Raises
    ------
    BadDataError
        It cannot be opened or read, is empty, too large, or no text.
    """
    check_regular(path)
    try:
        size = path.stat().st_size
        if size > _LARGEST_TEXT:
            found, most = f"a text of {size / 1e9:.1f} GB", f"at most {_LARGEST_TEXT / 1e9:.1f} GB"
            raise refusal(path, found, most, "cut the trial into shorter ones")
        if not size:
            remedy = "copy or export the trial again"
            raise refusal(path, "the file is empty", "a text file", remedy)
        with path.open(encoding="utf-8-sig", errors="replace") as file:
            while line := file.readline(_LONGEST_LINE + 1):
                if "\0" in line:
                    remedy = "save it as text in UTF-8, not in UTF-16"
                    raise refusal(path, "bytes that are no text", "lines of text", remedy)
                if len(line) > _LONGEST_LINE:
                    found = f"a line of more than {_LONGEST_LINE / 1e6:.1f} million characters"
                    raise refusal(path, found, "lines of text")
                yield line
    except OSError as error:
        found = f"cannot be read ({error.strerror or error})"
        raise refusal(path, found, "a readable text file", "check the file") from error


def head_of(lines: Iterator[str], is_end: Callable[[str], object]) -> tuple[list[str], str | None]:
    """The header's lines, and the one that ends it; None where no line does."""
    above: list[str] = []
    for line in islice(lines, _MOST_HEADER_LINES):
        if is_end(line):
            return above, line
        above.append(line[:_LONGEST_FACT])
    return above, None


def check_names(names: Sequence[str], what: str, path: Path) -> None:
    """Refuse more names, or longer ones, than a C3D file could hold."""
    longest = max(map(len, names), default=0)
    if len(names) > MOST_NAMES:
        raise refusal(path, f"{len(names)} {what}", f"at most {MOST_NAMES}")
    if longest > _LONGEST_NAME:
        raise refusal(path, f"one of the {what} has {longest} letters", f"at most {_LONGEST_NAME}")


def row_counts(what: str, stated: float, found: int) -> list[Finding]:
    """A warning where a header counts other rows or columns than the file has."""
    if not np.isfinite(stated) or stated == found:
        return []
    counts = f"the header counts {stated:g} {what}, the file has {found}"
    return [Finding("layout", "", counts, "one count", f"read {found}", "warning")]


# --- cells ----------------------------------------------------------------------------------------


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
        printed, used = (10.0 ** -min(digits, 300) for digits in (self._printed, self._used))
        with np.errstate(over="ignore", invalid="ignore"):
            single = values.astype(np.float32)
            if (np.abs(single - values) <= 0.5 * printed).all():
                used = max(used, float(np.spacing(np.abs(single).max(initial=0))))
        return printed, used
