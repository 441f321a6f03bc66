"""What a label seems to mean: side, segment and landmark, told from laboratories' habits."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import chain

from bsip_cli.config import shipped


@dataclass(frozen=True)
class Meaning:
    """A label's segment and landmark (empty: only tracks the segment)."""

    segment: str
    landmark: str


@dataclass(frozen=True)
class _Habit:
    """Words that a label may consist of once its side is taken off, and what they mean.

    ``words`` matches the whole rest; {s} in segment and landmark stands for the side.
    """

    words: str
    segment: str
    landmark: str = ""

    def means(self, side: str, rest: str) -> Meaning | None:
        """What the rest of a label means, if these are its words and the side is as needed."""
        sided = "{s}" in self.segment + self.landmark
        if sided != bool(side) or not re.fullmatch(self.words, rest):
            return None
        return Meaning(self.segment.format(s=side), self.landmark.format(s=side))


@cache
def _habits() -> tuple[_Habit, ...]:
    rows = tomllib.loads(shipped("label_words.toml").read_text(encoding="utf-8"))["habits"]
    return tuple(_Habit(row["words"], row["segment"], row.get("landmark", "")) for row in rows)


_SIDES = {"r": "r", "l": "l", "right": "r", "left": "l"}


def meanings(labels: Sequence[str]) -> dict[str, Meaning]:
    """Label to meaning, for those that are understood; every landmark has one label at most.

    Of several labels that seem to be one landmark the shortest has it, the others track.
    """
    found = {label: meaning for label in labels if (meaning := meaning_of(label)) is not None}
    holders: dict[str, str] = {}
    for label in sorted(found, key=lambda name: (len(name), name)):
        holders.setdefault(found[label].landmark, label)
    return {
        label: meaning if holders[meaning.landmark] == label else Meaning(meaning.segment, "")
        for label, meaning in found.items()
    }


def meaning_of(label: str) -> Meaning | None:
    """One label's meaning, or None; a prefix ``Subject:`` does not count."""
    readings = _readings(label.rsplit(":", 1)[-1])
    meant = (habit.means(side, rest) for side, rest in readings for habit in _habits())
    off_centre = (  # RBAK, RSCAP: one side of a middle segment
        habit.means("", rest)
        for side, rest in readings
        for habit in _habits()
        if side and not habit.landmark
    )
    return next(filter(None, chain(meant, off_centre)), None)


def _readings(bare: str) -> list[tuple[str, str]]:
    """Possible sides (l, r or empty) and what is left, joined and in lower case."""
    joined = re.sub(r"[\s._-]", "", bare).lower()
    readings = []
    for word, side in sorted(_SIDES.items(), key=lambda item: -len(item[0])):
        if joined.startswith(word) and len(joined) > len(word):
            readings.append((side, joined[len(word) :]))
        if re.search(rf"[\s._-]{word}$", bare.lower()):
            readings.append((side, joined[: -len(word)]))
    return [*readings, ("", joined)]
