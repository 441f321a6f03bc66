"""What a C3D file says of the person: mass, height and sex, where programs write them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from bsip_cli.recordings.c3d_format import Group, Parameters, texts
from bsip_cli.recordings.model import Finding, StatedPerson
from bsip_cli.stated import (
    COLUMN_NAMES,
    HEIGHT,
    MASS,
    Quantity,
    Reading,
    is_usual_pair,
    readings_of,
    sex_of,
)

_GROUPS = ("PROCESSING", "PATIENT", "PARTICIPANT", "ANTHROPOMETRY", "SUBJECT")
_SAME = 0.005  # relative: programs round


def stated_person(parameters: Parameters) -> tuple[StatedPerson, tuple[Finding, ...]]:
    """Mass [kg], height [m] and sex as the groups of the subject state them; zeros state nothing.

    Vicon writes PROCESSING:Bodymass in kg and Height in mm, others SUBJECT:WEIGHT, SUBJECTS:MASS,
    with any unit: the one that is stated beside it or that alone makes a person. What contradicts
    itself, belongs to several people or may be either unit is not used, and that is said.
    """
    findings: list[Finding] = []
    masses, heights = (_readings(parameters, q, findings) for q in (MASS, HEIGHT))
    mass, height = _pair(masses, heights, findings)
    said = _texts(parameters, COLUMN_NAMES)
    sexes = {one for one in (sex_of(value, {}) for value in said) if one is not None}
    if len(sexes) > 1:
        findings.append(_unused(f"sexes {', '.join(sorted(said))}", "one"))
    names = _texts(parameters, "name names")
    sex, name = ("".join(some) if len(some) == 1 else "" for some in (sexes, names))
    person = StatedPerson(mass, height, sex, name)
    if words := person.words():
        action = "used where participants.tsv says n/a"
        findings.append(Finding("stated_person", "", words, "", action, "info"))
    return person, tuple(findings)


def together(people: Mapping[str, StatedPerson]) -> tuple[StatedPerson, tuple[str, ...]]:
    """What all files of one person say, by name of the file; and where they contradict each other.

    A value on which they do not agree is not used.
    """
    agreed: dict[str, float | None] = {}
    notes = []
    for what, unit, plural in (("mass_kg", "kg", "masses"), ("height_m", "m", "heights")):
        values = {n: v for n, p in people.items() if (v := getattr(p, what)) is not None}
        if values and _differ(values.values()):
            of = ", ".join(f"{value:.4g} {unit} in {name}" for name, value in values.items())
            notes.append(f"its files state different {plural}: {of}; none used")
        else:
            agreed[what] = next(iter(values.values()), None)
    sexes = {name: person.sex for name, person in people.items() if person.sex}
    if len(set(sexes.values())) > 1:
        notes.append(f"its files state different sexes: {sexes}; none used")
    sex = "".join(set(sexes.values())) if len(set(sexes.values())) == 1 else ""
    return StatedPerson(agreed.get("mass_kg"), agreed.get("height_m"), sex), tuple(notes)


def against_table(
    stated: StatedPerson, mass_kg: float | None, height_m: float | None, tolerance_percent: float
) -> list[Finding]:
    """Where a file says another mass or height than participants.tsv, whose values are used."""
    findings = []
    pairs = (("mass", "kg", stated.mass_kg, mass_kg), ("height", "m", stated.height_m, height_m))
    for what, unit, own, table in pairs:
        if own and table and abs(own / table - 1) > tolerance_percent / 100:
            found = f"the file states a {what} of {own:.4g} {unit}"
            expected = f"{table:.4g} {unit}, as in participants.tsv"
            findings.append(
                Finding("stated_person", "", found, expected, "used participants.tsv", "warning")
            )
    return findings


# --- one value ------------------------------------------------------------------------------------


def _named(parameters: Parameters, names: str) -> Iterator[tuple[str, Group, str]]:
    """Parameters of the subject's groups that are so named: group, what it holds, own name."""
    for name, group in parameters.items():
        if name.strip().upper().startswith(_GROUPS):
            for parameter in group:
                if parameter.casefold().replace("_", "").replace(" ", "") in names.split():
                    yield name, group, parameter


