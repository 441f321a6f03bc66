"""Folders: what lies in one, whether a path leads into one, and which forces belong to a TRC."""

from __future__ import annotations

import os
import re
import stat
from pathlib import Path

from bsip_cli.errors import BadDataError, UsageError, printable


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
