"""Causes that are injected into real recordings, one at a time, and what should be answered."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Parameter:
    """The number that is compared: the length of what ``names`` list, times ``factor`` in ``unit``.

    ``spans``: the difference of two times instead.
    """

    names: tuple[str, ...]
    unit: str
    factor: float = 1.0
    spans: bool = False

    def of(self, values: Mapping[str, float]) -> float:
        """Its value, from parameters by name."""
        found = [values[name] for name in self.names]
        if self.spans:
            return self.factor * (found[1] - found[0])
        if len(found) == 1:
            return self.factor * found[0]
        return self.factor * sum(x * x for x in found) ** 0.5


@dataclass(frozen=True)
class Cause:
    """One injected cause.

    target : as ``bsip inject`` wants it; ``{segment}``, ``{marker}``, ``{pair}`` and ``{up}`` (the
        vertical force in the file's axes) are filled in for each recording.
    place : the target as the diagnosis prints it.
    everywhere : in all moving trials, else in one. over_trial : the size is that at its end.
    alike : effects that may share its class, or stand for it where nothing in these recordings
        tells them apart (design, section 6).
    """

    words: str
    effect: str
    size: float
    target: str
    place: str
    parameter: Parameter
    everywhere: bool = True
    over_trial: bool = False
    alike: tuple[str, ...] = ()


def _cause(row: Mapping[str, str]) -> Cause:
    names, factor = tuple(row["names"].split()), float(row["factor"])
    return Cause(
        *(row["words"], row["effect"], float(row["size"]), row["target"], row["place"]),
        Parameter(names, row["unit"], factor, bool(row["spans"])),
        everywhere=bool(row["everywhere"]),
        over_trial=bool(row["over_trial"]),
        alike=tuple(row["alike"].split()),
    )


with Path(__file__).with_suffix(".csv").open(encoding="utf-8", newline="") as _file:
    CAUSES = tuple(map(_cause, csv.DictReader(_file)))
