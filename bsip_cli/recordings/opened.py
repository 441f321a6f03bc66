"""A recording as its file has it, before it is decided how its plates' numbers are understood."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

from bsip_cli.recordings.model import Recording
from bsip_cli.recordings.plate_source import PlateSource


@dataclass(frozen=True, eq=False)
class Opened:
    """``recording`` is without its plates."""

    recording: Recording
    sources: tuple[PlateSource, ...]

    def with_plates(self, numbers: Collection[int]) -> Opened:
        """Only plates of these numbers; without any, all."""
        names = set(map(str, numbers))
        chosen = (source for source in self.sources if not names or source.name in names)
        return replace(self, sources=tuple(chosen))
