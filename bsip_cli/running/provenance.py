"""What made an artifact: inputs, options, code, versions. No clock: same work, same bytes."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path

from bsip_cli import __version__
from bsip_cli.config import shipped
from bsip_cli.files.fingerprints import file_hash
from bsip_cli.pipeline import Stage

# --- which code and shipped tables a stage's results depend on, as one hash -----------------------


_PACKAGE = Path(__file__).parents[1]
_NAME = _PACKAGE.name
_FROM = re.compile(rf"^\s*from\s+({_NAME}[\w.]*)\s+import\s+(\([^)]*\)|[^\n(]*)", re.MULTILINE)
_IMPORT = re.compile(rf"^\s*import\s+({_NAME}[\w.]*)", re.MULTILINE)
_CHOSEN_LATER = re.compile(rf'"({_NAME}[\w.]*)\.\{{')  # import_module(f"bsip_cli.package.{name}")
_SHIPPED = re.compile(r'\bshipped\(\s*"([^"]+)"')
_OPTIONS = "default.toml"  # its values are in the provenance one by one


@lru_cache(maxsize=64)
def code_hash(module: str) -> str:
    """SHA-256 over the modules that ``module`` imports, directly or not, and the files they read.

    Those are the files in ``configs/`` that they name, and the tables and templates that lie in
    their packages.
    """
    modules = imported_by(module)
    digest = hashlib.sha256()
    for name in sorted(modules):
        digest.update(f"{name}\n".encode() + _source(name))
    for file in sorted(_data_of(modules)):
        digest.update(f"{file.name}\n".encode() + file.read_bytes())
    return digest.hexdigest()


def imported_by(module: str) -> frozenset[str]:
    """The modules of the package that ``module`` imports anywhere, itself among them."""
    found: set[str] = set()
    waiting = [module, *_parents(module)]
    while waiting:
        name = waiting.pop()
        if name not in found and _file_of(name) is not None:
            found.add(name)
            waiting += _named_in(name)
    return frozenset(found)


@lru_cache(maxsize=1024)
def _named_in(module: str) -> tuple[str, ...]:
    """Modules that a module's text names in imports, with their packages."""
    text = _source(module).decode()
    named = set(_IMPORT.findall(text))
    for package, names in _FROM.findall(text):
        words = re.findall(r"\w+", re.sub(r"#.*", "", names))
        named |= {package, *(f"{package}.{word}" for word in words)}
    for package in _CHOSEN_LATER.findall(text):
        folder = _PACKAGE.joinpath(*package.split(".")[1:])
        named |= {f"{package}.{file.stem}" for file in folder.glob("*.py")}
    return (*named, *(parent for name in named for parent in _parents(name)))


def _parents(module: str) -> list[str]:
    return [module.rsplit(".", k)[0] for k in range(1, module.count(".") + 1)]


def _file_of(module: str) -> Path | None:
    place = _PACKAGE.joinpath(*module.split(".")[1:])
    candidates = (place.with_suffix(".py"), place / "__init__.py")
    return next((file for file in candidates if file.is_file()), None)


@lru_cache(maxsize=1024)
def _source(module: str) -> bytes:
    file = _file_of(module)
    return file.read_bytes() if file else b""


def _data_of(modules: frozenset[str]) -> set[Path]:
    """Files that are no code: those named in ``configs/``, and those in the modules' packages."""
    named = {name for module in modules for name in _SHIPPED.findall(_source(module).decode())}
    files = {file for name in named - {_OPTIONS} for file in _below(shipped(name))}
    packages = {module.rpartition(".")[0] for module in modules} - {"", _NAME}
    folders = {_PACKAGE.joinpath(*package.split(".")[1:]) for package in packages}
    inside = {file for folder in folders for file in _below(folder)}
    return files | {file for file in inside if _package_of(file) in folders}


def _below(place: Path) -> set[Path]:
    """Files that belong to the package and are no code."""
    files = place.rglob("*") if place.is_dir() else [place]
    return {
        file for file in files if file.is_file() and not _is_made(file) and file.suffix != ".py"
    }


def _is_made(file: Path) -> bool:
    """What Python, numba or an editor left there."""
    return file.parent.name == "__pycache__" or file.name.startswith(".") or file.name[-1] == "~"


def _package_of(file: Path) -> Path:
    return next(folder for folder in file.parents if (folder / "__init__.py").is_file())


# --------------------------------------------------------------------------------------------------


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
