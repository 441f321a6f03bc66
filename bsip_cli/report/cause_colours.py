"""One colour for each kind of cause in every report: Okabe and Ito, which the colour-blind can
distinguish."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from bsip_cli.report.words import TEXTS

FAULT, REST, NOISE, UNKNOWN = "fault", "rest", "noise", "unknown"
# By term of the error budget; all faults have one, and differ by their hatching.
COLOURS: dict[str, str] = TEXTS["colours"]
HATCHES = ("", "||", "--", "..")
_INK = "#1c1c1c"
_CSS = {
    "": "{colour}",
    "||": f"repeating-linear-gradient(90deg, {{colour}} 0 4px, {_INK} 4px 5px)",
    "--": f"repeating-linear-gradient(0deg, {{colour}} 0 4px, {_INK} 4px 5px)",
    "..": f"radial-gradient({_INK} 1px, {{colour}} 1.5px) 0 0 / 6px 6px",
    "////": f"repeating-linear-gradient(45deg, {{colour}} 0 4px, {_INK} 4px 6px)",
}


@dataclass(frozen=True)
class Piece:
    """What some terms of the error budget, taken together where they look alike, make of an
    error [%]. ``perhaps``: of the unknown part, the faults that may make it but are no findings."""

    label: str
    share: float
    terms: tuple[str, ...]
    perhaps: str = ""

    @property
    def kinds(self) -> tuple[str, ...]:
        """Keys of ``COLOURS``."""
        if UNKNOWN in self.terms:  # whatever may make it
            return (UNKNOWN,)
        return tuple(dict.fromkeys(term.partition(":")[0] for term in self.terms))


@dataclass(frozen=True)
class Fill:
    """Colours one above the other, and a hatching."""

    colours: tuple[str, ...]
    hatch: str

    def css(self) -> str:
        """As the background of an element."""
        if len(self.colours) == 1:
            return _CSS[self.hatch].format(colour=self.colours[0])
        part = 100 / len(self.colours)
        stops = (f"{c} {k * part:.0f}% {(k + 1) * part:.0f}%" for k, c in enumerate(self.colours))
        return f"linear-gradient({', '.join(stops)})"


def fills(pieces: Iterable[Piece]) -> dict[str, Fill]:
    """By label, in the order in which the labels come first."""
    faults = 0
    found: dict[str, Fill] = {}
    for piece in pieces:
        if piece.label in found:
            continue
        hatch = "////" if piece.kinds == (UNKNOWN,) else ""
        if piece.kinds == (FAULT,):
            hatch = HATCHES[faults % len(HATCHES)]
            faults += 1
        found[piece.label] = Fill(tuple(COLOURS[kind] for kind in piece.kinds), hatch)
    return found
