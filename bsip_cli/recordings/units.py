"""Units as laboratories spell them, and their size in SI."""

from __future__ import annotations

_LENGTHS = {"m": 1.0, "cm": 0.01, "mm": 0.001}
_LENGTH_WORDS = {"mete": "m", "milli": "mm", "centi": "cm"}  # meter, metre, millimeters, ...


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
    word = unit.strip().lower().replace(" ", "").replace(".", "").replace("*", "").replace("-", "")
    for force in ("newtons", "newton", "nt", "n"):
        if word.startswith(force):
            return length_in_m(word[len(force) :])
    return None


def _length_name(unit: str) -> str:
    word = unit.strip().lower()
    for start, name in _LENGTH_WORDS.items():
        if word.startswith(start):
            return name
    return word
