"""The rows of participants.tsv: who is in a study, and what is known of them."""

from __future__ import annotations

import difflib
import json
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from pathlib import Path

from bsip_cli.errors import BadDataError, UsageError
from bsip_cli.files.regular import fault_of, is_folder, read_text_table
from bsip_cli.stated import (
    COLUMN_NAMES,
    HEIGHT,
    MASS,
    Quantity,
    Reading,
    Sex,
    is_usual_pair,
    legend_in,
    legend_of,
    odd_pair,
    readings_of,
    sex_of,
)
from bsip_cli.study.trials import MANY, Trial

# --- which column of participants.tsv is which, and what header and participants.json say of it ---


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


def columns_in(header: Sequence[str]) -> list[Column]:
    """All columns that are understood; the others are ignored."""
    return [column for k, title in enumerate(header) if (column := _column(k, title))]


def columns_of(header: Sequence[str]) -> tuple[dict[str, Column], list[str]]:
    """The columns of a table by their names in the contract, and what is wrong with its titles."""
    faults: list[str] = []
    known: dict[str, Column] = {}
    found = columns_in(header)
    for name in KNOWN:
        own = [column for column in found if column.name == name]
        exact = [column for column in own if column.title == name]
        if len(own) > 1 and len(exact) != 1:
            titles = ", ".join(repr(column.title) for column in own)
            faults.append(f"has {len(own)} columns of one meaning, {titles}, and none is {name}")
        elif own:
            known[name] = (exact or own)[0]
            if "?" in known[name].unit:
                faults.append(f"has a column {known[name].title!r}, whose unit is not known")
    others = [t for k, t in enumerate(header) if k not in {c.index for c in found}]
    near = _misspelt(others, [name for name in KNOWN if name not in known])
    faults += [f"has a column {title!r} and no {name}" for title, name in near]
    named = {*known, *(c.name for c in found), *(name for _, name in near)}
    if lost := [name for name in REQUIRED if name not in named]:
        faults.append(f"has no column {', '.join(lost)}")
    return known, faults


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


def _misspelt(titles: Sequence[str], lacking: Sequence[str]) -> list[tuple[str, str]]:
    """Titles that are cut or slightly other than a name that is lacking, and that name."""
    found = []
    for title in (title.strip().lower() for title in titles):
        cut = [name for name in lacking if len(title) >= 3 and name.startswith(title)]
        near = cut or difflib.get_close_matches(title, lacking, n=1, cutoff=0.75)
        found += [(title, near[0])] if near else []
    return found


# --- participants.json ----------------------------------------------------------------------------


def add_sidecar(known: dict[str, Column], faults: list[str], file: Path) -> list[str]:
    """Legend and units of the JSON that BIDS puts next to the table, and what is wrong with them,
    to what its header says; returns what is to be said.

    A legend in the table's own header goes before it.
    """
    if not file.exists():
        return []
    try:
        if fault := fault_of(file):
            raise ValueError(fault)
        if file.stat().st_size > _LARGEST_JSON:
            raise ValueError(f"larger than {_LARGEST_JSON / 1e6:g} MB")
        said = json.loads(file.read_text(encoding="utf-8-sig"))
        if not isinstance(said, dict):
            raise ValueError("no object of columns")
    except (OSError, ValueError, RecursionError) as error:
        return [f"{file}: is not used: {error}"]
    for name, column in known.items():
        about = said.get(column.title, said.get(name))
        if not isinstance(about, dict):
            continue
        if name == "sex" and not column.legend and isinstance(levels := about.get("Levels"), dict):
            plain = {  # texts, also where BIDS allows an object with a description
                str(code): str(text.get("Description", "") if isinstance(text, dict) else text)
                for code, text in levels.items()
            }
            known[name] = replace(column, legend=legend_of(plain))
        if name in _QUANTITIES and isinstance(text := about.get("Units"), str):
            unit = _QUANTITIES[name].unit_spelt(text)
            if column.unit and unit not in ("", column.unit):
                faults.append(
                    f"and {file.name} do not agree: the unit of {column.title!r} is {text!r} there"
                )
            if not column.unit and not unit:
                faults.append(f"has a column {column.title!r}, whose unit {text!r} is not known")
            known[name] = replace(column, unit=column.unit or unit)
    return []


NAME = re.compile(r"sub-[A-Za-z0-9]+")
UNKNOWN = ("", "n/a", "na", "-", "?")


