"""Units as laboratories spell them, and their size in SI."""

from __future__ import annotations

import re

_LENGTHS = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
# How the words begin: meter, metre, millimeters, inches, feet; C3D cuts them.
_WORDS = {"mete": "m", "metr": "m", "deci": "dm", "centi": "cm", "milli": "mm"}
_WORDS |= {"inch": "in", "foot": "ft", "feet": "ft"}
_SIGNS = {'"': "in", "''": "in", "\N{DOUBLE PRIME}": "in", "'": "ft", "\N{PRIME}": "ft"}


def length_in_m(unit: str) -> float | None:
    """Size of a length unit in metres; None if the spelling is unknown."""
    word = unit.strip().lower().strip("[](). ")
    word = _SIGNS.get(word, word)
    if word.endswith("s") and word[:-1] in _LENGTHS:  # mms, ins
        word = word[:-1]
    return _LENGTHS.get(
        next((name for start, name in _WORDS.items() if word.startswith(start)), word)
    )


def force_in_N(unit: str) -> float | None:
    """Size of a force unit in newtons; None if it is no force unit (volts, empty)."""
    word = unit.strip().lower()
    if word in ("n", "nt") or word.startswith("newt"):
        return 1.0
    return 1000.0 if word == "kn" else None


def moment_in_Nm(unit: str) -> float | None:
    """Size of a moment unit in N m; accepts Nm, N.mm, ntmm, Newton-meters."""
    word = re.sub(r"[\W_]", "", unit.lower())
    of_force = re.match("(k?)(?:newtons|newton|nt|n)", word)
    length_m = length_in_m(word[of_force.end() :]) if of_force else None
    if of_force is None or length_m is None:
        return None
    return 1000.0 * length_m if word.startswith("kn") else length_m


def length_name(size_m: float) -> str:
    """The name of a unit of this size."""
    name = next(name for name, size in _LENGTHS.items() if size == size_m)
    return {"in": "inches", "ft": "feet"}.get(name, name)
