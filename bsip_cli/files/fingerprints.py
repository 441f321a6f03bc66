"""Hashes of files, taken again only where a file has changed, and the seal of artifacts.

An artifact's seal is the SHA-256 of its own bytes with zeros in the seal's place: whoever reads it
sees whether it is what its producer wrote.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import stat
import time
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from bsip_cli.errors import BadDataError

SEAL = "bsip_seal"
BLANK = "0" * 64
NAME = ".fingerprints.json"
_OWN = (NAME, ".lock")

_PLACE = re.compile(SEAL.encode() + rb"[^0-9a-f]{1,4}([0-9a-f]{64})")  # Thrift: key, length, text
_MAGIC = b"PAR1"
_CHUNK = 1 << 20
# A file may change again within one step of its times: 2 s on FAT and some network file systems,
# which keep no more than hundredths of a second; at most 10 ms, a tick of the kernel, on others.
_COARSE_NS, _COARSE_STEP_S, STEP_S = 10_000_000, 2.0, 0.02


@dataclass(frozen=True)
class Fingerprint:
    """SHA-256 of a file's bytes; ``intact``: its seal fits (None: it has none)."""

    sha256: str
    intact: bool | None = None


@dataclass(frozen=True)
class _Known:
    status: tuple[int, ...]
    found: Fingerprint
    is_final: bool


_known: dict[str, _Known] = {}


def fingerprint(path: Path) -> Fingerprint:
    """Of a regular file, from memory if size, times and inode are what they were.

    BadDataError: it is missing, is no regular file, or cannot be read.
    """
    name = str(path.absolute())
    try:
        before, now = _status(name), time.time_ns()
        known = _known.get(name)
        if known is None or known.status != before:
            known = _known[name] = _Known(before, _taken(name), _is_final(before, now))
    except OSError as error:
        _known.pop(name, None)
        raise BadDataError(
            f"cannot be read ({error.strerror or error})",
            file=path,
            remedy="check the file and the disk, and run again",
        ) from None
    return known.found


def file_hash(path: Path) -> str:
    """SHA-256 of a file's bytes."""
    return fingerprint(path).sha256


def forget(path: Path) -> None:
    """A file has just been written: whatever was known of it counts no more."""
    _known.pop(str(path.absolute()), None)


def seal(path: Path) -> None:
    """Write the seal into a Parquet file that has a blank one."""
    with path.open("r+b") as file:
        at, footer = _footer(file)
        place = _PLACE.search(footer)
        if place is None or place[1] != BLANK.encode():
            raise ValueError(f"{path}: no blank seal")
        digest = _digest(file, at)
        digest.update(footer)
        file.seek(at + place.start(1))
        file.write(digest.hexdigest().encode())


# --- kept between runs ------------------------------------------------------------------------


def kept_in(folder: Path) -> bytes:
    """What an earlier run kept in a folder; nothing where that is no file or cannot be read."""
    path = folder / NAME
    try:
        return path.read_bytes() if path.is_file() else b""
    except OSError:
        return b""


def recall(folder: Path) -> str:
    """Take in what an earlier run kept in a folder; its note. What is damaged is not believed."""
    try:
        kept = json.loads(kept_in(folder))
        for name, (status, sha256, intact) in kept["files"].items():
            _known.setdefault(name, _Known(tuple(status), Fingerprint(sha256, intact), True))
        return str(kept["note"])
    except (OSError, ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return ""  # nothing is known: files are hashed again


def to_keep(folders: Iterable[Path], note: str) -> str:
    """What is known of the files below some folders, and a note, as a text for `recall`."""
    below = tuple(str(folder.absolute()) + os.sep for folder in folders)
    kept = {
        name: [known.status, known.found.sha256, known.found.intact]
        for name, known in sorted(_known.items())
        if known.is_final and name.startswith(below) and os.path.lexists(name)
    }
    return json.dumps({"note": note, "files": kept}, indent=0) + "\n"


def snapshot(folder: Path, files: Iterable[Path]) -> str:
    """SHA-256 over names, sizes, times and inodes of some files and of all in a folder.

    Of a file that was hashed it is those at that moment. Empty where one has changed so shortly
    ago that it may change again with the same times.
    """
    inside = (Path(place, name) for place, _, names in os.walk(folder) for name in names)
    paths = sorted({*files, *(path for path in inside if path.name not in _OWN)})
    digest, now = hashlib.sha256(), time.time_ns()
    for path in paths:
        known = _known.get(str(path.absolute()))
        try:
            status = known.status if known else _status(str(path))
        except OSError:
            return ""
        if not _is_final(status, now):
            return ""
        digest.update(os.fsencode(path) + repr(status).encode())
    return digest.hexdigest()


def forget_all() -> None:
    """Believe nothing: every file is hashed when it is next asked for."""
    _known.clear()


# --- reading bytes ----------------------------------------------------------------------------


def _status(name: str) -> tuple[int, ...]:
    found = Path(name).stat()
    if not stat.S_ISREG(found.st_mode):
        raise OSError(0, "not a regular file")
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns


def _is_final(status: tuple[int, ...], now: int) -> bool:
    step_s = _COARSE_STEP_S if status[-1] % _COARSE_NS == 0 else STEP_S
    return now - max(status[-2:]) > step_s * 1e9


def _taken(name: str) -> Fingerprint:
    with Path(name).open("rb") as file:
        at, footer = _footer(file)
        plain = _digest(file, at)
        sealed = plain.copy()
        plain.update(footer)
        place = _PLACE.search(footer)
        if place is None:
            return Fingerprint(plain.hexdigest())
        sealed.update(footer[: place.start(1)] + BLANK.encode() + footer[place.end(1) :])
        return Fingerprint(plain.hexdigest(), sealed.hexdigest().encode() == place[1])


def _footer(file: BinaryIO) -> tuple[int, bytes]:
    """Where the footer of a Parquet file begins, and its bytes; of another file its end."""
    size = file.seek(0, os.SEEK_END)
    file.seek(max(0, size - 8))
    end = file.read(8)
    length = int.from_bytes(end[:4], "little") + 8 if end[4:] == _MAGIC else 0
    at = size - length if length <= size else size
    file.seek(at)
    return at, file.read()


def _digest(file: BinaryIO, until: int) -> hashlib._Hash:
    digest = hashlib.sha256()
    file.seek(0)
    while until > 0:
        chunk = file.read(min(_CHUNK, until))
        if not chunk:
            raise OSError(0, "it became shorter while it was read")
        digest.update(chunk)
        until -= len(chunk)
    return digest