@dataclass(frozen=True)
class Participant:
    """One row of participants.tsv; mass and height are None where the table says n/a.

    ``sex`` is "other" where the table says that, or n/a; ``notes`` say how cells were taken that
    can be taken in several ways.
    """

    id: str
    sex: Sex
    mass_kg: float | None
    height_m: float | None
    trials: tuple[Trial, ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Row:
    """A line of the table: whom it is about, as the folder is named, and its cells."""

    id: str
    cells: tuple[str, ...]


@dataclass(frozen=True)
class PeopleTable:
    """participants.tsv, not yet understood cell by cell; ``notes`` say how it was read."""

    file: Path
    width: int
    separator: str
    columns: Mapping[str, Column]
    rows: tuple[Row, ...]
    notes: tuple[str, ...]

    def cells_of(self, name: str) -> frozenset[str]:
        """All that stands in that column of the contract."""
        k = self.columns[name].index
        return frozenset(row.cells[k] for row in self.rows if k < len(row.cells))


def named_in(study: Path) -> list[str]:
    """Whom a study's participants.tsv names, each once, without names that cannot be."""
    names = (row.id for row in read_people(study / "participants.tsv").rows)
    return [name for name in dict.fromkeys(names) if NAME.fullmatch(name)]


def rows_of(chosen: Sequence[str], table: PeopleTable) -> list[Row]:
    """The rows of some participants, in their order."""
    known: dict[str, list[Row]] = {}
    for row in table.rows:
        known.setdefault(row.id, []).append(row)
    unknown = [name for name in chosen if name not in known]
    if unknown:
        near = [n for name in unknown for n in difflib.get_close_matches(name, known)]
        raise UsageError(
            f"no participant {', '.join(unknown)}",
            file=table.file,
            expected=f"one of {', '.join(known if len(known) < MANY else near or [*known][:MANY])}",
        )
    return [row for name in dict.fromkeys(chosen) for row in known[name]]


def read_people(file: Path) -> PeopleTable:
    """The table's rows and columns; of the cells only who is meant is looked at.

    BadDataError: it cannot be read, is no such table or lacks a column: all faults of its header at
        once.
    """
    table = read_text_table(file, lambda names: len({c.name for c in columns_in(names)}))
    if not table.rows:
        raise _header_fault(file, ["names no participant"])
    known, faults = columns_of(table.header)
    notes = add_sidecar(known, faults, file.with_suffix(".json"))
    if faults:
        raise _header_fault(file, faults)
    index = known["participant_id"].index
    rows, renamed = [], []
    for cells in table.rows:
        written = cells[index] if index < len(cells) else ""
        rows.append(Row(_id_of(written, file.parent), cells))
        if rows[-1].id not in (written, f"sub-{written}"):
            renamed.append(f"{written} is {rows[-1].id}")
    tabs, is_utf = table.separator == "tabs", table.encoding != "cp1252"
    odd = [] if tabs else [f"its cells are separated by {table.separator}"]
    odd += [] if is_utf else ["it is no UTF-8 and was read as Windows-1252 (Latin-1)"]
    notes = [*([f"{file}: {' and '.join(odd)}"] if odd else []), *notes]
    if renamed:
        notes.append(f"{file}: {', '.join(renamed)}, by their folders")
    width, separator = len(table.header), table.separator
    return PeopleTable(file, width, separator, known, tuple(rows), tuple(notes))


def _header_fault(file: Path, faults: Sequence[str]) -> BadDataError:
    return BadDataError(
        "; ".join(faults),
        file=file,
        expected=f"{', '.join(KNOWN)}, separated by tabs",
        remedy="add what is lacking, and give the columns that count these names",
    )


def _id_of(written: str, root: Path) -> str:
    """The folder that a name means, case aside: ``01`` and ``Sub-01`` are sub-01 where that alone
    is there, and so is Excel's 1."""
    for name in (written, f"sub-{written}"):
        if NAME.fullmatch(name) and is_folder(root / name):
            return name
    there = (path.name for path in root.glob("sub-*") if is_folder(path))
    same = [name for name in there if NAME.fullmatch(name) and _bare(name) == _bare(written)]
    return same[0] if len(same) == 1 else written


def _bare(name: str) -> str:
    """Without sub- and leading zeros, in small letters."""
    return name.casefold().removeprefix("sub-").lstrip("0")


def participant_of(row: Row, table: PeopleTable) -> Participant:
    """A row as a participant, still without trials.

    BadDataError: cells cannot be used, or are missing: all of the row are named.
    """
    if not NAME.fullmatch(row.id):
        raise BadDataError(
            f"participant_id {row.id!r}",
            file=table.file,
            expected="sub- and letters or digits",
            remedy="rename the participant and the folder",
        )
    if len(row.cells) != table.width:
        is_split = table.separator == "commas" and len(row.cells) > table.width
        points = "write points for decimal commas"
        raise BadDataError(
            f"the line of {row.id!r} has {len(row.cells)} cells",
            file=table.file,
            expected=f"{table.width}, as many as there are columns",
            remedy=points if is_split else "write n/a where something is unknown",
        )
    cells = {name: row.cells[column.index] for name, column in table.columns.items()}
    written, legend, sexes = cells["sex"], table.columns["sex"].legend, table.cells_of("sex")
    title = re.split(r"[\W_]", table.columns["sex"].title)[0]
    sex = sex_of(written, legend, sexes, title)
    faults = [] if sex else [_sex_fault(written, row.id, sexes)]
    mass, height = (_Found(cells.get(q.column, ""), q, table) for q in (MASS, HEIGHT))
    _decide(mass, height)
    faults += [one.fault(row.id) for one in (mass, height) if one.is_lost]
    if faults:
        found, expected, remedies = zip(*faults, strict=True)
        raise BadDataError(
            "; ".join(found),
            file=table.file,
            expected="; ".join(expected),
            remedy="; ".join(dict.fromkeys(remedies)),
        )
    notes = [f"{table.file}: {note}" for one in (mass, height) for note in one.notes(row.id)]
    if odd := odd_pair(mass.value, height.value):
        notes.append(f"{table.file}: {row.id}: {odd}")
    assert sex is not None
    if sex_of(written, legend, (), title) not in (None, sex):
        taken = {"M": "male", "F": "female"}.get(sex, sex)
        beside = " and ".join(sorted(repr(other) for other in sexes - {written}))
        notes.append(
            f"{table.file}: sex {written} of {row.id} is taken as {taken}, as it is in the "
            f"language of {beside} in that column; write words if it is not"
        )
    return Participant(row.id, sex, mass.value, height.value, notes=tuple(notes))


_Clauses = tuple[str, str, str]
"""What was found, what was expected, what to do."""


def _sex_fault(text: str, name: str, column: Collection[str]) -> _Clauses:
    remedy = (
        "write words in the whole column, as female and male: letters count where one language has "
        "all that stands there, "
    ) + ", ".join(sorted(map(repr, column)))
    if text.strip().isdigit():
        remedy = (
            "write words, or say what the numbers mean, which differs between laboratories: in the "
            'header, as in "sex (0=F, 1=M)", or as Levels in participants.json'
        )
    return f"sex {text!r} of {name}", "M, F, other or n/a", remedy


class _Found:
    """A cell with a mass or a height, and what it may mean."""

    def __init__(self, text: str, quantity: Quantity, table: PeopleTable) -> None:
        column = table.columns.get(quantity.column)
        self.text, self.quantity = text.strip(), quantity
        self.title, self.unit = (column.title, column.unit) if column else (quantity.column, "")
        self.is_known = self.text.casefold() not in UNKNOWN
        self.readings: tuple[Reading, ...] = ()
        if self.is_known:
            others = table.cells_of(column.name) if column else ()
            self.readings = readings_of(self.text, quantity, self.unit, others)
        self.possible = self.readings

    @property
    def is_lost(self) -> bool:
        """Whether something is written there that has no meaning, or several of which none is
        the stated one."""
        said = [one for one in self.readings if one.is_stated]
        return self.is_known and len(said or self.readings) != 1

    @property
    def value(self) -> float | None:
        return self.readings[0].value if self.readings else None

    def notes(self, name: str) -> list[str]:
        taken, unit = self.readings[0] if self.readings else None, self.quantity.unit
        others = [one for one in self.possible if one != taken]
        if taken is None or (taken.is_stated and not others):
            return []
        reason = f"since it cannot be in {self.unit or unit}"
        if any(one.is_stated for one in self.possible):
            also = " or ".join(f"{one.value:.4g} {unit} ({one.unit})" for one in others)
            doubt = "it may also be" if len(self.readings) > 1 else "by the body-mass index not"
            reason = f"{doubt} {also}: write {self.quantity.example}"
        return [
            f"{self.title} {self.text} of {name} is taken as {taken.unit}: {taken.value:.4g} "
            f"{unit}, {reason}"
        ]

    def fault(self, name: str) -> _Clauses:
        q, factor = self.quantity, self.quantity.units[self.unit or self.quantity.unit]
        unit = f" {self.unit}" if self.unit not in ("", q.unit) else ""
        expected = f"a number between {q.low / factor:.4g} and {q.high / factor:.4g}{unit}, or n/a"
        remedy = f"correct it, as in {q.example}"
        if self.readings:
            may_be = " or ".join(f"{one.value:.4g} {q.unit} ({one.unit})" for one in self.readings)
            remedy = f"write the unit: it may be {may_be}"
        return f"{self.title} {self.text!r} of {name}", expected, remedy


def _decide(mass: _Found, height: _Found) -> None:
    """Of several units keep those with which mass and height are of one person."""
    if not mass.readings or not height.readings:
        return
    both = product(mass.readings, height.readings)
    pairs = [(m, h) for m, h in both if is_usual_pair(m.value, h.value)]
    for k, one in enumerate((mass, height)):
        if len(one.readings) > 1:
            one.readings = tuple(dict.fromkeys(pair[k] for pair in pairs)) or one.readings
