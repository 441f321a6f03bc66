"""What is stated of a person: masses, heights and sexes in the words and units that people use."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal

from bsip_cli.files.regular import read_toml, shipped

BMI_KG_M2 = (12.0, 60.0)
"""Body-mass indices of people: survival ends at 11 to 13 (Henry 1990, Eur J Clin Nutr 44), healthy
children go down to 12.9 (WHO 2007, third percentile); beyond 60 begins the last class that surgery
has a name for."""
USUAL_BMI_KG_M2 = (12.0, 40.0)
"""Those that show which unit is meant where none is stated; obesity of class III begins at 40."""


@dataclass(frozen=True)
class Quantity:
    """A mass or a height, as configs/people_words.toml has it; ``unit`` is that of SI."""

    column: str
    names: str
    example: str
    low: float
    high: float
    units: dict[str, float]
    guessed: tuple[str, ...]
    slips: tuple[str, ...]
    guessed_low: float = 0.0

    @property
    def unit(self) -> str:
        return self.column.rpartition("_")[2]

    def holds(self, value: float) -> bool:
        return self.low <= value <= self.high

    def unit_spelt(self, text: str) -> str:
        """A unit as people spell it; empty where it is none of this quantity."""
        unit = _SPELT.get(text.strip().casefold().rstrip("."), "")
        return unit if unit in self.units else ""


_WORDS = read_toml(shipped("people_words.toml"))


def _quantity(column: str) -> Quantity:
    said = dict(_WORDS[column])
    lists: Any = {name: tuple(said.pop(name).split()) for name in ("guessed", "slips")}
    return Quantity(column, **said, **lists)


MASS, HEIGHT = _quantity("mass_kg"), _quantity("height_m")
_DIGITS = 6  # of a kg or m: 163 cm are 1.63 m
_SPELT = {one: unit for unit, line in _WORDS["units"].items() for one in line.split()}
# The unit of a second number that has none, as in 5'4, and how many make the first one.
_BELOW = {"ft": ("in", 12), "st": ("lb", 14), "m": ("cm", 100)}
_QUOTES = str.maketrans("‘’′´`“”″", "'''''\"\"\"")
_NUMBER = r"[-+]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:e[-+]?\d+)?"
_WITH_POINT = re.compile(r"\s*(\d+)[.,](\d{1,2})(?!\d)")
_DECIMAL = re.compile(r"\s*\d+[.,]\d*[1-9]")
_PART = re.compile(rf"\s*({_NUMBER})\s*((?:[^\W\d_]+|''|['\"])?)\.?", re.IGNORECASE)


@dataclass(frozen=True)
class Reading:
    """A number taken in a unit, in SI; ``is_stated``: nobody had to guess."""

    value: float
    unit: str
    is_stated: bool


def readings_of(
    text: str, quantity: Quantity, unit: str = "", column: Collection[str] = ()
) -> tuple[Reading, ...]:
    """What a cell may mean, within what people have; nothing if it is no number of this kind.

    ``unit`` is the column's; the one of the cell goes before it. A value that can be in the stated
    unit (SI, where none is) has this reading alone, unless 5.11 ft may be 5 ft 11 in: another cell
    of the ``column``, as 5.75, shows that it is not.
    """
    text, stated = text.translate(_QUOTES), unit or quantity.unit
    parts = _parts(text)
    is_spelt = any(spelt for _, spelt in parts)
    if is_spelt:
        whole, stated = _sum(parts, quantity), _SPELT.get(parts[0][1].casefold(), "")
        first = [] if whole is None else [(whole, stated if len(parts) == 1 else quantity.unit)]
    elif len(parts) == 1:
        first = [(parts[0][0] * quantity.units[stated], stated)]
    else:
        return ()
    if found := _within(quantity, first, True):
        decimals = filter(_DECIMAL.match, column)
        is_one = len(parts) > 1 or any(not _as_two(one, stated, quantity) for one in decimals)
        return found + _within(quantity, [] if is_one else _as_two(text, stated, quantity), False)
    if is_spelt:
        return ()
    number = parts[0][0]
    others = quantity.guessed if not unit else quantity.slips if unit in quantity.slips else ()
    guessed = ((number * quantity.units[u], u) for u in others)
    likely = [one for one in guessed if one[0] >= quantity.guessed_low]
    return _within(quantity, likely, False)


def _within(
    quantity: Quantity, values: Iterable[tuple[float, str]], is_stated: bool
) -> tuple[Reading, ...]:
    near = ((round(value, _DIGITS), unit) for value, unit in values if quantity.holds(value))
    return tuple(Reading(value, unit, is_stated) for value, unit in near)


def _as_two(text: str, unit: str, quantity: Quantity) -> list[tuple[float, str]]:
    """What 5.11 in feet or stones is [SI] if the point stands between two units; 5.1 may be 5.10
    of a spreadsheet."""
    match, (below, many) = _WITH_POINT.match(text), _BELOW.get(unit, ("", 0))
    if match is None or below not in quantity.units or unit == quantity.unit:
        return []
    first, numbers = int(match[1]) * quantity.units[unit], {match[2], match[2].ljust(2, "0")}
    return [
        (first + n * quantity.units[below], f"{unit} and {below}")
        for n in sorted(map(int, numbers))
        if 0 < n < many
    ]


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
        units[-1] = _BELOW.get(units[-2], ("", 0))[0]
        if units[-1] == "cm" and parts[-1][0] < 10:  # 1m6 is 1.6 m to some
            return None
    if any(unit not in quantity.units for unit in units):
        return None
    if any(_BELOW.get(one, ("", 0))[0] != other for one, other in pairwise(units)):
        return None
    if any(n >= _BELOW[unit][1] for (n, _), unit in zip(parts[1:], units, strict=False)):
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


_LANGUAGES = [one.get("titles", "").split() for one in _WORDS["sex"]["languages"]]
COLUMN_NAMES = " ".join(dict.fromkeys(title for titles in _LANGUAGES for title in titles))
_OTHER_LETTERS = "o u"  # unless they begin a word of the column's language

_Pair = dict[str, Sex]


def _pair(words: str) -> _Pair:
    """What each word means, also without accents, where that leaves a word."""
    sexes: tuple[Sex, ...] = ("F", "M", OTHER)
    pair = dict(zip(words.split(), sexes, strict=False))
    for word, sex in [*pair.items()]:
        letters = unicodedata.normalize("NFKD", word)
        bare = "".join(c for c in letters if not unicodedata.combining(c))
        pair |= {bare: sex} if len(bare) > 2 else {}
    return pair


_PAIRS = [
    (k, _pair(words))
    for k, language in enumerate(_WORDS["sex"]["languages"])
    for words in language["pairs"].split(",")
]
_SEX_OF: dict[str, Sex] = {w: s for _, p in _PAIRS for w, s in p.items() if len(w) > 1 or w > "z"}
_SEX_OF |= dict.fromkeys(("", *_WORDS["sex"]["others"].split()), OTHER)
_SEX_OF |= dict.fromkeys(_WORDS["sex"]["female"].split(), "F")
_CODE = re.compile(r"([\w?-]+)\s*[=:]\s*([\w/?-]+)")


def sex_of(
    cell: str, legend: Mapping[str, Sex], column: Collection[str] = (), title: str = "sex"
) -> Sex | None:
    """The sex that a cell means; "other" where it says n/a or nothing; None if it cannot be known.

    A word means itself. The beginning of one, such as M or F, means what it does in the language of
    its column: in the title's, where that understands all cells, else in every one that does.

    legend : what the codes of the table mean, as header or participants.json say.
    column : all cells.
    """
    codes = {code.casefold(): sex for code, sex in legend.items()}
    meant, *others = (_cell(text) for text in (cell, *column))
    if (known := codes.get(meant, _SEX_OF.get(meant))) is not None:
        return known
    cells = {meant, *others} - {*codes}
    found = {_meaning(meant, pair) for pair in _spoken(cells, title)}
    return found.pop() if len(found) == 1 else None


def _cell(text: str) -> str:
    word = re.sub(r"^(\d+)[.,]0+$", r"\1", text.strip())  # 1.0, as tables of numbers keep a 1
    return word.casefold().rstrip(".")


def _meaning(cell: str, pair: _Pair) -> Sex | None:
    """Of the beginning of a word; None where the pair does not have it, or both words begin so."""
    found = {sex for word, sex in pair.items() if word.startswith(cell)}
    if not found and cell in _OTHER_LETTERS.split():
        return OTHER
    return found.pop() if len(found) == 1 else None


def _spoken(cells: Collection[str], title: str) -> list[_Pair]:
    """The pairs of words that may stand behind a column's cells, in small letters.

    Each understands all cells that are no words, and its language has all words; in a column of
    several languages, one of them at least. Hombre shows that M is mujer: those go before the
    others that have words to which a cell may be the other one. What begins no word of any, as 2 or
    X, is a mistake of its own.
    """
    words = {cell for cell in cells if _SEX_OF.get(cell, OTHER) != OTHER}
    begun = {cell for cell in cells if cell not in _SEX_OF}
    begun = {cell for cell in begun if any(_meaning(cell, pair) for _, pair in _PAIRS)}
    known = {k: words & {w for i, pair in _PAIRS if i == k for w in pair} for k, _ in _PAIRS}
    speaking = [k for k, its in known.items() if its == words]
    speaking = speaking or [k for k, its in known.items() if its]
    of_title = [k for k in speaking if known[k] == words and title.casefold() in _LANGUAGES[k]]

    def understanding(languages: Collection[int]) -> list[_Pair]:
        spoken = [pair for k, pair in _PAIRS if k in languages]
        return [pair for pair in spoken if all(_meaning(cell, pair) for cell in begun)]

    pairs = understanding(of_title) or understanding(speaking)
    alone = {word for word in words if not word.startswith(tuple(begun))}
    shown = [len(alone & {*pair}) for pair in pairs]
    return [pair for pair, n in zip(pairs, shown, strict=True) if n == max(shown)]


def legend_in(text: str) -> dict[str, Sex]:
    """Codes and their meaning in a text like ``0=F, 1=M`` or ``female: 2, male: 1``."""
    return legend_of(dict(_CODE.findall(text)))


def legend_of(pairs: Mapping[str, str]) -> dict[str, Sex]:
    """What codes mean, whichever of code and word stands first."""
    for codes, texts in ((pairs.keys(), pairs.values()), (pairs.values(), pairs.keys())):
        named = {
            code.strip(): sex
            for code, text in zip(codes, texts, strict=True)
            if (sex := _sex_in(text, [*texts])) is not None
        }
        if named:
            return named
    return {}


def _sex_in(text: str, texts: Collection[str]) -> Sex | None:
    """The one sex that a text names: as a cell among others, or by its only word of those known."""
    found = {_SEX_OF[w] for w in re.findall(r"\w+", text.casefold()) if w in _SEX_OF}
    return found.pop() if len(found) == 1 else sex_of(text, {}, texts)
