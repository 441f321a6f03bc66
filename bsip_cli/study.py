"""A study on disk: participants, trials, their roles, and where artifacts lie."""

from __future__ import annotations

import csv
import difflib
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from bsip_cli.errors import BadDataError, UsageError

Role = Literal["static", "sequence", "validation"]

_PARTICIPANT = re.compile(r"sub-[A-Za-z0-9]+")
_TRIAL = re.compile(
    r"(?P<participant>sub-[A-Za-z0-9]+)_task-(?P<task>[A-Za-z0-9]+)(_run-(?P<run>[0-9]+))?"
)
_RECORDINGS = (".c3d", ".trc")
MANY = 20
"""So many participants are no more named one by one in a message."""

_NAME_RULE = "names like sub-01_task-sequence_run-1.c3d (letters and digits only)"


@dataclass(frozen=True)
class Trial:
    """One recording: ``stem`` names all its artifacts; ``run`` is None without run-... in it."""

    participant_id: str
    task: str
    stem: str
    path: Path
    role: Role
    run: int | None = None


@dataclass(frozen=True)
class Participant:
    """One row of participants.tsv; mass and height are None where the table says n/a."""

    id: str
    sex: Literal["M", "F"]
    mass_kg: float | None
    height_m: float | None
    trials: tuple[Trial, ...]


@dataclass(frozen=True)
class Study:
    root: Path
    participants: tuple[Participant, ...]


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
    not stop the others.

    Raises
    ------
    UsageError
        There is no study at ``root``, or participants.tsv does not name who is chosen.
    BadDataError
        participants.tsv cannot be read or lacks a column.
    """
    if not root.is_dir():
        raise UsageError(
            "there is no such folder", file=root, remedy="name the folder with participants.tsv"
        )
    rows = _participant_rows(root / "participants.tsv")
    if chosen:
        rows = _rows_of(chosen, rows, root / "participants.tsv")
    participants: dict[str, Participant] = {}
    refusals: list[BadDataError] = []
    for row in rows:
        try:
            participant, misnamed = _participant(root, row, roles)
        except BadDataError as refusal:
            refusals.append(refusal)
            continue
        if participant.id in participants:
            refusals.append(_twice(root, participant.id))
            continue
        participants[participant.id] = participant
        refusals += misnamed
    return Study(root, tuple(participants.values())), refusals


def _rows_of(chosen: Sequence[str], rows: list[dict[str, str]], file: Path) -> list[dict[str, str]]:
    """The rows of some participants, in their order."""
    known: dict[str, list[dict[str, str]]] = {}
    for row in rows:
        known.setdefault((row["participant_id"] or "").strip(), []).append(row)
    unknown = [name for name in chosen if name not in known]
    if unknown:
        near = [n for name in unknown for n in difflib.get_close_matches(name, known)]
        raise UsageError(
            f"no participant {', '.join(unknown)}",
            file=file,
            expected=f"one of {', '.join(known if len(known) < MANY else near or [*known][:MANY])}",
        )
    return [row for name in dict.fromkeys(chosen) for row in known[name]]


def _participant_rows(file: Path) -> list[dict[str, str]]:
    required = ("participant_id", "sex", "mass_kg")
    try:
        with file.open(encoding="utf-8-sig", newline="") as handle:
            rows = list(csv.DictReader(handle, delimiter="\t"))
            header = rows[0].keys() if rows else ()
    except OSError as error:
        raise BadDataError(
            f"cannot be read ({error.strerror})",
            file=file,
            expected="a tab-separated table with participant_id, sex, mass_kg, height_m",
            remedy="write one, a line per participant",
        ) from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise BadDataError(
            f"is not a text table ({error})",
            file=file,
            expected="tab-separated UTF-8 text",
            remedy="save it again as tab-separated text",
        ) from None
    known = (*required, "height_m")
    missing = [name for name in required if name not in header]
    if misspelt := _misspelt(header, known):
        raise BadDataError(
            "has " + ", ".join(f"a column {name!r} and no {near}" for name, near in misspelt),
            file=file,
            expected=", ".join(known),
            remedy="correct the name",
        )
    if missing and _is_one_column(header):
        raise BadDataError(
            f"has one column, {next(iter(header))!r}",
            file=file,
            expected=f"{', '.join(known)}, separated by tabs",
            remedy="put a tab between the cells of every line, no spaces or commas",
        )
    if missing:
        raise BadDataError(
            f"has no column {', '.join(missing)}" if rows else "names no participant",
            file=file,
            expected="participant_id, sex, mass_kg, height_m, separated by tabs",
            remedy="add it",
        )
    return rows


def _is_one_column(header: Iterable[str | None]) -> bool:
    """Whether all columns' names have come as one: the table is separated by something else."""
    (*names,) = header
    return len(names) == 1 and "participant_id" in str(names[0]) and str(names[0]).count("_") > 1


