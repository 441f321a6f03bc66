"""Label lists of laboratories and what is right of them: label_lists.toml, read."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path

from bsip_cli.segments import LANDMARKS, SEGMENTS

_FILE = Path(__file__).with_name("label_lists.toml")


@dataclass(frozen=True)
class LabelList:
    """Labels in the file's order; label to landmark, to the segment it tracks only; the others."""

    name: str
    bones: dict[str, str]
    tracks: dict[str, str]
    nothing: frozenset[str]

    @property
    def labels(self) -> list[str]:
        return [*self.bones, *self.tracks, *self.nothing]

    def faults(self, found: dict) -> list[str]:
        """What is understood wrongly or not at all, a line each."""
        wrong = [
            f"{label}: {found.get(label)} is not {landmark}"
            for label, landmark in self.bones.items()
            if not found.get(label) or found[label].landmark != landmark
        ]
        wrong += [
            f"{label}: {found.get(label)} does not track {segment} only"
            for label, segment in self.tracks.items()
            if not found.get(label)
            or (found[label].segment, found[label].landmark) != (segment, "")
        ]
        return wrong + [
            f"{label}: is no marker, {found[label]}" for label in self.nothing if found.get(label)
        ]


def label_lists() -> list[LabelList]:
    """All of them."""
    rows = tomllib.loads(_FILE.read_text(encoding="utf-8"))["list"]
    return [_read(row) for row in rows]


def _read(row: dict) -> LabelList:
    return LabelList(
        row["name"],
        _meant(row["bones"], row["sides"], LANDMARKS),
        _meant(row["tracks"], row["sides"], SEGMENTS),
        frozenset(
            name
            for word in row.get("nothing", "").split()
            for _, name in _both(word, word, row["sides"])
        ),
    )


def _meant(text: str, sides: list[str], known) -> dict[str, str]:
    pairs = (word.split("=") for word in text.split())
    meant = {label: what for what, spelt in pairs for what, label in _both(what, spelt, sides)}
    assert set(meant.values()) <= set(known), set(meant.values()) - set(known)
    return meant


def _both(what: str, spelt: str, sides: list[str]) -> list[tuple[str, str]]:
    """The name and the label, of both sides where it has a side."""
    spelt = spelt.replace("~", " ")
    if "{s}" not in spelt:
        return [(what, spelt)]
    names = (what, what) if what in SEGMENTS else (f"{what}_l", f"{what}_r")
    return [(name, spelt.replace("{s}", side)) for name, side in zip(names, sides, strict=True)]
