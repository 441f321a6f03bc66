"""The rows of participants.tsv: who is in a study, and what is known of them."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from bsip_cli.errors import BadDataError, UsageError
from bsip_cli.files.folders import is_folder
from bsip_cli.stated.quantities import (
    HEIGHT,
    MASS,
    Quantity,
    Reading,
    is_usual_pair,
    odd_pair,
    readings_of,
)
from bsip_cli.stated.sex_words import Sex, sex_of
from bsip_cli.study.people_columns import KNOWN, Column, columns_of, count_known, with_sidecar
from bsip_cli.study.text_table import TextTable, read_text_table
from bsip_cli.study.trials import MANY, Trial

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

    @cached_property
    def sexes(self) -> frozenset[str]:
        """All that stands in that column, in small letters."""
        k = self.columns["sex"].index
        return frozenset(row.cells[k].casefold() for row in self.rows if k < len(row.cells))


def named_in(file: Path) -> list[str]:
    """Whom participants.tsv names, each once, without names that cannot be."""
    names = (row.id for row in read_people(file).rows)
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

    Raises
    ------
    BadDataError
        It cannot be read, is no such table or lacks a column: all faults of its header at once.
    """
    table = read_text_table(file, count_known)
    if not table.rows:
        raise _header_fault(file, ["names no participant"])
    columns, notes = with_sidecar(columns_of(table.header), file.with_suffix(".json"))
    if columns.faults:
        raise _header_fault(file, columns.faults)
    index = columns.known["participant_id"].index
    rows, renamed = [], []
    for cells in table.rows:
        written = cells[index] if index < len(cells) else ""
        rows.append(Row(_id_of(written, file.parent), cells))
        if written.isdigit() and rows[-1].id not in (written, f"sub-{written}"):
            renamed.append(f"{written} is {rows[-1].id}")
    notes = [*_how_read(file, table), *notes]
    if renamed:
        notes.append(f"{file}: {', '.join(renamed)}, by their folders")
    width, separator = len(table.header), table.separator
    return PeopleTable(file, width, separator, columns.known, tuple(rows), tuple(notes))


def _header_fault(file: Path, faults: Sequence[str]) -> BadDataError:
    return BadDataError(
        "; ".join(faults),
        file=file,
        expected=f"{', '.join(KNOWN)}, separated by tabs",
        remedy="add what is lacking, and give the columns that count these names",
    )


def _how_read(file: Path, table: TextTable) -> list[str]:
    """What of the dialect differs from tab-separated UTF-8."""
    said = []
    if table.separator != "tabs":
        said.append(f"its cells are separated by {table.separator}")
    if table.encoding == "cp1252":
        said.append("it is no UTF-8 and was read as Windows-1252 (Latin-1)")
    return [f"{file}: {' and '.join(said)}"] if said else []


def _id_of(written: str, root: Path) -> str:
    """The folder that a name means: ``01`` is sub-01 where that is there, and so is Excel's 1."""
    if NAME.fullmatch(written) or not NAME.fullmatch(f"sub-{written}"):
        return written
    if is_folder(root / f"sub-{written}"):
        return f"sub-{written}"
    if written.isdigit():
        found = [path.name for path in root.glob(f"sub-0*{written}") if is_folder(path)]
        same = [name for name in found if name[4:].lstrip("0") == written.lstrip("0")]
        if len(same) == 1:
            return same[0]
    return written


