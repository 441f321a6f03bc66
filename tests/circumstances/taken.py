"""Run bsip on a study and read what it made of it: artifacts and printed words only."""

from __future__ import annotations

import re
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import numpy as np
import pandas as pd

from bsip_cli.cli import cli
from bsip_cli.errors import BsipError

_SUMMARY = re.compile(r"bsip ingest: \d+ ")
COMPONENTS = ("fx_N", "fy_N", "fz_N", "mx_Nm", "my_Nm", "mz_Nm")


@dataclass(frozen=True)
class Word:
    """A row of a quality table, or a refusal or line of stderr (check empty)."""

    trial: str
    level: str
    check: str
    text: str


@dataclass(frozen=True, eq=False)
class TakenTrial:
    """Artifacts of one trial; plates : name to (n, 6) wrench about the world's origin."""

    time_s: np.ndarray
    markers_m: dict[str, np.ndarray]
    valid: np.ndarray
    wrench: np.ndarray
    plates: dict[str, np.ndarray]


@dataclass(frozen=True, eq=False)
class Taken:
    """Everything that a user sees of an ingested study."""

    exit_code: int
    trials: dict[str, TakenTrial]
    words: tuple[Word, ...]


def ingest(study: Path, out: Path) -> dict[str, Taken]:
    """`bsip ingest study --out out`, in this process; by participant."""
    code, _, printed = _called("ingest", str(study), "--out", str(out))
    lines = printed.splitlines()
    people = sorted(folder.name for folder in study.glob("sub-*"))
    return {name: _read(out / name, name, code, lines, people) for name in people}


def concluded(study: Path, out: Path) -> str:
    """Of a study of one person, what `bsip run` refuses or `bsip show` finds: nothing if it finds
    neither a cause nor a large error."""
    code, _, printed = _called("run", str(study), "--out", str(out))
    if code:
        return " ".join(printed.split())
    found = " ".join(_called("show", str(out))[1].split("\n  - ")[0].split())
    return found if re.search(r"\b1\. |Large error", found) else ""


def exported(study: Path, out: Path, to: Path) -> None:
    """The study as `bsip export --what recording` corrects it."""
    code, *_ = _called(
        "export", str(study), "--out", str(out), "--what", "recording", "--to", str(to)
    )
    assert code == 0


def _called(*arguments: str) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of a command, in this process."""
    shown, printed = StringIO(), StringIO()
    with redirect_stderr(printed), redirect_stdout(shown):
        try:
            code = cli(arguments, standalone_mode=False)
        except BsipError as error:  # as the command's entry point does
            print(f"bsip: {error}", file=printed)
            code = error.exit_code
    return int(code or 0), shown.getvalue(), printed.getvalue()


def _read(
    folder: Path, participant: str, exit_code: int, lines: list[str], people: list[str]
) -> Taken:
    """What is below a participant's folder and said of it, or of nobody in particular."""
    others = [name for name in people if name != participant]
    own = [line for line in lines if not any(other in line for other in others)]
    words = [
        Word(_trial_in(line, participant), "printed", "", line)
        for line in own
        if not _SUMMARY.match(line)
    ]
    trials = {}
    for file in sorted(folder.rglob("*.parquet")):
        stem, kind = file.stem.rsplit("_", 1)
        name = "" if stem == participant else stem.removeprefix(f"{participant}_")
        if kind == "quality":
            words += _quality(name, pd.read_parquet(file))
        elif kind.startswith("refusal"):
            words += [Word(name, "refused", "", t) for t in pd.read_parquet(file)["sentence"]]
        elif kind == "wrench":
            trials[name] = _trial(file, file.with_name(f"{stem}_markers.parquet"))
    return Taken(exit_code, trials, tuple(words))


def _trial_in(line: str, participant: str) -> str:
    """The trial that a printed line is about, or nothing."""
    found = re.search(rf"{participant}_(task-\w+(?:-\d+)?)", line)
    return found[1] if found else ""


def _quality(trial: str, table: pd.DataFrame) -> list[Word]:
    rows = table.astype(str).to_dict("records")
    return [
        Word(
            trial,
            row["level"],
            row["check"],
            f"{row['check']} {row['subject']}: {row['found']} ({row['expected']}); {row['action']}",
        )
        for row in rows
    ]


def _trial(wrench_file: Path, markers_file: Path) -> TakenTrial:
    wrench, markers = pd.read_parquet(wrench_file), pd.read_parquet(markers_file)
    names = dict.fromkeys(
        found[1] for c in wrench.columns if (found := re.fullmatch(r"plate(.*)_fz_N", c))
    )
    return TakenTrial(
        time_s=wrench["time_s"].to_numpy(),
        markers_m={
            str(name): rows[["x_m", "y_m", "z_m"]].to_numpy(float)
            for name, rows in markers.groupby("marker", sort=False)
        },
        valid=wrench["valid"].to_numpy(bool),
        wrench=wrench[list(COMPONENTS)].to_numpy(float),
        plates={n: wrench[[f"plate{n}_{c}" for c in COMPONENTS]].to_numpy(float) for n in names},
    )
