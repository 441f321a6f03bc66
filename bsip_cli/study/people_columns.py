"""Which column of a table of people is which, and what header and participants.json say of it."""

from __future__ import annotations

import difflib
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from bsip_cli.files.regular import fault_of
from bsip_cli.stated.quantities import HEIGHT, MASS
from bsip_cli.stated.sex_words import COLUMN_NAMES, Sex, legend_in, legend_of

REQUIRED = ("participant_id", "sex", "mass_kg")
KNOWN = (*REQUIRED, "height_m")

_IDS = (
    "participantid participant participantcode subjectid subject subjectcode subjid subj id code "
    "patientid patient proband probandid probandenid probandennummer probandennr vp vpn sujet "
    "sujeto soggetto paziente paciente"
)
_QUANTITIES = {quantity.column: quantity for quantity in (MASS, HEIGHT)}
_COLUMN_OF = {
    **dict.fromkeys(_IDS.split(), "participant_id"),
    **dict.fromkeys(COLUMN_NAMES.split(), "sex"),
    **{name: column for column, one in _QUANTITIES.items() for name in one.names.split()},
}
_BRACKETS = re.compile(r"[\(\[]([^\)\]]*)[\)\]]?")
_LARGEST_JSON = 1_000_000  # bytes


@dataclass(frozen=True)
class Column:
    """One column that is understood.

    ``name`` is the contract's, ``title`` the table's; ``unit`` is empty where none is stated;
    ``legend`` says what codes of sexes mean.
    """

    index: int
    name: str
    title: str
    unit: str = ""
    legend: Mapping[str, Sex] = field(default_factory=dict)


@dataclass(frozen=True)
class Columns:
    """Columns by their names in the contract, and what is wrong with the header."""

    known: Mapping[str, Column]
    faults: tuple[str, ...]


def count_known(header: Sequence[str]) -> int:
    """How many of the contract's columns are among some titles."""
    return len({column.name for k, title in enumerate(header) if (column := _column(k, title))})


def columns_of(header: Sequence[str]) -> Columns:
    """The columns of a table by its titles; those that are not understood are nobody's business."""
    faults, known = [], {}
    found = [column for k, title in enumerate(header) if (column := _column(k, title))]
    for name in KNOWN:
        own = [column for column in found if column.name == name]
        exact = [column for column in own if column.title == name]
        if len(own) > 1 and len(exact) != 1:
            faults.append(
                f"has {len(own)} columns of one meaning, {_listed(own)}, and none is {name}"
            )
        elif own:
            known[name] = (exact or own)[0]
            if "?" in known[name].unit:
                faults.append(f"has a column {known[name].title!r}, whose unit is not known")
    others = [t for k, t in enumerate(header) if k not in {c.index for c in found}]
    near = _misspelt(others, [name for name in KNOWN if name not in known])
    faults += [f"has a column {title!r} and no {name}" for title, name in near]
    lacking = [n for n in REQUIRED if n not in {*known, *(c.name for c in found)}]
    if lost := [name for name in lacking if name not in {name for _, name in near}]:
        faults.append(f"has no column {', '.join(lost)}")
    return Columns(known, tuple(faults))


def _column(index: int, title: str) -> Column | None:
    """What a title means: a name, with its unit behind it or in brackets; None if nothing."""
    brackets = [text.strip() for text in _BRACKETS.findall(title)]
    legend = legend_in(title)
    words = re.findall(r"[^\W_]+", _BRACKETS.sub(" ", title.casefold()))
    if legend and not brackets:  # sex 0=F 1=M
        words = words[:1]
    name, unit = _COLUMN_OF.get("".join(words)), ""
    if name is None and (name := _COLUMN_OF.get("".join(words[:-1]))) in _QUANTITIES:
        unit = _QUANTITIES[name].unit_spelt(words[-1])
        name = name if unit else None
    if name in _QUANTITIES and brackets:
        units = [_QUANTITIES[name].unit_spelt(text) for text in brackets]
        unit = next(filter(None, units), "?")
    elif name is None or (name not in _QUANTITIES and "".join(words) not in _COLUMN_OF):
        return None
    return Column(index, name, title.strip(), unit, legend if name == "sex" else {})


def _listed(columns: Sequence[Column]) -> str:
    return ", ".join(repr(column.title) for column in columns)


def _misspelt(titles: Sequence[str], lacking: Sequence[str]) -> list[tuple[str, str]]:
    """Titles that are cut or slightly other than a name that is lacking, and that name."""
    found = []
    for title in (title.strip().lower() for title in titles):
        cut = [name for name in lacking if len(title) >= 3 and name.startswith(title)]
        near = cut or difflib.get_close_matches(title, lacking, n=1, cutoff=0.75)
        found += [(title, near[0])] if near else []
    return found


# --- participants.json ----------------------------------------------------------------------------


def with_sidecar(columns: Columns, file: Path) -> tuple[Columns, list[str]]:
    """With legend and units of the JSON that BIDS puts beside the table; and what is to be said.

    A legend in the table's own header goes before it.
    """
    if not file.exists():
        return columns, []
    try:
        if fault := fault_of(file):
            raise ValueError(fault)
        if file.stat().st_size > _LARGEST_JSON:
            raise ValueError(f"larger than {_LARGEST_JSON / 1e6:g} MB")
        said = json.loads(file.read_text(encoding="utf-8-sig"))
        if not isinstance(said, dict):
            raise ValueError("no object of columns")
    except (OSError, ValueError, RecursionError) as error:
        return columns, [f"{file}: is not used: {error}"]
    known, faults = dict(columns.known), list(columns.faults)
    for name, column in known.items():
        about = said.get(column.title, said.get(name))
        if not isinstance(about, dict):
            continue
        if name == "sex" and not column.legend and isinstance(levels := about.get("Levels"), dict):
            known[name] = replace(column, legend=legend_of(_plain(levels)))
        if name in _QUANTITIES and isinstance(text := about.get("Units"), str):
            unit = _QUANTITIES[name].unit_spelt(text)
            if column.unit and unit not in ("", column.unit):
                faults.append(
                    f"and {file.name} do not agree: the unit of {column.title!r} is {text!r} there"
                )
            if not column.unit and not unit:
                faults.append(f"has a column {column.title!r}, whose unit {text!r} is not known")
            known[name] = replace(column, unit=column.unit or unit)
    return Columns(known, tuple(faults)), []


def _plain(levels: Mapping) -> dict[str, str]:
    """Levels as texts, also where BIDS allows an object with a description."""
    return {
        str(code): str(text.get("Description", "") if isinstance(text, dict) else text)
        for code, text in levels.items()
    }
