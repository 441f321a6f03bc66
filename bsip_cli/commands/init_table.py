"""A table of people among the files that ``bsip init`` is given: what it says of them."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import replace
from pathlib import Path

from bsip_cli.errors import BadDataError
from bsip_cli.recordings.model import StatedPerson
from bsip_cli.study.new_study import plain
from bsip_cli.study.participants import UNKNOWN, PeopleTable, Row, participant_of, read_people

_NAMES = ("participants", "subjects")
_KINDS = (".tsv", ".csv")


def is_table(path: Path) -> bool:
    """Whether a file is called as a table of people."""
    return path.stem.casefold() in _NAMES and path.suffix.lower() in _KINDS


def read_tables(
    files: Iterable[Path], people: Collection[str]
) -> tuple[dict[str, tuple[Path, StatedPerson]], list[str]]:
    """What tables say of the participants of the new study, by their names; and what is to be said.

    A person is known by the letters and digits of the name. Of several tables the first counts.
    """
    said: dict[str, tuple[Path, StatedPerson]] = {}
    notes: list[str] = []
    wanted = {name.removeprefix("sub-").casefold(): name for name in people}
    for file in files:
        try:
            table = read_people(file)
        except BadDataError as refusal:
            notes.append(str(refusal))
            continue
        notes += table.notes
        for row in table.rows:
            name = wanted.get(plain(row.id.removeprefix("sub-")).casefold())
            if name is None or name in said:
                continue
            try:
                stated, told = _stated(replace(row, id=name), table)
            except BadDataError as refusal:
                notes.append(str(refusal))
                continue
            said[name] = file, stated
            notes += told
    return said, notes


def _stated(row: Row, table: PeopleTable) -> tuple[StatedPerson, tuple[str, ...]]:
    person = participant_of(row, table)
    is_stated = row.cells[table.columns["sex"].index].casefold() not in UNKNOWN
    stated = StatedPerson(person.mass_kg, person.height_m, person.sex if is_stated else "")
    return stated, person.notes
