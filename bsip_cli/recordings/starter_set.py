"""A first marker set for a recording of which no shipped set fits, as TOML to be corrected."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence

from bsip_cli.body.markersets import LANDMARKS
from bsip_cli.body.names import SEGMENTS
from bsip_cli.recordings.label_words import Meaning, meanings

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
# Markers that a recording may lack without a warning: those of the static trial only.
[optional]
markers = []

# How far a marker is trusted, 1 if it is not named; less where skin or shoulder girdle slides.
[weights]
{weights}"""
_LOOSE = re.compile(r"acromion_[lr]")


def starter_toml(labels: Sequence[str], source: str, name: str) -> str:
    """TOML of a marker set with the labels that are understood, and the others as a comment.

    ``labels`` without prefixes, what is not printable left out; ``source`` names the recording,
    ``name`` the file to be written. Without any understood label the segments are comments that
    show how to fill them in.
    """
    labels = [label for label in dict.fromkeys(labels) if label and label.isprintable()]
    understood = meanings(labels)
    lines = [_segment_line(segment, understood) for segment in SEGMENTS]
    unknown = [label for label in labels if label not in understood]
    if unknown:
        lines += ["", "# Not understood: add them to the segment they sit on, or leave them out."]
        lines += _wrapped(unknown)
    loose = [_key(label) for label, m in understood.items() if _LOOSE.fullmatch(m.landmark)]
    head = _HEAD.format(
        source=source,
        name=name,
        landmarks="\n".join(_wrapped(_stems())),
        description=_quoted(f"Made from the labels of {source}"),
    )
    weights = "".join(f"{key} = 0.5\n" for key in loose)
    return head + "\n".join(lines) + "\n" + _TAIL.format(weights=weights)


def _segment_line(segment: str, understood: Mapping[str, Meaning]) -> str:
    members = [
        f"{_key(label)} = {_quoted(meaning.landmark)}"
        for label, meaning in understood.items()
        if meaning.segment == segment
    ]
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
