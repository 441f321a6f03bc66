"""What made an artifact: inputs by hash, options, versions. No clock: same work, same bytes."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path

from bsip_cli import __version__

_LIBRARIES = (
    "clarabel",
    "ezc3d",
    "matplotlib",
    "numba",
    "numpy",
    "pandas",
    "pin",
    "pyarrow",
    "scipy",
    "statsmodels",
)


def file_hash(path: Path) -> str:
    """SHA-256 of a file's bytes."""
    status = path.stat()
    return _file_hash(str(path), status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=4096)
def _file_hash(path: str, _modified: int, _size: int) -> str:
    with Path(path).open("rb") as handle:
        return hashlib.file_digest(handle, "sha256").hexdigest()


def hash_of_files(files: Mapping[str, Path]) -> str:
    """SHA-256 of the lines "name hash" of some files, in the order of their names."""
    lines = (f"{name} {file_hash(path)}\n" for name, path in sorted(files.items()))
    return hashlib.sha256("".join(lines).encode()).hexdigest()


@lru_cache(maxsize=1)
def library_versions() -> dict[str, str]:
    """Versions of the libraries that numbers and figures depend on."""
    return {name: version(name) for name in _LIBRARIES}


def describe(stage: str, inputs: Mapping[str, str], options: Mapping) -> dict:
    """The provenance of what ``stage`` makes from ``inputs`` (name: hash) with ``options``."""
    return {
        "stage": stage,
        "bsip_version": __version__,
        "libraries": library_versions(),
        "inputs": dict(sorted(inputs.items())),
        "options": json.loads(json.dumps(options, sort_keys=True)),
    }
