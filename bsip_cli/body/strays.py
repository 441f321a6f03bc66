"""How far people stray from the anthropometric table, and whom it does not hold for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from bsip_cli.files.regular import read_toml
from bsip_cli.stated.sex_words import OTHER

_ALONG = {"foot": 0}  # axis of a segment's length; Y, 1, of all others


@dataclass(frozen=True, eq=False)
class Strays:
    """Standard deviations of a person's segments about the table, in %.

    Attributes
    ----------
    mass : (n,) of the segment's mass.
    com : (n, 3) of the length of a rod with the segment's mass and mean moment of inertia, segment
        axes; NaN where no source was found.
    moments : (n,) of the moments of inertia of a segment of known mass.
    outside : why the table does not hold for this person; empty if it does.
    """

    mass: np.ndarray
    com: np.ndarray
    moments: np.ndarray
    outside: str


def strays_of(sex: str, mass_kg: float, stature_m: float, rows: Sequence[str]) -> Strays:
    """Of a person, for ``rows`` (n) of the table; sources are in tables/people.toml.

    sex : M, F or other, which has the mean variance of both.
    """
    figures = _figures()
    sexes = ["M", "F"] if sex == OTHER else [sex]
    spreads = [figures["spread"][one] for one in sexes]
    com = np.full((len(rows), 3), np.nan)
    for i, row in enumerate(rows):
        if "com" in spreads[0][row]:
            com[i, _ALONG.get(row, 1)] = _sd(spreads, row, "com")
    index, (low, high) = mass_kg / stature_m**2, figures["holds"]["body_mass_index"]
    is_small = stature_m < figures["holds"]["stature_m"][sex]
    more = [
        _child_differs(figures["child"], row, stature_m)
        if is_small
        else _build_differs(figures["share"], row, mass_kg, stature_m)
        for row in rows
    ]
    outside = ""
    if is_small:
        outside = (
            f"{stature_m:.2f} m tall, and the table (RM) is of adults: should this be a child, "
            "the spreads of its masses hold what boys' segments differ from men's by, but no "
            "figures were found for its centres of mass and tensors"
        )
    elif not low <= index <= high:
        outside = (
            f"body-mass index {index:.0f} kg/m2, and the table (RM) is of people from {low:g} to "
            f"{high:g}: the spreads of the masses hold what a regression on mass and stature "
            "differs from it by, but no figures were found for centres of mass and tensors"
        )
    return Strays(
        np.hypot([_sd(spreads, row, "mass") for row in rows], more),
        com,
        np.array([_sd(spreads, row, "moments") for row in rows]),
        outside,
    )


@cache
def _figures() -> dict:
    return read_toml(Path(__file__).parent / "tables" / "people.toml")


def _sd(spreads: Sequence[Mapping], row: str, name: str) -> float:
    """Of people, and of tables where they were compared; the mean variance of the sexes."""
    return float(np.sqrt(np.mean([np.sum(np.square(one[row][name])) for one in spreads])))


def _child_differs(child: Mapping, row: str, stature_m: float) -> float:
    """By how much [%] a boy's share of the body's mass differs from a man's."""
    boy, man = np.interp(stature_m, child["stature_m"], child[row]["boys"]), child[row]["men"]
    return 100 * abs(float(boy) / man - 1)


def _build_differs(share: Mapping, row: str, mass_kg: float, stature_m: float) -> float:
    """By how much [%] a segment's share differs from that of people of the same stature and the
    mean body-mass index."""

    def of(kg: float) -> float:
        return float(np.sum(np.array(share[row]) @ [1.0, kg, 100 * stature_m])) / kg

    return 100 * abs(of(mass_kg) / of(share["body_mass_index"] * stature_m**2) - 1)
