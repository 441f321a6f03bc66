"""What a C3D file says of the person: mass, height and sex, where programs write them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from bsip_cli.recordings.c3d_parameters import Group, Parameters, texts
from bsip_cli.recordings.model import Finding, StatedPerson
from bsip_cli.stated.quantities import HEIGHT, MASS, Quantity, Reading, is_usual_pair, readings_of
from bsip_cli.stated.sex_words import COLUMN_NAMES, sex_of

_GROUPS = ("PROCESSING", "PATIENT", "PARTICIPANT", "ANTHROPOMETRY", "SUBJECT")
_SAME = 0.005  # relative: programs round


def stated_person(parameters: Parameters) -> tuple[StatedPerson, tuple[Finding, ...]]:
    """Mass [kg], height [m] and sex as the groups of the subject state them; zeros state nothing.

    Vicon writes PROCESSING:Bodymass in kg and Height in mm, others SUBJECT:WEIGHT, SUBJECTS:MASS,
    with any unit: the one that is stated beside it or that alone makes a person. What contradicts
    itself, belongs to several people or may be either unit is not used, and that is said.
    """
    findings: list[Finding] = []
    said = {q.column: list(_stated(parameters, q)) for q in (MASS, HEIGHT)}
    masses, heights = (_one(said[q.column], q, findings) for q in (MASS, HEIGHT))
    mass, height = _pair(masses, heights, findings)
    person = StatedPerson(mass, height, _sex(parameters, findings), _name(parameters))
    if words := person.words():
        action = "used where participants.tsv says n/a"
        findings.append(Finding("stated_person", "", words, "", action, "info"))
    return person, tuple(findings)


def together(people: Mapping[str, StatedPerson]) -> tuple[StatedPerson, tuple[str, ...]]:
    """What all files of one person say, by name of the file; and where they contradict each other.

    A value on which they do not agree is not used.
    """
    notes: list[str] = []

    def agreed(what: str, unit: str) -> float | None:
        values = {n: v for n, p in people.items() if (v := getattr(p, what)) is not None}
        if not values:
            return None
        if _differ(values.values()):
            of = ", ".join(f"{value:.4g} {unit} in {name}" for name, value in values.items())
            notes.append(f"its files state different {what.rpartition('_')[0]}es: {of}; none used")
            return None
        return next(iter(values.values()))

    mass, height = agreed("mass_kg", "kg"), agreed("height_m", "m")
    sexes = {name: person.sex for name, person in people.items() if person.sex}
    if len(set(sexes.values())) > 1:
        notes.append(f"its files state different sexes: {sexes}; none used")
    sex = next(iter(sexes.values())) if len(set(sexes.values())) == 1 else ""
    return StatedPerson(mass, height, sex), tuple(notes)


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


def _groups(parameters: Parameters) -> Iterator[tuple[str, Group]]:
    for name, group in parameters.items():
        if name.strip().upper().startswith(_GROUPS):
            yield name, group


def _named(group: Group, names: str) -> Iterator[str]:
    for parameter in group:
        if parameter.casefold().replace("_", "").replace(" ", "") in names.split():
            yield parameter


def _stated(
    parameters: Parameters, quantity: Quantity
) -> Iterator[tuple[str, tuple[Reading, ...]]]:
    """Where a quantity is stated, and what each value may be."""
    for name, group in _groups(parameters):
        for parameter in _named(group, quantity.names):
            beside = [p for p in group if p.casefold() in _units_of(parameter)]
            spelt = [quantity.unit_spelt(text) for p in beside for text in texts(group, p)]
            unit = next(filter(None, spelt), "")
            for value in _values(group[parameter]):
                if readings := readings_of(value, quantity, unit):
                    yield f"{name}:{parameter} = {value}", readings


def _units_of(parameter: str) -> tuple[str, ...]:
    """The names of the parameters that may state its unit."""
    return tuple(f"{parameter.casefold()}{ending}" for ending in ("_units", "_unit"))


def _values(value: tuple[str, ...] | np.ndarray) -> list[str]:
    """As texts; single precision without its noise."""
    if isinstance(value, tuple):
        return [text.strip() for text in value if text.strip()]
    return [f"{one:.6g}" for one in np.ravel(value).astype(float) if np.isfinite(one) and one]


def _one(
    said: list[tuple[str, tuple[Reading, ...]]], quantity: Quantity, findings: list[Finding]
) -> tuple[Reading, ...]:
    """The readings that all places share; nothing where they contradict each other."""
    if not said:
        return ()
    if _differ(readings[0].value for _, readings in said):
        found = ", ".join(place for place, _ in said)
        findings.append(_unused(found, f"one {quantity.column}"))
        return ()
    return said[0][1]


def _pair(
    masses: tuple[Reading, ...], heights: tuple[Reading, ...], findings: list[Finding]
) -> tuple[float | None, float | None]:
    """Mass and height in the units with which they make a person; None for what stays open."""
    if masses and heights:
        every = _all_units(masses, MASS)
        pairs = _of_people(masses, heights) or _of_people(every, heights)
        heights = tuple(dict.fromkeys(h for _, h in pairs)) or heights
        if len(masses) > 1:
            masses = tuple(dict.fromkeys(m for m, _ in pairs)) or masses
        if len(masses) == len(heights) == 1 and not is_usual_pair(
            masses[0].value, heights[0].value
        ):
            may_be = " or ".join(f"{m.value:.1f} kg ({m.unit})" for m, _ in pairs)
            found = (
                f"a mass of {masses[0].value:.4g} kg beside a height of {heights[0].value:.3g} m"
            )
            expected = f"a mass of people: {may_be}" if may_be else "a mass of people"
            findings.append(_unused(found, expected))
            masses = ()
    for readings, quantity in ((masses, MASS), (heights, HEIGHT)):
        if len(readings) > 1:
            may_be = " or ".join(f"{r.value:.4g} {quantity.unit} ({r.unit})" for r in readings)
            findings.append(_unused(f"{quantity.column} that may be {may_be}", "a unit"))
    mass, height = (r[0].value if len(r) == 1 else None for r in (masses, heights))
    return mass, height


def _of_people(
    masses: Iterable[Reading], heights: Sequence[Reading]
) -> list[tuple[Reading, Reading]]:
    return [(m, h) for m in masses for h in heights if is_usual_pair(m.value, h.value)]


def _all_units(masses: tuple[Reading, ...], quantity: Quantity) -> list[Reading]:
    """A mass in the unit it was taken for, and in those it may be in."""
    if len(masses) > 1:
        return list(masses)
    number = masses[0].value / quantity.units[masses[0].unit]
    values = {unit: number * quantity.units[unit] for unit in quantity.guessed}
    return [
        Reading(value, unit, unit == masses[0].unit)
        for unit, value in values.items()
        if quantity.holds(value)
    ]


def _sex(parameters: Parameters, findings: list[Finding]) -> str:
    said = {
        value
        for _, group in _groups(parameters)
        for parameter in _named(group, COLUMN_NAMES)
        for value in texts(group, parameter)
        if value.strip()
    }
    sexes = {sex for value in said if (sex := sex_of(value, {})) is not None}
    if len(sexes) > 1:
        findings.append(_unused(f"sexes {', '.join(sorted(said))}", "one"))
    return sexes.pop() if len(sexes) == 1 else ""


def _name(parameters: Parameters) -> str:
    """The subject's, where the file names one alone."""
    said = {
        text.strip()
        for _, group in _groups(parameters)
        for parameter in _named(group, "name names")
        for text in texts(group, parameter)
        if text.strip()
    }
    return said.pop() if len(said) == 1 else ""


def _differ(values: Iterable[float]) -> bool:
    known = list(values)
    return max(known) - min(known) > _SAME * max(known)


def _unused(found: str, expected: str) -> Finding:
    return Finding("stated_person", "", found, expected, "used none of it", "warning")
