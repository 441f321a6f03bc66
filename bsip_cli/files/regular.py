"""Files that others wrote: what may be opened at all, and TOML."""

from __future__ import annotations

import os
import stat
import tomllib
from pathlib import Path

from bsip_cli.errors import BadDataError, BsipError, UsageError

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


def read_toml(file: Path) -> dict:
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
    except RecursionError:
        raise _not_toml(file, "brackets in brackets without end") from None
    except ValueError as error:  # tomllib's, no UTF-8, a number of more digits than Python reads
        raise _not_toml(file, str(error)) from None
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


def _not_toml(file: Path, why: str) -> UsageError:
    return UsageError(
        f"not valid TOML ({why})",
        file=file,
        expected="TOML in UTF-8",
        remedy="correct that place",
    )


def shipped(*parts: str) -> Path:
    """Path of a file that ships in ``configs/``, in a checkout as in an installed wheel."""
    package = Path(__file__).parents[1]
    installed = package / "configs"
    return (installed if installed.is_dir() else package.parent / "configs").joinpath(*parts)
