"""Where libraries keep from run to run what they compiled or looked up."""

from __future__ import annotations

import os
import stat
import tempfile
from functools import lru_cache
from pathlib import Path


@lru_cache(maxsize=1)
def cache_home() -> Path | None:
    """The user's cache folder; where it cannot be written to, one of theirs among temporary files.

    Code that is run lies there, so a folder that another user owns or may write to is not taken.
    None: there is no safe one.
    """
    return next((folder for folder in (_own(), _temporary()) if folder and _is_ours(folder)), None)


def _own() -> Path | None:
    """As the XDG base directory specification says; a relative path is to be ignored."""
    try:
        home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
        return home.resolve() if home.is_absolute() else None
    except (OSError, RuntimeError):  # a user whom the system knows no home of, a circle of links
        return None


def _temporary() -> Path | None:
    """One per user; in a folder where others may rename it (no sticky bit) it would not be safe."""
    try:
        parent = Path(tempfile.gettempdir())
        mode = parent.stat().st_mode
    except OSError:  # no folder for temporary files
        return None
    safe = mode & stat.S_ISVTX or not mode & stat.S_IWOTH
    return parent / f"bsip-cache-{os.geteuid()}" if safe else None


def _is_ours(folder: Path) -> bool:
    """Whether it is there or can be made, takes files, and is this user's alone to change."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        status = folder.lstat()
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return False
    mine = stat.S_ISDIR(status.st_mode) and status.st_uid == os.geteuid()
    return mine and not status.st_mode & stat.S_IWOTH
