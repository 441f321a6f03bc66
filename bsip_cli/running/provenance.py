"""What made an artifact: inputs, options, code, versions. No clock: same work, same bytes."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path

from bsip_cli import __version__
from bsip_cli.files.fingerprints import file_hash
from bsip_cli.pipeline import Stage
from bsip_cli.running.code_hash import code_hash

_LIBRARIES = (
    "clarabel",
    "ezc3d",
    "jinja2",
    "matplotlib",
    "numba",
    "numpy",
    "pandas",
    "pin",
    "pyarrow",
    "pydantic",
    "scipy",
    "statsmodels",
)


def hash_of_files(files: Mapping[str, Path]) -> str:
    """SHA-256 of the lines "name hash" of some files, in the order of their names."""
    lines = (f"{name} {file_hash(path)}\n" for name, path in sorted(files.items()))
    return hashlib.sha256("".join(lines).encode("utf-8", "surrogateescape")).hexdigest()


@lru_cache(maxsize=1)
def library_versions() -> dict[str, str]:
    """Versions of the libraries that numbers and figures depend on."""
    return {name: version(name) for name in _LIBRARIES}


def describe(stage: Stage, inputs: Mapping[str, str], options: Mapping) -> dict:
    """The provenance of what ``stage`` makes from ``inputs`` (name: hash) with ``options``."""
    return {
        "stage": stage.name,
        "bsip_version": __version__,
        "code": code_hash(stage.module),
        "libraries": library_versions(),
        "inputs": dict(sorted(inputs.items())),
        "options": json.loads(json.dumps(options, sort_keys=True)),
    }
