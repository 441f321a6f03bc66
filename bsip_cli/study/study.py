"""A study on disk: participants, trials, what is not used; and the folder of its results."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from bsip_cli import __version__
from bsip_cli.artifacts import write_bytes
from bsip_cli.errors import BadDataError, UsageError
from bsip_cli.files.regular import check_path, entries, fault_of, is_folder, lies_in
from bsip_cli.study.participants import NAME, Participant, participant_of, read_people, rows_of
from bsip_cli.study.trials import (
    RECORDINGS,
    Folder,
    Role,
    Trial,
    find_trials,
    kinds,
    listed,
    merged,
)

__all__ = ["Participant", "Role", "Study", "Trial", "describe_dataset", "load_study", "make_out"]

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

    root : the study's folder.
    roles : task names of the roles ``static`` and ``sequence``.
    chosen : only these participants, in this order; nothing of the others is looked at.

    Returns the study, and what had to be refused: a participant whose row or folder cannot be used
        does not stop the others, nor does a recording.

    UsageError: there is no study at ``root``, its path cannot be opened by all who read it, or
        participants.tsv does not name who is chosen.
    BadDataError: participants.tsv cannot be read or lacks a column.
    """
    if not is_folder(root):
        raise UsageError(
            "there is no such folder", file=root, remedy="name the folder with participants.tsv"
        )
    check_path(root)
    table = read_people(root / "participants.tsv")
    participants: dict[str, Participant] = {}  # by id in small letters
    refusals: list[BadDataError] = []
    notes, found = list(table.notes), []
    for row in rows_of(chosen, table) if chosen else table.rows:
        try:
            person = participant_of(row, table)
            _check_folder(root, person.id, participants.get(person.id.casefold()))
            found.append(find_trials(root / person.id, person.id, roles))
        except BadDataError as refusal:
            refusals.append(refusal)
            continue
        refusals += found[-1].refusals
        notes += person.notes
        if trials := found[-1].trials:
            participants[person.id.casefold()] = replace(person, trials=tuple(trials))
    if not chosen:
        beside, unnamed = _around(root, {row.id for row in table.rows})
        refusals += beside
        notes += unnamed
    notes += _unused(root, found)
    return Study(root, tuple(participants.values()), tuple(notes)), refusals


def _check_folder(root: Path, name: str, known: Participant | None) -> None:
    """Refuse a participant without a folder, or who stands in the table twice."""
    if known is not None:
        other = "" if name == known.id else f", in other capitals as {known.id}"
        raise BadDataError(
            f"{name} stands twice{other}",
            file=root / "participants.tsv",
            expected="a line per participant; the first one counts",
            remedy="remove one",
        )
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


def _around(root: Path, named: set[str]) -> tuple[list[BadDataError], list[str]]:
    """What is refused next to the folders of those whom participants.tsv names, and the folders of
    people whom it does not name, in words."""
    try:
        paths = entries(root)
    except BadDataError as closed:
        return [closed], []
    outside = (
        BadDataError(
            "lies in no participant's folder",
            file=path,
            expected="recordings in the folders of participants",
            remedy="move it there",
        )
        for path in paths
        if path.suffix.lower() in RECORDINGS
    )
    unnamed = [path for path in paths if NAME.fullmatch(path.name) and path.name not in named]
    table, where = root / "participants.tsv", _where(unnamed, root)
    return merged(outside), [f"{table} does not name {where}: not used"] if unnamed else []


def _unused(root: Path, found: Sequence[Folder]) -> Iterator[str]:
    """What is no recording, in one sentence for each kind."""
    others = [path for one in found for path in one.others]
    spare_forces = [path for one in found for path in one.spare_forces]
    folders = [path for path in others if is_folder(path)]
    files = sorted({*others} - {*folders})
    if folders:
        yield (
            "folders that are not looked into, since recordings lie in sub-XX and in "
            f"sub-XX/ses-YY: {_where(folders, root)}"
        )
    if files:
        yield f"files that are no recordings and not used: {_told(files, root)}"
    if spare_forces:
        yield (
            "forces that are not used, since those of the C3D of their name are: "
            f"{_told(spare_forces, root)}"
        )


def _told(files: Sequence[Path], root: Path) -> str:
    return _where(files, root) if len(files) <= _FEW else kinds(files)


def _where(paths: Sequence[Path], root: Path) -> str:
    return listed(str(path.relative_to(root)) for path in paths)


# --- the folder of results: where it may lie, and what it says of itself to users of BIDS ---------


DESCRIPTION = "dataset_description.json"
BIDS_VERSION = "1.10.0"


def make_out(out: Path, study: Path) -> None:
    """Make sure that there is a folder for results, apart from the recordings.

    UsageError: it is the study, lies above it or in a participant's folder, or cannot be made.
    """
    check_path(out)
    if found := _in_the_way(out, study):
        raise UsageError(
            found,
            file=out,
            expected="a folder for results, apart from the recordings",
            remedy=f"name another one with --out, like {study / 'derivatives' / 'bsip'}",
        )
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(
            f"is no folder to write to ({error.strerror})", file=out, remedy="check --out"
        ) from None


def _in_the_way(out: Path, study: Path) -> str:
    """Why results cannot lie there; empty if they can."""
    if os.path.lexists(out) and not is_folder(out):
        return f"is no folder to write to: it {fault_of(out) or 'is a file'}"
    if lies_in(study, out):
        return "is the study" if _is_same(out, study) else "holds the study"
    people = [path for path in study.glob("sub-*") if NAME.fullmatch(path.name)]
    homes = [home for person in people for home in (person, *person.glob("ses-*"))]
    inside = [home.name for home in homes if lies_in(out, home)]
    real = Path(os.path.realpath(out))
    for path in (real, *real.parents):  # a folder that would be taken for a participant's
        if NAME.fullmatch(path.name) and _is_same(path.parent, study):
            inside.append(path.name)
    return f"is the folder of {inside[0]} or lies in it" if inside else ""


def _is_same(one: Path, other: Path) -> bool:
    return lies_in(one, other) and lies_in(other, one)


def describe_dataset(out: Path, study: Path) -> str:
    """Write the description unless the same one is there; what to say of one of other origin.

    UsageError: it cannot be written.
    """
    what = "body segment inertial parameters from motion and ground forces"
    description = {
        "Name": f"bsip results of {study.resolve().name}",
        "BIDSVersion": BIDS_VERSION,
        "DatasetType": "derivative",
        "GeneratedBy": [{"Name": "bsip", "Version": __version__, "Description": what}],
    }
    text = json.dumps(description, indent=2) + "\n"
    path = out / DESCRIPTION
    if os.path.lexists(path):
        found, is_own = "", False
        with suppress(OSError, ValueError, TypeError, KeyError, RecursionError):
            if not (path.is_symlink() or fault_of(path)):
                found = path.read_text(encoding="utf-8")
                is_own = any(one["Name"] == "bsip" for one in json.loads(found)["GeneratedBy"])
        if not is_own:
            return f"{path}: is not of bsip, and stays as it is"
        if found == text:
            return ""
    write_bytes(path, text.encode())
    return ""
