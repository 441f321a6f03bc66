"""Units as laboratories spell them, and their size in SI."""

from __future__ import annotations

import re

_LENGTHS = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
# How the words begin: meter, metre, millimeters, inches, feet; C3D cuts them.
_WORDS = {"mete": "m", "metr": "m", "deci": "dm", "centi": "cm", "milli": "mm"}
_WORDS |= {"inch": "in", "foot": "ft", "feet": "ft"}
_SIGNS = {'"': "in", "''": "in", "\N{DOUBLE PRIME}": "in", "'": "ft", "\N{PRIME}": "ft"}

_FORCES = (
    ("newtons?|newt|nt|n", 1.0),
    ("kn", 1000.0),
    ("lbs?f?|lbfs|pounds?(?:force)?", 4.4482216152605),
    ("kgs?f?|kgfs|kp", 9.80665),
)


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
    return next((size for word, size in _FORCES if re.fullmatch(word, unit.strip().lower())), None)


def moment_in_Nm(unit: str) -> float | None:
    """Size of a moment unit in N m; accepts Nm, N.mm, ntmm, Newton-meters, in-lb, ft.lbf."""
    word = re.sub(r"[\W_]", "", unit.lower())
    for parts in ((word[:k], word[k:]) for k in range(1, len(word))):
        for force, length in (parts, parts[::-1]):
            force_N, length_m = force_in_N(force), length_in_m(length)
            if force_N is not None and length_m is not None:
                return force_N * length_m
    return None


def length_name(size_m: float) -> str:
    """The name of a unit of this size."""
    name = next(name for name, size in _LENGTHS.items() if size == size_m)
    return {"in": "inches", "ft": "feet"}.get(name, name)