def _misspelt(header: Iterable[str], known: tuple[str, ...]) -> list[tuple[str, str]]:
    """Columns whose names are cut or slightly other than one that is lacking, and that one."""
    found = []
    lacking = [name for name in known if name not in header]
    for name in (str(name).strip().lower() for name in header if name not in known):
        cut = [near for near in lacking if len(name) >= 3 and near.startswith(name)]
        near = cut or difflib.get_close_matches(name, lacking, n=1, cutoff=0.75)
        found += [(name, near[0])] if near else []
    return found


def _check_cells(file: Path, row: dict) -> None:
    """Every line must have a cell for each column: else cells are lost or shifted."""
    if None in row or None in row.values():
        n_columns = sum(name is not None for name in row)
        n_cells = sum(cell is not None for cell in row.values()) - (None in row)
        n_cells += len(row.get(None, ()))
        raise BadDataError(
            f"the line of {row.get('participant_id')!r} has {n_cells} cells",
            file=file,
            expected=f"{n_columns}, as many as there are columns, separated by tabs",
            remedy="write n/a where something is unknown",
        )


def _twice(root: Path, name: str) -> BadDataError:
    return BadDataError(
        f"{name} stands twice",
        file=root / "participants.tsv",
        expected="a line per participant; the first one counts",
        remedy="remove one",
    )


def _participant(
    root: Path, row: dict[str, str], roles: dict[str, tuple[str, ...]]
) -> tuple[Participant, list[BadDataError]]:
    file = root / "participants.tsv"
    name = (row["participant_id"] or "").strip()
    if not _PARTICIPANT.fullmatch(name):
        raise BadDataError(
            f"participant_id {name!r}",
            file=file,
            expected="sub- and letters or digits",
            remedy="rename the participant and the folder",
        )
    _check_cells(file, row)
    sex = (row["sex"] or "").strip().upper()
    if sex not in ("M", "F"):
        raise BadDataError(
            f"sex {row['sex']!r} of {name}",
            file=file,
            expected="M or F",
            remedy="the tables know these two; choose the nearer one",
        )
    folder = root / name
    if not folder.is_dir():
        raise BadDataError(
            f"there is no folder {name}",
            file=root,
            expected="one folder per participant",
            remedy="add it, or take the line out of participants.tsv",
        )
    trials, misnamed = _trials(folder, name, roles)
    participant = Participant(
        id=name,
        sex=sex,  # type: ignore[arg-type]
        mass_kg=_number(row, "mass_kg", name, file, 10.0, 400.0),
        height_m=_number(row, "height_m", name, file, 0.5, 2.6),
        trials=trials,
    )
    return participant, misnamed


def _number(
    row: dict[str, str], column: str, name: str, file: Path, low: float, high: float
) -> float | None:
    text = (row.get(column) or "n/a").strip()
    if text.lower() in ("n/a", ""):
        return None
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not low <= value <= high:
        raise BadDataError(
            f"{column} {text!r} of {name}",
            file=file,
            expected=f"a number between {low:g} and {high:g}, or n/a",
            remedy=_how_to_write(text, low, high),
        )
    return value


def _how_to_write(text: str, low: float, high: float) -> str:
    """The likely reason why a number is none, or out of range."""
    try:
        value = float(text.replace(",", "."))
    except ValueError:
        return "correct it"
    if low <= value <= high:
        return "write a point for the comma"
    return "give it in metres" if low <= value / 100 <= high else "correct it"


def _trials(
    folder: Path, participant: str, roles: dict[str, tuple[str, ...]]
) -> tuple[tuple[Trial, ...], list[BadDataError]]:
    """The recordings of a folder, and refusals of those whose names say nothing."""
    trials, misnamed = [], []
    for path in sorted(folder.iterdir()):
        if path.suffix.lower() not in _RECORDINGS or not path.is_file():
            continue
        match = _TRIAL.fullmatch(path.stem)
        if match is None or match["participant"] != participant:
            misnamed.append(
                BadDataError(
                    "its name does not say what it is",
                    file=path,
                    expected=_NAME_RULE,
                    remedy="rename it",
                )
            )
            continue
        role = _role(match["task"], roles)
        run = int(match["run"]) if match["run"] else None
        trials.append(Trial(participant, match["task"], path.stem, path, role, run))
    stems = [trial.stem for trial in trials]
    double = {stem for stem in stems if stems.count(stem) > 1}
    if double:
        raise BadDataError(
            f"two recordings called {', '.join(sorted(double))}",
            file=folder,
            expected="one .c3d or one .trc of each name",
            remedy="remove one or give it a run number",
        )
    if not trials:
        named = ", ".join(Path(one.file).name for one in misnamed)
        raise BadDataError(
            f"no recordings but {named}, whose name does not say what it is"
            if misnamed
            else "no recordings",
            file=folder,
            expected=f"recordings with {_NAME_RULE}",
            remedy="rename them" if misnamed else "add them",
        )
    return tuple(trials), misnamed


def _role(task: str, roles: dict[str, tuple[str, ...]]) -> Role:
    for role in ("static", "sequence"):
        if task in roles[role]:
            return role  # type: ignore[return-value]
    return "validation"
