"""Inertial parameters by regression (RM) from an anthropometric table."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from bsip_cli.body.inertia import Inertia, from_phi, nearest_physical_tensor
from bsip_cli.body.person import Person
from bsip_cli.files.regular import read_toml
from bsip_cli.stated import OTHER

_MEAN_STATURE_M = {"M": 1.77, "F": 1.61, OTHER: (1.77 + 1.61) / 2}


@dataclass(frozen=True, eq=False)
class TableRow:
    """One segment of a table: fractions of the body's mass and of the segment's length.

    ``gyration`` (3, 3) holds signed squares of the radii: the tensor is m L^2 times it.
    """

    mass_fraction: float
    com: np.ndarray
    gyration: np.ndarray
    mean_length_m: float

    def tensor(self) -> np.ndarray:
        """(3, 3) about the centre of mass [kg m2], of a body of 1 kg with the mean lengths."""
        return self.mass_fraction * self.mean_length_m**2 * self.gyration


@dataclass(frozen=True)
class Regression:
    """RM of one person, per segment with mass in its segment frame, and what was repaired."""

    inertias: tuple[Inertia, ...]
    notes: tuple[str, ...]


@cache
def load_table(name: str) -> dict[tuple[str, str], TableRow]:
    """Rows of a shipped table by sex (M, F, other) and segment, for the right side of the body.

    dumas2015 is dumas2007 with another torso: thorax and abdomen as one body, upright.
    """
    rows = _rows_of("dumas2007")
    if name == "dumas2015":
        parts = _rows_of(name)
        rows |= {
            (sex, "torso"): _torso(parts[sex, "thorax"], parts[sex, "abdomen"]) for sex in "MF"
        }
    # halfway between two rows; of two tensors that a body can have the mean is one as well
    for segment in [one for sex, one in rows if sex == "M" and ("F", one) in rows]:
        both = (vars(rows[sex, segment]).values() for sex in "MF")
        means = ((mine + theirs) / 2 for mine, theirs in zip(*both, strict=True))
        rows[OTHER, segment] = TableRow(*means)
    return rows


def _rows_of(name: str) -> dict[tuple[str, str], TableRow]:
    file, rows = Path(__file__).parent / "tables" / f"{name}.csv", {}
    lines = [line for line in file.read_text(encoding="utf-8").splitlines() if line[0] != "#"]
    for row in csv.DictReader(lines):
        radii = [[row[f"r{min(a, b)}{max(a, b)}_pct"] for b in "xyz"] for a in "xyz"]
        com = np.array([float(row[f"com_{axis}_pct"]) for axis in "xyz"]) / 100
        rows[row["sex"], row["segment"]] = TableRow(
            float(row["mass_percent"]) / 100,
            com,
            np.array([[_signed_square(radius) for radius in line] for line in radii]),
            float(row["mean_length_mm"]) / 1000,
        )
    return rows


def _signed_square(radius_pct: str) -> float:
    """A radius of gyration with an i behind it has a negative square."""
    radius = float(radius_pct.rstrip("i")) / 100
    return -radius * radius if radius_pct.endswith("i") else radius * radius


def _torso(thorax: TableRow, abdomen: TableRow) -> TableRow:
    """Both parts as one body from CJC to LJC, the abdomen's axes parallel to the thorax's."""
    length = thorax.mean_length_m + abdomen.mean_length_m
    below = np.array([0.0, -thorax.mean_length_m, 0.0])  # TJC as seen from CJC
    bodies = [
        Inertia(row.mass_fraction, row.mean_length_m * row.com, row.tensor()).moved(-origin)
        for row, origin in ((thorax, np.zeros(3)), (abdomen, below))
    ]
    whole = from_phi(np.sum([body.phi() for body in bodies], axis=0))
    gyration = whole.tensor_kgm2 / (whole.mass_kg * length**2)
    return TableRow(whole.mass_kg, whole.com_m / length, gyration, length)


def regress(person: Person, sex: str, mass_kg: float, table: str = "dumas2007") -> Regression:
    """Mass, centre of mass and tensor of every segment from sex, mass and segment lengths.

    Dumas 2007 with the head of its corrigendum: ``com = L c``, ``I_ij = m (r_ij L)^2`` (Hansen
    2017, equations 2 and 3). The masses are normalised to the person's mass; the left side is
    the right side mirrored in Z; a tensor that no body can have becomes the nearest one that can.
    ``sex`` is M, F or other, for which both tables' rows are averaged.
    """
    rows = load_table(table)
    skeleton = person.skeleton
    chosen = [rows[sex, skeleton.table_rows[i]] for i in skeleton.bodies]
    lengths = person.lengths_m[list(skeleton.bodies)]
    total = sum(row.mass_fraction for row in chosen)
    inertias, notes = [], []
    for segment, row, length in zip(skeleton.body_names, chosen, lengths, strict=True):
        mirror = np.array([1.0, 1.0, -1.0 if skeleton.side(segment) == "l" else 1.0])
        mass = mass_kg * row.mass_fraction / total
        tensor = mass * length**2 * row.gyration * np.outer(mirror, mirror)
        body = Inertia(mass, length * row.com * mirror, tensor)
        note = ""
        if not body.is_physical():
            body = Inertia(mass, body.com_m, nearest_physical_tensor(tensor))
            note = "no body has the table's moments of inertia; the nearest possible ones are taken"
        inertias.append(body)
        notes.append(note)
    return Regression(tuple(inertias), tuple(notes))


def mean_length_m(sex: str, row: str, height_m: float | None) -> float:
    """Length of a segment from the table's means, scaled to the stature where it is known."""
    mean = load_table("dumas2007")[sex, row].mean_length_m
    return mean * (height_m / _MEAN_STATURE_M[sex] if height_m else 1.0)


