"""Files that others wrote: what may be opened at all, TOML, folders, and small text tables."""

from __future__ import annotations

import codecs
import csv
import io
import os
import re
import stat
import tomllib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bsip_cli.errors import BadDataError, BsipError, UsageError, printable

_LARGEST_TOML = 1_000_000  # bytes; eighty times the longest that ships
_LONGEST_LINE = 10_000  # characters; a key of n parts takes tomllib a time that grows as n squared
_DEEPEST = 10  # tables and lists in another; no option has more than four
_NO_FILES = (
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a FIFO"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)


def fault_of(path: Path) -> str:
    """Why a path is no regular file that can be read, as a clause; empty if it is one.

    Nothing is opened: who opens a FIFO waits for ever.
    """
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        is_link = path.is_symlink()
        return f"is a broken symbolic link to {path.readlink()}" if is_link else "does not exist"
    except (OSError, ValueError) as error:  # ValueError: a name that no file can have
        return f"cannot be looked at ({getattr(error, 'strerror', None) or error})"
    if stat.S_ISREG(mode):
        return "" if os.access(path, os.R_OK) else "may not be read (no permission)"
    return f"is {next((name for is_one, name in _NO_FILES if is_one(mode)), 'no regular file')}"


def check_regular(path: Path, error: type[BsipError] = BadDataError) -> None:
    """Refuse what is no regular file that can be read, without opening it.

    BadDataError: or ``error``, where another one is asked for.
    """
    if fault := fault_of(path):
        raise error(
            fault,
            expected="a regular file",
            remedy="put the file there, or name another one",
            file=path,
        )


def read_toml(file: Path) -> dict[str, Any]:
    """The content of a TOML file.

    UsageError: it cannot be read, or is not TOML.
    """
    check_regular(file, UsageError)
    try:
        if file.stat().st_size > _LARGEST_TOML:
            raise UsageError(
                f"a file of {file.stat().st_size / 1e6:.1f} MB",
                expected=f"TOML of at most {_LARGEST_TOML / 1e6:g} MB",
                file=file,
            )
        text = file.read_text(encoding="utf-8-sig")
        if max(map(len, text.splitlines()), default=0) > _LONGEST_LINE:
            raise ValueError(f"a line of more than {_LONGEST_LINE} characters")
        content = tomllib.loads(text)
        _check_values(content)
    except OSError as error:
        raise UsageError(f"cannot be read ({error.strerror or error})", file=file) from None
    except (RecursionError, ValueError) as error:
        # ValueError: tomllib's, no UTF-8, a number of more digits than Python reads
        endless = isinstance(error, RecursionError)
        raise UsageError(
            f"not valid TOML ({'brackets in brackets without end' if endless else error})",
            file=file,
            expected="TOML in UTF-8",
            remedy="correct that place",
        ) from None
    return content


def _check_values(value: object, depth: int = 0) -> None:
    """ValueError where values are nested deeper than any option, or an integer is none of TOML."""
    if depth > _DEEPEST:
        raise ValueError(f"values nested more than {_DEEPEST} deep")
    if isinstance(value, int) and not -(2**63) <= value < 2**63:
        raise ValueError("an integer of more than 64 bits")
    parts = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    for part in parts:
        _check_values(part, depth + 1)


def shipped(*parts: str) -> Path:
    """Path of a file that ships in ``configs/``, in a checkout as in an installed wheel."""
    package = Path(__file__).parents[1]
    installed = package / "configs"
    return (installed if installed.is_dir() else package.parent / "configs").joinpath(*parts)


# --- what lies in a folder, and whether a path leads into one -------------------------------------


def is_folder(path: Path) -> bool:
    """Whether a folder is there; ``Path.is_dir`` raises where nobody may look."""
    status = _status(path)
    return status is not None and stat.S_ISDIR(status.st_mode)


def check_path(path: Path) -> None:
    """Refuse a path that the libraries for C3D and Parquet cannot open.

    UsageError: it holds bytes that are no UTF-8.
    """
    try:
        str(path).encode()
    except UnicodeEncodeError:
        raise UsageError(
            "its path holds bytes that are no UTF-8", file=path, remedy="rename the folder"
        ) from None


def entries(folder: Path) -> list[Path]:
    """Everything in a folder that is not hidden, sorted.

    BadDataError: the folder cannot be listed.
    """
    try:
        paths = (path for path in folder.iterdir() if not path.name.startswith("."))
        return sorted(paths, key=lambda path: path.name)
    except OSError as error:
        raise BadDataError(
            f"cannot be listed ({error.strerror or error})",
            file=folder,
            expected="a folder that may be read",
            remedy="give yourself the right to read it, or copy it anew",
        ) from None


def lies_in(path: Path, folder: Path) -> bool:
    """Whether a path is a folder or leads into it, whatever links and capitals it is written with.

    What is not there yet lies where it would be made.
    """
    real, known = Path(os.path.realpath(path)), _status(folder)
    found = (_status(above) for above in (real, *real.parents))
    return known is not None and any(one and os.path.samestat(one, known) for one in found)


def _status(path: Path) -> os.stat_result | None:
    """Of what a path leads to; None where nothing is, or nobody may look."""
    try:
        return path.stat()
    except (OSError, ValueError):  # ValueError: a name that no file can have
        return None


# --- which file of ground forces belongs to a TRC: its name says it -------------------------------

ENDINGS = (".mot", ".sto")
_WORD = re.compile(r"[-_ .](?:grfs?|forces?)$", re.IGNORECASE)


def trial_stem(forces: Path) -> str:
    """The name of the trial whose forces a file holds: 'walk' of walk_grf.mot."""
    return _WORD.sub("", forces.stem)


def forces_beside(trc: Path) -> Path | None:
    """The file of ground forces next to a TRC, in small letters or capitals; None without one.

    BadDataError: there are several, and which one is meant cannot be known.
    """
    own, tables = trc.stem.casefold(), entries(trc.parent)
    tables = [path for path in tables if path.suffix.lower() in ENDINGS]
    found = [p for p in tables if own in (p.stem.casefold(), trial_stem(p).casefold())]
    if len(found) > 1:
        raise BadDataError(
            f"there are {' and '.join(printable(path.name) for path in found)} next to it",
            file=trc,
            expected="one file of ground forces",
            remedy="leave the one with the forces there, and move the others elsewhere",
        )
    return found[0] if found else None


# --- a small text table as spreadsheets leave it: its letters, what separates its cells, its rows -

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

    BadDataError: it cannot be read, is no text, or has too many columns.
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
    why = f": it {fault}" if (fault := fault_of(file)) else ""
    try:
        raw = b"" if why else file.read_bytes()
    except OSError as error:
        why = f" ({error.strerror or error})"
    if why:
        raise BadDataError(
            f"cannot be read{why}",
            file=file,
            expected="a tab-separated table with participant_id, sex, mass_kg, height_m",
            remedy="write one, a line per participant",
        )
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


def _no_text(file: Path, why: str) -> BadDataError:
    return BadDataError(
        f"is not a text table ({why})",
        file=file,
        expected="tab-separated UTF-8 text",
        remedy="save it again as tab-separated text",
    )
