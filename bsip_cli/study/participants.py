"""The rows of participants.tsv: who is in a study, and what is known of them."""

from __future__ import annotations

import csv
import difflib
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from bsip_cli.errors import BadDataError, UsageError
from bsip_cli.files.regular import fault_of
from bsip_cli.study.trials import MANY, Trial

NAME = re.compile(r"sub-[A-Za-z0-9]+")
_REQUIRED = ("participant_id", "sex", "mass_kg")
_KNOWN = (*_REQUIRED, "height_m")
_MOST_COLUMNS = 1000  # a table of people has tens; a million take minutes and gigabytes


@dataclass(frozen=True)
class Participant:
    """One row of participants.tsv; mass and height are None where the table says n/a."""

    id: str
    sex: Literal["M", "F"]
    mass_kg: float | None
    height_m: float | None
    trials: tuple[Trial, ...] = ()


def named_in(file: Path) -> list[str]:
    """Whom participants.tsv names, each once, without names that cannot be."""
    names = (str(row["participant_id"] or "").strip() for row in read_rows(file))
    return [name for name in dict.fromkeys(names) if NAME.fullmatch(name)]


def rows_of(chosen: Sequence[str], rows: list[dict[str, str]], file: Path) -> list[dict[str, str]]:
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


def read_rows(file: Path) -> list[dict[str, str]]:
    """The rows of the table by column; nothing but the columns' names is checked.

    Raises
    ------
    BadDataError
        It cannot be read, is no such table or lacks a column.
    """
    if fault := fault_of(file):
        raise _unreadable(file, f"cannot be read: it {fault}")
    try:
        with file.open(encoding="utf-8-sig", newline="") as handle:
            reader = csv.DictReader(handle, delimiter="\t")
            header = reader.fieldnames or ()
            _check_count(file, header)
            rows = list(reader)
    except OSError as error:
        raise _unreadable(file, f"cannot be read ({error.strerror or error})") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise BadDataError(
            f"is not a text table ({error})",
            file=file,
            expected="tab-separated UTF-8 text",
            remedy="save it again as tab-separated text",
        ) from None
    if not rows:
        raise _lacking(file, "names no participant")
    _check_names(file, header)
    return rows


def _unreadable(file: Path, found: str) -> BadDataError:
    return BadDataError(
        found,
        file=file,
        expected="a tab-separated table with participant_id, sex, mass_kg, height_m",
        remedy="write one, a line per participant",
    )


def _check_count(file: Path, header: Sequence[str]) -> None:
    if len(header) > _MOST_COLUMNS:
        raise BadDataError(
            f"has {len(header)} columns",
            file=file,
            expected=f"at most {_MOST_COLUMNS}",
            remedy="keep participant_id, sex, mass_kg and height_m",
        )


def _check_names(file: Path, header: Sequence[str]) -> None:
    missing = [name for name in _REQUIRED if name not in header]
    if misspelt := _misspelt(header, _KNOWN):
        raise BadDataError(
            "has " + ", ".join(f"a column {name!r} and no {near}" for name, near in misspelt),
            file=file,
            expected=", ".join(_KNOWN),
            remedy="correct the name",
        )
    if missing and _is_one_column(header):
        raise BadDataError(
            f"has one column, {header[0]!r}",
            file=file,
            expected=f"{', '.join(_KNOWN)}, separated by tabs",
            remedy="put a tab between the cells of every line, no spaces or commas",
        )
    if missing:
        raise _lacking(file, f"has no column {', '.join(missing)}")


def _lacking(file: Path, found: str) -> BadDataError:
    expected = "participant_id, sex, mass_kg, height_m, separated by tabs"
    return BadDataError(found, file=file, expected=expected, remedy="add it")


def _is_one_column(header: Sequence[str]) -> bool:
    """Whether all columns' names have come as one: the table is separated by something else."""
    return len(header) == 1 and "participant_id" in header[0] and header[0].count("_") > 1


def _misspelt(header: Sequence[str], known: tuple[str, ...]) -> list[tuple[str, str]]:
    """Columns whose names are cut or slightly other than one that is lacking, and that one."""
    found = []
    lacking = [name for name in known if name not in header]
    for name in (name.strip().lower() for name in header if name not in known):
        cut = [near for near in lacking if len(name) >= 3 and near.startswith(name)]
        near = cut or difflib.get_close_matches(name, lacking, n=1, cutoff=0.75)
        found += [(name, near[0])] if near else []
    return found


def participant_of(row: dict[str, str], file: Path) -> Participant:
    """A row as a participant, still without trials.

    Raises
    ------
    BadDataError
        A cell cannot be used, or is missing.
    """
    name = (row["participant_id"] or "").strip()
    if not NAME.fullmatch(name):
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
    mass_kg = _number(row, "mass_kg", name, file, 10.0, 400.0)
    height_m = _number(row, "height_m", name, file, 0.5, 2.6)
    return Participant(name, sex, mass_kg, height_m)  # type: ignore[arg-type]


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
