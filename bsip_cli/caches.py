"""Where libraries keep from run to run what they compiled or looked up."""

from __future__ import annotations

import os
import stat
import tempfile
from contextlib import suppress
from functools import lru_cache
from pathlib import Path


@lru_cache(maxsize=1)
def cache_home() -> Path | None:
    """The user's cache folder; where it cannot be written to, one of theirs among temporary files.

    As the XDG base directory specification says (a relative path is to be ignored). Code that is
    run lies there, so a folder that another user owns or may write to is not taken, nor one in a
    folder where others may rename it (no sticky bit). None: there is no safe one.
    """
    folders = []
    with suppress(OSError, RuntimeError):  # a user without a home, a circle of links
        home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
        folders += [home.resolve()] if home.is_absolute() else []
    with suppress(OSError):  # no folder for temporary files
        parent = Path(tempfile.gettempdir())
        mode = parent.stat().st_mode
        safe = mode & stat.S_ISVTX or not mode & stat.S_IWOTH
        folders += [parent / f"bsip-cache-{os.geteuid()}"] if safe else []
    return next(filter(_is_ours, folders), None)


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
