"""A small text table as spreadsheets leave it: its letters, what separates its cells, its rows."""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from bsip_cli.errors import BadDataError
from bsip_cli.files.regular import fault_of

MOST_COLUMNS = 1000  # a table of people has tens; a million take minutes and gigabytes

_SEPARATORS = {"\t": "tabs", ";": "semicolons", ",": "commas", "|": "bars"}
_BLANKS = {"two or more blanks": 2, "blanks": 1}
_BOMS = {codecs.BOM_UTF8: "utf-8-sig", codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16"}
_CONTROL = re.compile(r"[\x00-\x08\x0e-\x1f]")
_SEPARATOR_LINE = re.compile(r"\s*\"?sep=.\"?\s*", re.IGNORECASE)  # which Excel writes and reads
_MOSTLY_ZERO = 0.4  # of the bytes, every other one: UTF-16 without a mark


@dataclass(frozen=True)
class TextTable:
    """Header and rows that are not blank, without the blanks around cells; how they were read."""

    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    separator: str
    encoding: str


def read_text_table(file: Path, known: Callable[[Sequence[str]], int]) -> TextTable:
    """Read a table whose separator is the one that makes most known columns of its header.

    known : how many of some names are columns of such a table.

    Raises
    ------
    BadDataError
        It cannot be read, is no text, or has too many columns.
    """
    text, encoding = _text(file)
    lines = text.splitlines(keepends=True)
    while lines and (not lines[0].strip(" \t\r\n;,|") or _SEPARATOR_LINE.fullmatch(lines[0])):
        del lines[0]
    try:
        header, separator = _header(lines[0] if lines else "", known)
        if len(header) > MOST_COLUMNS:
            raise BadDataError(
                f"has {len(header)} columns",
                file=file,
                expected=f"at most {MOST_COLUMNS}",
                remedy="keep participant_id, sex, mass_kg and height_m",
            )
        rows = [tuple(map(str.strip, cells)) for cells in _cells("".join(lines), separator)]
    except csv.Error as error:
        raise _no_text(file, str(error)) from None
    width = len(header)  # behind it a spreadsheet leaves empty cells
    kept = (cells if any(cells[width:]) else cells[:width] for cells in rows[1:] if any(cells))
    return TextTable(header, tuple(kept), separator, encoding)


def _text(file: Path) -> tuple[str, str]:
    if fault := fault_of(file):
        raise _unreadable(file, f"cannot be read: it {fault}")
    try:
        with file.open("rb") as handle:
            raw = handle.read()
    except OSError as error:
        raise _unreadable(file, f"cannot be read ({error.strerror or error})") from None
    even, odd = raw[::2].count(0), raw[1::2].count(0)
    encoding = next((name for mark, name in _BOMS.items() if raw.startswith(mark)), "utf-8")
    if encoding == "utf-8" and min(even, odd) == 0 and max(even, odd) > _MOSTLY_ZERO * len(raw):
        encoding = "utf-16-be" if even else "utf-16-le"
    try:
        return raw.decode(encoding), encoding
    except UnicodeDecodeError as error:
        text = raw.decode("cp1252", errors="replace")
        if encoding != "utf-8" or _CONTROL.search(text):
            raise _no_text(file, str(error)) from None
        return text, "cp1252"


def _header(line: str, known: Callable[[Sequence[str]], int]) -> tuple[tuple[str, ...], str]:
    """The cells of the first line, and what separates them; tabs where nothing says otherwise."""
    best: tuple[int, tuple[str, ...], str] = (-1, (), "tabs")
    for separator in (*_SEPARATORS.values(), *_BLANKS):
        try:
            cells: list[str] = next(_cells(line, separator), [])
        except csv.Error:  # as one cell the line is too long
            continue
        while cells and not cells[-1].strip():
            del cells[-1]
        names = tuple(map(str.strip, cells))
        if (count := known(names[:MOST_COLUMNS])) > best[0]:
            best = count, names, separator
    return best[1:]


def _cells(text: str, separator: str) -> Iterator[list[str]]:
    if separator in _BLANKS:
        run = re.compile(rf'("[^"\n]*")|[ \t]{{{_BLANKS[separator]},}}')
        text = "\n".join(
            run.sub(lambda m: m[1] or "\t", line.strip()) for line in text.splitlines()
        )
        separator = "tabs"
    sign = next(sign for sign, word in _SEPARATORS.items() if word == separator)
    yield from csv.reader(io.StringIO(text, newline=""), delimiter=sign)


def _unreadable(file: Path, found: str) -> BadDataError:
    return BadDataError(
        found,
        file=file,
        expected="a tab-separated table with participant_id, sex, mass_kg, height_m",
        remedy="write one, a line per participant",
    )


def _no_text(file: Path, why: str) -> BadDataError:
    return BadDataError(
        f"is not a text table ({why})",
        file=file,
        expected="tab-separated UTF-8 text",
        remedy="save it again as tab-separated text",
    )
