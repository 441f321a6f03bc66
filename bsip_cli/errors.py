"""The errors a user may meet. Each carries its data and makes its own sentence."""

from __future__ import annotations

import difflib
from collections.abc import Collection
from functools import partial
from typing import Any


def printable(text: str) -> str:
    """A text with a question mark for what is no letter, digit, sign or blank.

    A line break forges a line, an escape sequence steers a terminal, a change of direction reads
    as another name, and bytes of a path that are no UTF-8 cannot be written.
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c == "\N{NO-BREAK SPACE}" else "?" for c in text)


def did_you_mean(name: str, known: Collection[str]) -> str:
    """`` (did you mean skeleton?)`` behind an unknown name; empty where none is near."""
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.4)
    return f" (did you mean {near[0]}?)" if near else ""


class BsipError(Exception):
    """Base of all errors that are not bugs.

    found : what was found, as a clause without a full stop.
    expected : what should have been there.
    remedy : what the user can do about it.
    file : the file (or participant, or option) the error is about.
    """

    exit_code = 1

    def __init__(
        self, found: str, *, expected: str = "", remedy: str = "", file: object = ""
    ) -> None:
        super().__init__(found, expected, remedy, str(file))
        self.found = found
        self.expected = expected
        self.remedy = remedy
        self.file = str(file)

    def __str__(self) -> str:
        where = f"{self.file}: " if self.file else ""
        expected = f"; expected {self.expected}" if self.expected else ""
        remedy = f". To correct it: {self.remedy}" if self.remedy else ""
        return printable(f"{where}{self.found}{expected}{remedy}.")

    def __reduce__(self) -> tuple[Any, ...]:  # crosses process borders with its data
        known = {"expected": self.expected, "remedy": self.remedy, "file": self.file}
        return partial(type(self), **known), (self.found,)


class UsageError(BsipError):
    """The command line or the configuration cannot be understood (exit code 2)."""

    exit_code = 2


class NotWritableError(UsageError):
    """Results cannot be written: the disk is full, or the place is closed (exit code 2)."""


def not_writable(file: object, error: OSError) -> NotWritableError:
    """What to raise where results cannot be written."""
    return NotWritableError(
        f"cannot be written ({error.strerror or error})",
        file=file,
        remedy="make room there, or name another folder with --out",
    )


class BadDataError(BsipError):
    """A recording, table or artifact cannot be used (exit code 3)."""

    exit_code = 3


class ChangedError(BadDataError):
    """An artifact is no more what its producer wrote (exit code 3)."""


def not_readable(error: OSError) -> BadDataError:
    """What to raise where the system lets no file be read."""
    return BadDataError(
        f"the system refuses ({error.strerror or error})",
        file=error.filename or "",
        remedy="check the disk and the limits of the system (ulimit), and run again",
    )


class NumericalError(BsipError):
    """A computation did not converge or has no unique answer (exit code 4)."""

    exit_code = 4