def participant_of(row: Row, table: PeopleTable) -> Participant:
    """A row as a participant, still without trials.

    Raises
    ------
    BadDataError
        Cells cannot be used, or are missing: all of the row are named.
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
        raise BadDataError(
            f"the line of {row.id!r} has {len(row.cells)} cells",
            file=table.file,
            expected=f"{table.width}, as many as there are columns",
            remedy="write points for decimal commas"
            if is_split
            else "write n/a where something is unknown",
        )
    cells = {name: row.cells[column.index] for name, column in table.columns.items()}
    sex = sex_of(cells["sex"], table.columns["sex"].legend, table.sexes)
    faults = [] if sex else [_sex_fault(cells["sex"], row.id)]
    mass, height = (_Found(cells.get(q.column, ""), q, table.columns) for q in (MASS, HEIGHT))
    _settle(mass, height)
    faults += [one.fault(row.id) for one in (mass, height) if one.is_lost]
    if faults:
        raise _row_fault(table.file, faults)
    notes = [f"{table.file}: {note}" for one in (mass, height) for note in one.notes(row.id)]
    if odd := odd_pair(mass.value, height.value):
        notes.append(f"{table.file}: {row.id}: {odd}")
    assert sex is not None
    return Participant(row.id, sex, mass.value, height.value, notes=tuple(notes))


_Clauses = tuple[str, str, str]
"""What was found, what was expected, what to do."""


def _row_fault(file: Path, faults: Sequence[_Clauses]) -> BadDataError:
    found, expected, remedies = zip(*faults, strict=True)
    return BadDataError(
        "; ".join(found),
        file=file,
        expected="; ".join(expected),
        remedy="; ".join(dict.fromkeys(remedies)),
    )


def _sex_fault(text: str, name: str) -> _Clauses:
    remedy = "write one of them"
    if text.strip().isdigit():
        remedy = (
            "write words, or say what the numbers mean, which differs between laboratories: in the "
            'header, as in "sex (0=F, 1=M)", or as Levels in participants.json'
        )
    elif text.strip().casefold() == "m":
        remedy = "write mujer or man: beside H an M may be either"
    return f"sex {text!r} of {name}", "M, F, other or n/a", remedy


class _Found:
    """A cell with a mass or a height, and what it may mean."""

    def __init__(self, text: str, quantity: Quantity, columns: Mapping[str, Column]) -> None:
        column = columns.get(quantity.column)
        self.text, self.quantity = text.strip(), quantity
        self.title, self.unit = (column.title, column.unit) if column else (quantity.column, "")
        self.is_known = self.text.casefold() not in UNKNOWN
        self.readings: tuple[Reading, ...] = ()
        if self.is_known:
            self.readings = readings_of(self.text, quantity, self.unit)

    @property
    def is_lost(self) -> bool:
        """Whether something is written there that has no meaning, or several."""
        return self.is_known and len(self.readings) != 1

    @property
    def value(self) -> float | None:
        return self.readings[0].value if self.readings else None

    def notes(self, name: str) -> list[str]:
        if not self.readings or self.readings[0].is_stated:
            return []
        (taken,) = self.readings
        return [
            f"{self.title} {self.text} of {name} is taken as {taken.unit}: {taken.value:.4g} "
            f"{self.quantity.unit}, since it cannot be in {self.unit or self.quantity.unit}"
        ]

    def fault(self, name: str) -> _Clauses:
        q, factor = self.quantity, self.quantity.units[self.unit or self.quantity.unit]
        unit = f" {self.unit}" if self.unit not in ("", q.unit) else ""
        expected = f"a number between {q.low / factor:.4g} and {q.high / factor:.4g}{unit}, or n/a"
        remedy = "correct it"
        if self.readings:
            may_be = " or ".join(f"{one.value:.4g} {q.unit} ({one.unit})" for one in self.readings)
            remedy = f"write the unit: it may be {may_be}"
        return f"{self.title} {self.text!r} of {name}", expected, remedy


def _settle(mass: _Found, height: _Found) -> None:
    """Of several units keep those with which mass and height are of one person."""
    if not mass.readings or not height.readings:
        return
    pairs = [
        (m, h) for m in mass.readings for h in height.readings if is_usual_pair(m.value, h.value)
    ]
    if len(mass.readings) > 1:
        mass.readings = tuple(dict.fromkeys(m for m, _ in pairs)) or mass.readings
    if len(height.readings) > 1:
        height.readings = tuple(dict.fromkeys(h for _, h in pairs)) or height.readings
