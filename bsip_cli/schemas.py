"""Every artifact and its columns with type, unit, frame and meaning: configs/artifacts.toml."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, Literal

from bsip_cli.files.regular import read_toml, shipped

Level = Literal["trial", "participant", "cohort"]

_LINE = re.compile(
    r"(?P<names>[^:]+): (?P<type>float|int|bool|text)"
    r"(?: \[(?P<unit>[^;\]]*)(?:; (?P<frame>[^\]]*))?\])? (?P<meaning>.+)"
)


@dataclass(frozen=True)
class Column:
    """One column. ``name`` may end in ``*``: a family of columns of one type and meaning."""

    name: str
    type: Literal["float", "int", "bool", "text"]
    unit: str
    meaning: str
    frame: str = ""


@dataclass(frozen=True)
class Schema:
    """One kind of artifact; ``file``: how its file's name ends, where a level shares its kind."""

    kind: str
    level: Level
    meaning: str
    columns: tuple[Column, ...]
    version: int = 1
    file: str = ""

    @property
    def file_name(self) -> str:
        return self.file or self.kind

    def column(self, name: str) -> Column | None:
        """The definition that a column of this name follows, or None."""
        for column in self.columns:
            if column.name == name:
                return column
            if column.name.endswith("*") and name.startswith(column.name[:-1]):
                return column
        return None


def _columns(text: str, groups: dict[str, str]) -> tuple[Column, ...]:
    """Of lines as the file explains them.

    ValueError: a line is none of these.
    """
    found: list[Column] = []
    for line in text.strip().splitlines():
        if line.startswith("@"):
            found += _columns(groups[line[1:]], groups)
        elif parts := _LINE.fullmatch(line):
            said: dict[str, Any] = parts.groupdict(default="")
            names = said.pop("names").split()
            found += [Column(name, **said) for name in names]
        else:
            raise ValueError(f"no column: {line}")
    return tuple(found)


def _read() -> tuple[dict[str, tuple[Column, ...]], dict[str, Schema]]:
    data = read_toml(shipped("artifacts.toml"))
    groups = data.pop("groups")
    schemas = {
        kind: Schema(kind, **said | {"columns": _columns(said["columns"], groups)})
        for kind, said in data.items()
    }
    return {name: _columns(text, groups) for name, text in groups.items()}, schemas


_GROUPS, SCHEMAS = _read()


def column_names(kind: str) -> list[str]:
    """The columns of a kind of artifact, without families."""
    return [column.name for column in SCHEMAS[kind].columns if column.name[-1] != "*"]


def bsip_names() -> tuple[str, ...]:
    """The ten inertial columns of a segment, in the order of the table."""
    return tuple(column.name for column in _GROUPS["inertia"][:10])


def share_name(name: str) -> str:
    """Name of the data-share column of an inertial column."""
    return f"{name.rpartition('_')[0]}_data_share"


def spread_names() -> tuple[str, ...]:
    """The columns of mass, three coordinates and moments: how far people stray from the table."""
    return tuple(column.name for column in _GROUPS["spread"])
