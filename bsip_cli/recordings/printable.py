"""Names that a recording brings, as they may be printed."""

from __future__ import annotations


def printable(text: str) -> str:
    """``text`` with a question mark for every character that would steer a terminal."""
    return "".join(character if character.isprintable() else "?" for character in text)
