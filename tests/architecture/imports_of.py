"""Which modules a module imports, read from its source without running it."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

import bsip_cli

ROOT = Path(bsip_cli.__file__).parent


@cache
def modules() -> dict[str, frozenset[str]]:
    """Every module of the package (dotted, without ``bsip_cli.``) and what it imports.

    Of bsip's own modules the full name, of other packages the first part.
    """
    known = set(_files())
    return {
        name: frozenset(_module(source, known) for source in _sources(file))
        for name, file in _files().items()
    }


def names_from(module: str, source: str) -> set[str]:
    """What a module imports from another by name."""
    names = _sources(_files()[module])
    return {name.removeprefix(f"{source}.") for name in names if name.startswith(f"{source}.")}


@cache
def _files() -> dict[str, Path]:
    return {_dotted(file): file for file in sorted(ROOT.rglob("*.py")) if _is_code(file)}


def _is_code(file: Path) -> bool:
    return file.name != "__init__.py" or file.stat().st_size > 0


def _dotted(file: Path) -> str:
    parts = file.relative_to(ROOT).with_suffix("").parts
    return ".".join(part for part in parts if part != "__init__") or "__init__"


def _sources(file: Path) -> set[str]:
    """Dotted names of all that a file imports, inside functions too."""
    found = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}: relative import"
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def _module(name: str, known: set[str]) -> str:
    """``bsip_cli.segments.SEGMENTS`` becomes ``bsip_cli.segments``; others their first part."""
    if not name.startswith("bsip_cli"):
        return name.split(".")[0]
    inner = name.removeprefix("bsip_cli").removeprefix(".")
    while inner and inner not in known:
        inner = inner.rpartition(".")[0]
    return f"bsip_cli.{inner}" if inner else "bsip_cli"


def package(module: str) -> str:
    """``body`` of ``body.person``, ``cli`` of ``cli``."""
    return module.split(".")[0]
