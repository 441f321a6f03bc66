"""Text recordings line by line, within limits: what TRC and MOT files share."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import islice
from pathlib import Path

import numpy as np

from bsip_cli.errors import BadDataError
from bsip_cli.files.regular import check_regular
from bsip_cli.recordings.model import Finding

# A C3D file counts its points in 16 bits and names them with at most 255 letters.
MOST_NAMES, _LONGEST_NAME = 0xFFFF, 255
_LARGEST_TEXT = 2**30  # bytes
_LONGEST_NUMBER = 25  # characters, with what parts it from the next: -1.2345678901234567e-100
_LONGEST_LINE = _LONGEST_NUMBER * (2 + 3 * MOST_NAMES)
_MOST_HEADER_LINES = 1000  # a TRC file has 3, MOT files with notes some 20
_LONGEST_FACT = 1000  # characters of a header's line that are kept


def text_lines(path: Path) -> Iterator[str]:
    """A text file's lines one after the other.

    Raises
    ------
    BadDataError
        It cannot be opened or read, is empty, too large, or no text.
    """
    check_regular(path)
    try:
        _check_size(path, path.stat().st_size)
        with path.open(encoding="utf-8-sig", errors="replace") as file:
            while line := file.readline(_LONGEST_LINE + 1):
                if "\0" in line or len(line) > _LONGEST_LINE:
                    raise _no_text(path, line)
                yield line
    except OSError as error:
        raise BadDataError(
            f"cannot be read ({error.strerror or error})",
            expected="a readable text file",
            remedy="check the file",
            file=path,
        ) from error


def _check_size(path: Path, size: int) -> None:
    if size > _LARGEST_TEXT:
        raise BadDataError(
            f"a text of {size / 1e9:.1f} GB",
            expected=f"at most {_LARGEST_TEXT / 1e9:.1f} GB",
            remedy="cut the trial into shorter ones",
            file=path,
        )
    if not size:
        raise BadDataError(
            "the file is empty",
            expected="a text file",
            remedy="copy or export the trial again",
            file=path,
        )


def _no_text(path: Path, line: str) -> BadDataError:
    if "\0" in line:
        found, remedy = "bytes that are no text", "save it as text in UTF-8, not in UTF-16"
    else:
        found, remedy = f"a line of more than {_LONGEST_LINE / 1e6:.1f} million characters", ""
    return BadDataError(
        found, expected="lines of text", remedy=remedy or "export the trial again", file=path
    )


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
    if len(names) <= MOST_NAMES and longest <= _LONGEST_NAME:
        return
    many = len(names) > MOST_NAMES
    raise BadDataError(
        f"{len(names)} {what}" if many else f"one of the {what} has {longest} letters",
        expected=f"at most {MOST_NAMES}" if many else f"at most {_LONGEST_NAME}",
        remedy="export the trial again",
        file=path,
    )


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
