"""What people write for a sex, in the languages of this field."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from typing import Literal

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


def sex_of(cell: str, legend: Mapping[str, Sex], beside: Collection[str] = ()) -> Sex | None:
    """The sex that a cell means; "other" where it says n/a or nothing; None if it cannot be known.

    legend : what the codes of the table mean, as header or participants.json say.
    beside : the column's cells in small letters: beside H (hombre, homme) an M may be mujer.
    """
    word = re.sub(r"^(\d+)[.,]0+$", r"\1", cell.strip())  # 1.0, as tables of numbers keep a 1
    if (known := legend.get(word) or legend.get(word.casefold())) is not None:
        return known
    meant = word.casefold().rstrip(".")
    if meant == "m" and "h" in beside:
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
