"""A study on disk: participants, trials, their roles, and what lies there and is not used."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from bsip_cli.errors import BadDataError, UsageError, printable
from bsip_cli.files.folders import check_path, entries, is_folder
from bsip_cli.files.regular import fault_of
from bsip_cli.study.participants import NAME, Participant, Row, participant_of, read_people, rows_of
from bsip_cli.study.trials import (
    RECORDINGS,
    Fault,
    Role,
    Trial,
    find_trials,
    listed,
    refusals_of,
)

__all__ = ["Participant", "Role", "Study", "Trial", "load_study"]

_FEW = 3
"""So many files are named; of more, how many there are of each kind."""


@dataclass(frozen=True)
class Study:
    """``notes`` say what lies there that is no recording."""

    root: Path
    participants: tuple[Participant, ...]
    notes: tuple[str, ...] = ()


def load_study(
    root: Path, roles: dict[str, tuple[str, ...]], chosen: Sequence[str] = ()
) -> tuple[Study, list[BadDataError]]:
    """Read participants.tsv and list the recordings.

    Parameters
    ----------
    root : the study's folder.
    roles : task names of the roles ``static`` and ``sequence``.
    chosen : only these participants, in this order; nothing of the others is looked at.

    Returns
    -------
    The study, and what had to be refused: a participant whose row or folder cannot be used does
    not stop the others, nor does a recording.

    Raises
    ------
    UsageError
        There is no study at ``root``, its path cannot be opened by all who read it, or
        participants.tsv does not name who is chosen.
    BadDataError
        participants.tsv cannot be read or lacks a column.
    """
    if not is_folder(root):
        raise UsageError(
            "there is no such folder", file=root, remedy="name the folder with participants.tsv"
        )
    check_path(root)
    loading = _Loading(root, roles)
    for row in rows_of(chosen, loading.table) if chosen else loading.table.rows:
        loading.add(row)
    if not chosen:
        loading.look_around({row.id for row in loading.table.rows})
    study = Study(root, tuple(loading.participants.values()), tuple(loading.all_notes()))
    return study, loading.refusals


class _Loading:
    """Who is found in a study row by row, and what cannot be used."""

    def __init__(self, root: Path, roles: dict[str, tuple[str, ...]]) -> None:
        self.root, self.roles = root, roles
        self.table = read_people(root / "participants.tsv")
        self.participants: dict[str, Participant] = {}  # by id in small letters
        self.refusals: list[BadDataError] = []
        self.notes: list[str] = list(self.table.notes)
        self.others: list[Path] = []
        self.spare_forces: list[Path] = []

    def add(self, row: Row) -> None:
        """A row of participants.tsv, with the folder of that name."""
        try:
            person = participant_of(row, self.table)
            if (known := self.participants.get(person.id.casefold())) is not None:
                raise self._twice(person.id, known.id)
            _check_folder(self.root, person.id)
            found = find_trials(self.root / person.id, person.id, self.roles)
        except BadDataError as refusal:
            self.refusals.append(refusal)
            return
        self.others += found.others
        self.spare_forces += found.spare_forces
        self.refusals += found.refusals
        self.notes += person.notes
        if found.trials:
            person = replace(person, trials=tuple(found.trials))
            self.participants[person.id.casefold()] = person

    def _twice(self, name: str, known: str) -> BadDataError:
        return BadDataError(
            f"{name} stands twice" + ("" if name == known else f", in other capitals as {known}"),
            file=self.root / "participants.tsv",
            expected="a line per participant; the first one counts",
            remedy="remove one",
        )

    def look_around(self, named: set[str]) -> None:
        """What lies beside the folders of those whom participants.tsv names."""
        try:
            paths = entries(self.root)
        except BadDataError as closed:
            self.refusals.append(closed)
            return
        expected, remedy = "recordings in the folders of participants", "move it there"
        outside = [path for path in paths if path.suffix.lower() in RECORDINGS]
        found = "lies in no participant's folder"
        self.refusals += refusals_of(Fault(path, found, expected, remedy) for path in outside)
        unnamed = [path for path in paths if NAME.fullmatch(path.name) and path.name not in named]
        if unnamed:
            table = self.root / "participants.tsv"
            self.notes.append(f"{table} does not name {_where(unnamed, self.root)}: not used")

    def all_notes(self) -> Iterator[str]:
        """What is no recording, in one sentence for each kind."""
        yield from self.notes
        folders = [path for path in self.others if is_folder(path)]
        files = sorted({*self.others} - {*folders})
        if folders:
            yield (
                "folders that are not looked into, since recordings lie in sub-XX and in "
                f"sub-XX/ses-YY: {_where(folders, self.root)}"
            )
        if files:
            yield f"files that are no recordings and not used: {_kinds(files, self.root)}"
        if self.spare_forces:
            yield (
                "forces that are not used, since those of the C3D of their name are: "
                f"{_kinds(self.spare_forces, self.root)}"
            )


def _check_folder(root: Path, name: str) -> None:
    folder = root / name
    if is_folder(folder):
        return
    is_there = os.path.lexists(folder)
    raise BadDataError(
        fault_of(folder) or "is a file" if is_there else f"there is no folder {name}",
        file=folder if is_there else root,
        expected="one folder per participant",
        remedy="add it, or take the line out of participants.tsv",
    )


def _kinds(files: Sequence[Path], root: Path) -> str:
    """Where a few files lie; of more, how many there are of each kind."""
    if len(files) <= _FEW:
        return _where(files, root)
    counts = Counter(path.suffix.lower() or "without an ending" for path in files)
    return ", ".join(f"{n} {printable(kind)}" for kind, n in counts.most_common())


def _where(paths: Sequence[Path], root: Path) -> str:
    return listed(str(path.relative_to(root)) for path in paths)
