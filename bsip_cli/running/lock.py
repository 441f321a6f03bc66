"""Only one program at a time writes into a folder of results."""

from __future__ import annotations

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from bsip_cli.artifacts import remove_unfinished
from bsip_cli.errors import UsageError, not_writable

NAME = ".lock"


@contextmanager
def held_alone(folder: Path) -> Iterator[None]:
    """Hold a folder's lock; the system lets go of it whatever becomes of the process.

    What killed processes left half written there is taken away.

    Raises
    ------
    UsageError
        Another process holds it, or the folder cannot be written to.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        handle = (folder / NAME).open("a")
    except OSError as error:
        raise not_writable(folder, error) from None
    with handle:
        _lock(handle.fileno(), folder)
        remove_unfinished(folder)
        yield


def _lock(descriptor: int, folder: Path) -> None:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise UsageError(
            "another bsip is writing there",
            file=folder,
            remedy="wait until it has ended, and run again",
        ) from None
    except OSError as error:
        raise not_writable(folder, error) from None
