"""What is stated of a person: masses, heights and sexes in the words and units that people use."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

BMI_KG_M2 = (12.0, 60.0)
"""Body-mass indices of people: survival ends at 11 to 13 (Henry 1990, Eur J Clin Nutr 44), healthy
children go down to 12.9 (WHO 2007, third percentile); beyond 60 begins the last class that surgery
has a name for."""
USUAL_BMI_KG_M2 = (12.0, 40.0)
"""Those that show which unit is meant where none is stated; obesity of class III begins at 40."""


@dataclass(frozen=True)
class Quantity:
    """A mass or a height: its column, the limits [SI] of what people have, and units [SI].

    ``names`` are what people call it, in small letters and without blanks.
    ``guessed`` are units that are looked for where none is stated, ``slips`` those that are looked
    for where the stated one cannot be; what they make below ``guessed_low`` is not meant.
    """

    column: str
    unit: str
    low: float
    high: float
    units: dict[str, float]
    guessed: tuple[str, ...]
    slips: tuple[str, ...]
    names: str
    guessed_low: float = 0.0

    def holds(self, value: float) -> bool:
        return self.low <= value <= self.high

    def unit_spelt(self, text: str) -> str:
        """A unit as people spell it; empty where it is none of this quantity."""
        unit = _SPELT.get(text.strip().casefold().rstrip("."), "")
        return unit if unit in self.units else ""


MASS = Quantity(
    "mass_kg",
    "kg",
    10.0,
    400.0,
    {"kg": 1.0, "g": 1e-3, "lb": 0.45359237, "st": 6.35029318, "N": 1 / 9.80665},
    ("kg", "g", "lb", "st", "N"),
    ("kg", "g"),
    "mass weight bodymass bodyweight masse gewicht körpergewicht koerpergewicht körpermasse "
    "koerpermasse poids peso massa massecorporelle",
)
HEIGHT = Quantity(
    "height_m",
    "m",
    0.5,
    2.6,
    {"m": 1.0, "cm": 0.01, "mm": 1e-3, "in": 0.0254, "ft": 0.3048},
    ("m", "cm", "mm", "in"),  # 5.4 may be feet or 5 ft 4 in
    ("m", "cm", "mm", "in"),
    "height stature bodyheight grösse größe groesse körpergrösse körpergröße koerpergroesse "
    "taille talla altura estatura altezza statura",
    0.75,  # the median at one year (WHO 2006), before which children do not walk: 66 are inches
)
_SPELLINGS = {
    "kg": "kg kgs kilo kilos kilogram kilograms kilogramm",
    "g": "g gram grams gramm",
    "lb": "lb lbs pound pounds",
    "st": "st stone stones",
    "N": "n newton newtons",
    "m": "m metre metres meter meters mètre metro metros",
    "cm": "cm centimetre centimetres centimeter centimeters zentimeter",
    "mm": "mm millimetre millimetres millimeter millimeters",
    "in": "in inch inches \" ''",
    "ft": "ft foot feet '",
}
_DIGITS = 6  # of a kg or m: 163 cm are 1.63 m
_SPELT = {spelling: unit for unit, line in _SPELLINGS.items() for spelling in line.split()}
_BELOW = {"ft": "in", "st": "lb"}  # the unit of a second number that has none, as in 5'4
_NUMBER = r"[-+]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:e[-+]?\d+)?"
_PART = re.compile(rf"\s*({_NUMBER})\s*((?:[^\W\d_]+|''|['\"])?)\.?", re.IGNORECASE)


@dataclass(frozen=True)
class Reading:
    """A number taken in a unit, in SI; ``is_stated``: nobody had to guess."""

    value: float
    unit: str
    is_stated: bool


def readings_of(text: str, quantity: Quantity, unit: str = "") -> tuple[Reading, ...]:
    """What a cell may mean, within what people have; nothing if it is no number of this kind.

    ``unit`` is the column's; the one of the cell goes before it. A value that can be in the stated
    unit (SI, where none is) has this reading alone.
    """
    parts = _parts(text)
    if any(spelt for _, spelt in parts):
        whole = _sum(parts, quantity)
        return () if whole is None else _within(quantity, [(whole, quantity.unit)], True)
    if len(parts) != 1:
        return ()
    number, stated = parts[0][0], unit or quantity.unit
    if first := _within(quantity, [(number * quantity.units[stated], stated)], True):
        return first
    others = quantity.guessed if not unit else quantity.slips if unit in quantity.slips else ()
    guessed = ((number * quantity.units[u], u) for u in others)
    likely = [one for one in guessed if one[0] >= quantity.guessed_low]
    return _within(quantity, likely, False)


def _within(quantity: Quantity, values, is_stated: bool) -> tuple[Reading, ...]:
    near = ((round(value, _DIGITS), unit) for value, unit in values if quantity.holds(value))
    return tuple(Reading(value, unit, is_stated) for value, unit in near)


def _parts(text: str) -> list[tuple[float, str]]:
    """Numbers with the units behind them; nothing where there is anything else."""
    parts, at = [], 0
    text = text.strip()
    while at < len(text):
        match = _PART.match(text, at)
        if match is None:
            return []
        parts.append((float(match[1].replace(",", ".")), match[2]))
        at = match.end()
    return parts


def _sum(parts: list[tuple[float, str]], quantity: Quantity) -> float | None:
    """A number with its unit, or two as in 5 ft 4 in [SI]; None where units are not understood."""
    units = [_SPELT.get(spelt.casefold(), "") for _, spelt in parts]
    if len(parts) > 1 and not parts[-1][1]:
        units[-1] = _BELOW.get(units[-2], "")
    if any(unit not in quantity.units for unit in units):
        return None
    if any(_BELOW.get(one) != other for one, other in pairwise(units)):
        return None
    return sum(n * quantity.units[u] for (n, _), u in zip(parts, units, strict=True))


def percent_apart(one: float, other: float) -> float:
    """By how much the larger of two sizes is larger; infinite where one is nothing."""
    ratio = one / other if one > 0 else float("inf")
    return 100.0 * (max(ratio, 1.0 / ratio) - 1.0)


def is_usual_pair(mass_kg: float, height_m: float) -> bool:
    """Whether a unit may be recognised by this body-mass index."""
    return USUAL_BMI_KG_M2[0] <= mass_kg / height_m**2 <= USUAL_BMI_KG_M2[1]


def odd_pair(mass_kg: float | None, height_m: float | None) -> str:
    """What to say of a mass and a height that hardly belong to one person; empty if they do."""
    if mass_kg is None or height_m is None:
        return ""
    if BMI_KG_M2[0] <= mass_kg / height_m**2 <= BMI_KG_M2[1]:
        return ""
    likely = [
        f"in {unit} the mass would be {value:.1f} kg and the index {value / height_m**2:.1f}"
        for unit in MASS.guessed
        if unit != "kg"
        and MASS.holds(value := mass_kg * MASS.units[unit])
        and is_usual_pair(value, height_m)
    ]
    return (
        f"{mass_kg:.4g} kg and {height_m:.4g} m are a body-mass index of "
        f"{mass_kg / height_m**2:.1f} kg/m2, people have {BMI_KG_M2[0]:g} to {BMI_KG_M2[1]:g}"
        + "".join(f"; {one}" for one in likely)
        + ": used as it stands, check both"
    )


# --- what people write for a sex, in the languages of this field ----------------------------------

Sex = Literal["M", "F", "other"]
OTHER: Sex = "other"
"""A sex that the tables do not know, or that is not stated: the mean of both tables."""

Row = tuple[float, ...]


def with_other(rows: Mapping[str, Row]) -> dict[str, Row]:
    """A table by sex, with the mean of both rows for others."""
    mean = tuple((m + f) / 2 for m, f in zip(rows["M"], rows["F"], strict=True))
    return {**rows, OTHER: mean}


COLUMN_NAMES = "sex gender sexe sexo sesso geschlecht genre genero género"

_WORDS: dict[Sex, str] = {
    "F": "f female females fem woman women girl w weiblich weibl frau mädchen maedchen femme "
    "féminin feminin féminine fille mujer femenino femenina hembra femmina femminile donna "
    "feminino feminina mulher vrouw vrouwelijk kvinna kvinde kvinne nainen kobieta жен женский "
    "女 女性",
    "M": "m male males masc man men boy h männlich maennlich männl mann herr homme masculin "
    "garçon hombre masculino varón varon maschio maschile uomo homem mannelijk manlig mies "
    "mężczyzna муж мужской 男 男性",
    "other": "o other n/a na none unknown divers diverse nonbinary non-binary intersex autre "
    "andere otro altro outro ? -",
}
_SEX_OF: dict[str, Sex] = {word: sex for sex, words in _WORDS.items() for word in words.split()}
_PAIR = re.compile(r"([\w?-]+)\s*[=:]\s*([\w/?-]+)")


def sex_of(cell: str, legend: Mapping[str, Sex], column: Collection[str] = ()) -> Sex | None:
    """The sex that a cell means; "other" where it says n/a or nothing; None if it cannot be known.

    legend : what the codes of the table mean, as header or participants.json say.
    column : the column's cells in small letters: next to H (hombre, homme) an M may be mujer.
    """
    word = re.sub(r"^(\d+)[.,]0+$", r"\1", cell.strip())  # 1.0, as tables of numbers keep a 1
    if (known := legend.get(word) or legend.get(word.casefold())) is not None:
        return known
    meant = word.casefold().rstrip(".")
    if meant == "m" and "h" in column:
        return None
    return _SEX_OF.get(meant) if meant else "other"


def legend_in(text: str) -> dict[str, Sex]:
    """Codes and their meaning in a text like ``0=F, 1=M`` or ``female: 2, male: 1``."""
    return legend_of(dict(_PAIR.findall(text)))


def legend_of(pairs: Mapping[str, str]) -> dict[str, Sex]:
    """What codes mean, whichever of code and word stands first."""
    legend: dict[str, Sex] = {}
    for one, other in pairs.items():
        if (sex := _sex_in(other)) is not None:
            legend[one.strip()] = sex
        elif (sex := _sex_in(one)) is not None:
            legend[other.strip()] = sex
    return legend


def _sex_in(text: str) -> Sex | None:
    """The one sex that a text names: its only word of those known."""
    words = (text, *re.findall(r"\w+", text))
    found = {_SEX_OF[word] for w in words if (word := w.strip().casefold()) in _SEX_OF}
    return found.pop() if len(found) == 1 else None
