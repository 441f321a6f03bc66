"""A first marker set for a recording that no shipped set fits well, as TOML to be corrected."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence

from bsip_cli.body.landmarks import LANDMARKS
from bsip_cli.body.markersets import Marker, MarkerSet
from bsip_cli.body.names import SEGMENTS

_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_HEAD = """\
# A marker set, made from the labels of {source}.
# It was guessed from the labels alone: check it, and correct it before you trust a number.
# One line per segment: LABEL = "landmark"; an empty landmark only tracks its segment.
# Then name this file in study.toml: marker_set = "{name}"
#
# Landmarks (with _l or _r where it has a side):
{landmarks}
description = {description}

[segments]
"""
_TAIL = """
# Other names of a marker, in other files.
[aliases]
{aliases}
# Markers that a recording may lack without a warning: those of the static trial only.
[optional]
markers = {optional}

# How far a marker is trusted, 1 if it is not named; less where skin or shoulder girdle slides.
[weights]
{weights}"""


def starter_toml(marker_set: MarkerSet, unknown: Sequence[str], source: str, name: str) -> str:
    """TOML of a marker set, and labels that were not understood as a comment.

    What is not printable is left out; ``source`` names the recording, ``name`` the file to be
    written. A segment without markers is a comment that shows how to fill it in.
    """
    markers = [m for m in marker_set.markers if m.label and m.label.isprintable()]
    lines = [_segment_line(segment, markers) for segment in SEGMENTS]
    unknown = [label for label in dict.fromkeys(unknown) if label and label.isprintable()]
    if unknown:
        lines += ["", "# Not understood: add them to the segment they sit on, or leave them out."]
        lines += _wrapped(unknown)
    head = _HEAD.format(
        source=source,
        name=name,
        landmarks="\n".join(_wrapped(_stems())),
        description=_quoted(f"Made from the labels of {source}"),
    )
    aliases = [(m.label, [a for a in m.aliases if a.isprintable()]) for m in markers if m.aliases]
    tail = _TAIL.format(
        aliases="".join(f"{_key(label)} = {_listed(names)}\n" for label, names in aliases),
        optional=_listed([m.label for m in markers if m.optional]),
        weights="".join(f"{_key(m.label)} = {m.weight:g}\n" for m in markers if m.weight != 1.0),
    )
    return head + "\n".join(lines) + "\n" + tail


def _listed(labels: Sequence[str]) -> str:
    return f"[{', '.join(map(_quoted, labels))}]"


def _segment_line(segment: str, markers: Sequence[Marker]) -> str:
    members = [f"{_key(m.label)} = {_quoted(m.landmark)}" for m in markers if m.segment == segment]
    if not members:
        return f'# {segment} = {{ LABEL = "landmark" }}'
    return f"{segment} = {{ {', '.join(members)} }}"


def _key(label: str) -> str:
    return label if _BARE_KEY.fullmatch(label) else _quoted(label)


def _quoted(text: str) -> str:
    """As a TOML string; printable text differs from JSON's in nothing."""
    return json.dumps(text, ensure_ascii=False)


def _stems() -> list[str]:
    return sorted({re.sub(r"_[lr]$", "", name) for name in LANDMARKS})


def _wrapped(words: Sequence[str], width: int = 96) -> list[str]:
    """The words as comment lines."""
    lines, line = [], "#"
    for word in words:
        if len(line) + len(word) + 2 > width:
            lines.append(line)
            line = "#"
        line += f" {word}"
    return [*lines, line]
