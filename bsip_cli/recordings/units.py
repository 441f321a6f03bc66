"""Units as laboratories spell them, and their size in SI."""

from __future__ import annotations

import re

_LENGTHS = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
_LENGTH_WORDS = {  # how the words begin: meter, metre, millimeters, inches, feet; C3D cuts them
    "mete": "m",
    "metr": "m",
    "deci": "dm",
    "centi": "cm",
    "milli": "mm",
    "inch": "in",
    "foot": "ft",
    "feet": "ft",
}
_LENGTH_SIGNS = {'"': "in", "''": "in", "\N{DOUBLE PRIME}": "in", "'": "ft", "\N{PRIME}": "ft"}


def length_in_m(unit: str) -> float | None:
    """Size of a length unit in metres; None if the spelling is unknown."""
    return _LENGTHS.get(_length_name(unit))


def force_in_N(unit: str) -> float | None:
    """Size of a force unit in newtons; None if it is no force unit (volts, empty)."""
    word = unit.strip().lower()
    if word in ("n", "nt") or word.startswith("newt"):
        return 1.0
    return 1000.0 if word == "kn" else None


def moment_in_Nm(unit: str) -> float | None:
    """Size of a moment unit in N m; accepts Nm, N.mm, ntmm, Newton-meters."""
    word = re.sub(r"[\W_]", "", unit.lower())
    size = 1000.0 if word.startswith("kn") else 1.0
    for force in ("newtons", "newton", "nt", "n"):
        if word.removeprefix("k").startswith(force):
            length_m = length_in_m(word.removeprefix("k")[len(force) :])
            return None if length_m is None else size * length_m
    return None


def length_name(size_m: float) -> str:
    """The name of a unit of this size."""
    name = next(name for name, size in _LENGTHS.items() if size == size_m)
    return {"in": "inches", "ft": "feet"}.get(name, name)


def _length_name(unit: str) -> str:
    word = unit.strip().lower().strip("[](). ")
    word = _LENGTH_SIGNS.get(word, word)
    if word[:-1] in _LENGTHS and word.endswith("s"):  # mms, ins
        word = word[:-1]
    for start, name in _LENGTH_WORDS.items():
        if word.startswith(start):
            return name
    return word