def stature_m(sex: str, lengths_m: dict[str, float]) -> float:
    """Stature from segment lengths by table row, by the proportions of the table's sample."""
    table = load_table("dumas2007")
    mean = sum(table[sex, name].mean_length_m for name in lengths_m)
    return _MEAN_STATURE_M[sex] * sum(lengths_m.values()) / mean


# --- how far people stray from the table, and whom it does not hold for ---------------------------


_ALONG = {"foot": 0}  # axis of a segment's length; Y, 1, of all others


@dataclass(frozen=True, eq=False)
class Strays:
    """Standard deviations of a person's segments about the table, in %.

    mass : (n,) of the segment's mass.
    com : (n, 3) of the length of a rod with the segment's mass and mean moment of inertia, segment
        axes; NaN where no source was found.
    moments : (n,) of the moments of inertia of a segment of known mass.
    other : (n, 2) by how much the mass and, along the segment, the centre of mass of another table
        differ, in the same units.
    outside : why the table does not hold for this person; empty if it does.
    """

    mass: np.ndarray
    com: np.ndarray
    moments: np.ndarray
    other: np.ndarray
    outside: str


def strays_of(sex: str, mass_kg: float, stature_m: float, rows: Sequence[str]) -> Strays:
    """Of a person, for ``rows`` (n) of the table; sources are in tables/people.toml.

    sex : M, F or other, which has the mean variance of both.
    """
    figures = read_toml(Path(__file__).parent / "tables" / "people.toml")
    sexes = ["M", "F"] if sex == OTHER else [sex]
    spreads = [figures["spread"][one] for one in sexes]
    com, other = np.full((len(rows), 3), np.nan), np.zeros((len(rows), 2))
    for i, row in enumerate(rows):
        other[i, 0] = np.mean([one[row]["mass"][1] for one in spreads])
        if "com" in spreads[0][row]:
            com[i, _ALONG.get(row, 1)] = _sd(spreads, row, "com")
            other[i, 1] = np.mean([one[row]["com"][1] for one in spreads])
    index, (low, high) = mass_kg / stature_m**2, figures["holds"]["body_mass_index"]
    is_small = stature_m < figures["holds"]["stature_m"][sex]
    more = [_differs(figures, is_small, mass_kg, stature_m, row) for row in rows]
    why = "stature" if is_small else "within" if low <= index <= high else "body_mass_index"
    outside = figures["outside"][why].format(stature_m=stature_m, index=index, low=low, high=high)
    return Strays(
        np.hypot([_sd(spreads, row, "mass") for row in rows], more),
        com,
        np.array([_sd(spreads, row, "moments") for row in rows]),
        other,
        outside,
    )


def _sd(spreads: Sequence[Mapping[str, Any]], row: str, name: str) -> float:
    """Of people and, about their mean, of two tables; the mean variance of the sexes."""
    pairs = np.array([one[row][name] for one in spreads])
    return float(np.sqrt(np.mean(pairs[:, 0] ** 2 + pairs[:, 1] ** 2 / 2)))


def _differs(
    figures: Mapping[str, Any], is_small: bool, mass_kg: float, stature_m: float, row: str
) -> float:
    """By how much [%] a segment's share of the body's mass differs: a boy's from a man's, else from
    that of people of the same stature and the mean body-mass index."""
    if is_small:
        child = figures["child"]
        own = float(np.interp(stature_m, child["stature_m"], child[row]["boys"]))
        usual = child[row]["men"]
    else:
        share = figures["share"]
        own, usual = (
            float(np.sum(np.array(share[row]) @ [1.0, kg, 100 * stature_m])) / kg
            for kg in (mass_kg, share["body_mass_index"] * stature_m**2)
        )
    return 100 * abs(own / usual - 1)