def _texts(parameters: Parameters, names: str) -> set[str]:
    values = (text.strip() for _, g, p in _named(parameters, names) for text in texts(g, p))
    return set(filter(None, values))


def _readings(
    parameters: Parameters, quantity: Quantity, findings: list[Finding]
) -> tuple[Reading, ...]:
    """What the value may be that all places state; nothing where they contradict each other."""
    said: dict[str, tuple[Reading, ...]] = {}
    for name, group, parameter in _named(parameters, quantity.names):
        of_units = tuple(f"{parameter.casefold()}{ending}" for ending in ("_units", "_unit"))
        beside = [p for p in group if p.casefold() in of_units]
        spelt = [quantity.unit_spelt(text) for p in beside for text in texts(group, p)]
        for value in _values(group[parameter]):
            if readings := readings_of(value, quantity, next(filter(None, spelt), "")):
                said[f"{name}:{parameter} = {value}"] = readings
    if said and _differ(readings[0].value for readings in said.values()):
        findings.append(_unused(", ".join(said), f"one {quantity.column}"))
        return ()
    return next(iter(said.values()), ())


def _values(value: tuple[str, ...] | np.ndarray) -> list[str]:
    """As texts; single precision without its noise."""
    if isinstance(value, tuple):
        return [text.strip() for text in value if text.strip()]
    return [f"{one:.6g}" for one in np.ravel(value).astype(float) if np.isfinite(one) and one]


def _pair(
    masses: tuple[Reading, ...], heights: tuple[Reading, ...], findings: list[Finding]
) -> tuple[float | None, float | None]:
    """Mass and height in the units with which they make a person; None for what stays open."""
    if masses and heights:
        pairs = _of_people(masses, heights) or _of_people(_in_all_units(masses), heights)
        heights = tuple(dict.fromkeys(h for _, h in pairs)) or heights
        if len(masses) > 1:
            masses = tuple(dict.fromkeys(m for m, _ in pairs)) or masses
        mass, height = masses[0].value, heights[0].value
        if len(masses) == len(heights) == 1 and not is_usual_pair(mass, height):
            may_be = " or ".join(f"{m.value:.1f} kg ({m.unit})" for m, _ in pairs)
            found = f"a mass of {mass:.4g} kg with a height of {height:.3g} m"
            expected = f"a mass of people: {may_be}" if may_be else "a mass of people"
            findings.append(_unused(found, expected))
            masses = ()
    for readings, quantity in ((masses, MASS), (heights, HEIGHT)):
        if len(readings) > 1:
            may_be = " or ".join(f"{r.value:.4g} {quantity.unit} ({r.unit})" for r in readings)
            findings.append(_unused(f"{quantity.column} that may be {may_be}", "a unit"))
    kg, m = (r[0].value if len(r) == 1 else None for r in (masses, heights))
    return kg, m


def _of_people(
    masses: Iterable[Reading], heights: Sequence[Reading]
) -> list[tuple[Reading, Reading]]:
    return [(m, h) for m in masses for h in heights if is_usual_pair(m.value, h.value)]


def _in_all_units(masses: Sequence[Reading]) -> Sequence[Reading]:
    """A mass in the unit it was taken for, and in those it may be in."""
    if len(masses) > 1:
        return masses
    (stated,) = masses
    number = stated.value / MASS.units[stated.unit]
    found = [Reading(number * MASS.units[u], u, u == stated.unit) for u in MASS.guessed]
    return [one for one in found if MASS.holds(one.value)]


def _differ(values: Iterable[float]) -> bool:
    known = list(values)
    return max(known) - min(known) > _SAME * max(known)


def _unused(found: str, expected: str) -> Finding:
    return Finding("stated_person", "", found, expected, "used none of it", "warning")
