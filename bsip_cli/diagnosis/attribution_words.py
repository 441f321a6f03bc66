"""In words: how the table and what was identified differ, and what that does to RM's error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bsip_cli.body.inertia import Inertia
from bsip_cli.body.names import in_words
from bsip_cli.statistics.normal import Z95

_BESIDE = 0.5  # of the largest coordinate of a shift: smaller ones are not put into words


@dataclass(frozen=True, eq=False)
class Bodies:
    """A segment by the table and as identified, about its joint centre.

    mass_sd_kg, com_sd_m : standard deviations of what was identified; (3,) in segment axes.
    """

    segment: str
    table: Inertia
    found: Inertia
    mass_sd_kg: float
    com_sd_m: np.ndarray

    def shift_m(self) -> np.ndarray:
        """(3,) from the identified centre of mass to the table's, segment axes."""
        return self.table.com_m - self.found.com_m


def difference(group: str, bodies: Bodies) -> tuple[float, str]:
    """How far the table lies from what was identified in one group, and the unit."""
    table, found = bodies.table, bodies.found
    if group == "mass":
        return table.mass_kg - found.mass_kg, "kg"
    if group == "centre_of_mass":
        return float(np.linalg.norm(bodies.shift_m())), "m"
    return float(np.linalg.norm(table.tensor_kgm2 - found.tensor_kgm2)), "kg m2"


def whose(group: str, bodies: Bodies) -> str:
    """``head's mass, of which the table has 0.40 ± 0.15 kg too little``; without "too" where the
    95 % interval of the difference reaches zero."""
    owner = f"{in_words(bodies.segment)}'s {group.replace('_', ' ')}"
    size, unit = difference(group, bodies)
    if group == "mass":
        return f"{owner}, of which the table has {_mass_words(size, Z95 * bodies.mass_sd_kg)}"
    if group == "centre_of_mass":
        where = _shift_words(bodies.segment, bodies.shift_m(), Z95 * bodies.com_sd_m)
        return f"{owner}, which the table puts {where}"
    return f"{owner}, which differs from the table's by {size:.2g} {unit}"


def sentence(share: float, error: str, source: str) -> str:
    """``68 % of the squared error in COP AP comes from the head's mass, of which ...``."""
    if share < 0:
        return f"the {source}, adds {-100 * share:.0f} % to the squared error in {error}"
    return f"{100 * share:.0f} % of the squared error in {error} comes from the {source}"


def _mass_words(size_kg: float, half_kg: float) -> str:
    amount = f"{abs(size_kg):.2f} ± {half_kg:.2f} kg"
    if abs(size_kg) <= half_kg:
        return f"{amount} {'more' if size_kg > 0 else 'less'} than OM"
    return f"{amount} {'too much' if size_kg > 0 else 'too little'}"


def _shift_words(segment: str, shift_m: np.ndarray, half_m: np.ndarray) -> str:
    """``21 ± 8 mm too far back`` of a shift (3,) in segment axes, as the person stands upright;
    the coordinates that are sure, or if none is, the largest, less sure of themselves."""
    side = segment[-2:]
    across = {"_r": ("outward", "inward"), "_l": ("inward", "outward")}.get(side, ("right", "left"))
    sure = np.abs(shift_m) > half_m
    told = np.where(sure, np.abs(shift_m), 0.0) if sure.any() else np.abs(shift_m)
    order = [k for k in np.argsort(-told) if told[k] >= _BESIDE * told.max()]
    if sure.any():
        ways = (
            ("too far forward", "too far back"),
            ("too high", "too low"),
            (f"too far {across[0]}", f"too far {across[1]}"),
        )
    else:
        ways = (
            ("farther forward", "farther back"),
            ("higher", "lower"),
            (f"farther {across[0]}", f"farther {across[1]}"),
        )
    parts = [
        f"{1000 * abs(shift_m[k]):.0f} ± {1000 * half_m[k]:.0f} mm {ways[k][int(shift_m[k] < 0)]}"
        for k in order
    ]
    return " and ".join(parts) + ("" if sure.any() else " than OM")
