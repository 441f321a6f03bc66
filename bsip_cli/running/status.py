"""What lies in a folder of results, and what of it a refusal has made void."""

from __future__ import annotations

import os
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from pathlib import Path

from bsip_cli.pipeline import Stage


@dataclass(frozen=True)
class Folder:
    """The names in the folder of a participant, or of the group, at one moment."""

    path: Path
    names: frozenset[str]

    @classmethod
    def now(cls, path: Path) -> Folder:
        """As it is; a folder that is not there is empty."""
        try:
            with os.scandir(path) as entries:
                return cls(path, frozenset(entry.name for entry in entries))
        except FileNotFoundError:
            return cls(path, frozenset())

    def holds(self, path: Path) -> bool:
        return path.name in self.names

    def refusals(self, owners: Collection[str], stages: Iterable[Stage]) -> list[Path]:
        """The refusals of these owners (ids of participants, stems of trials) by these stages."""
        if not any("_refusal-" in name for name in self.names):
            return []
        asked = (f"{owner}_refusal-{stage.name}.parquet" for owner in owners for stage in stages)
        return [self.path / name for name in dict.fromkeys(asked) if name in self.names]
