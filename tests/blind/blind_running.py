"""Recordings of sessions in a study, and the command line over it as a lab would use it.

The pipeline gets `study`, where nothing tells what is hidden; `truth` lies outside of it.
"""

from __future__ import annotations

import json
import os
import resource
import shutil
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

from tests.blind.blind_cases import HOST_TASKS, SESSION_TASKS, Case, Hidden, Session

ROOT = Path(__file__).parents[2]
TABLES = ROOT / "docs" / "results"
STAGES = ("ingest", "scale", "ik", "regress", "identify", "diagnose")
DONE, BUG, REFUSED_SOME, NUMERICAL = 0, 1, 3, 4  # exit codes after which others may be done
PEOPLE = 6  # that are tried until one can move as planned
SIMULATED = "sub-01"  # as `bsip simulate` calls its only person


@dataclass(frozen=True)
class Recorded:
    """A case in a study. stems : of the recordings that hold its effects; truth : the records."""

    case: Case
    session: str
    participant: str
    stems: tuple[str, ...]
    truth: dict

    @classmethod
    def from_record(cls, record: dict) -> Recorded:
        """Out of what ``dataclasses.asdict`` made of it."""
        case = dict(record["case"])
        case["hidden"] = tuple(Hidden(**one) for one in case["hidden"])
        return cls(**{**record, "case": Case(**case), "stems": tuple(record["stems"])})


class CommandError(RuntimeError):
    """A command of bsip that did not end as it should: what it said, and its exit code."""

    def __init__(self, said: str, code: int) -> None:
        super().__init__(said)
        self.code = code


def bsip(*arguments: str, allowed: Sequence[int] = (DONE,)) -> str:
    """One command in a process of its own; returns what it complains about, if it does.

    Raises
    ------
    CommandError : it ended with another exit code.
    """
    path = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    module = "tests.blind.outside_effects" if arguments[0] == "simulate" else "bsip_cli"
    done = subprocess.run(
        [sys.executable, "-m", module, *arguments],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": path},
    )
    said = f"bsip {' '.join(arguments)}: exit {done.returncode}\n{done.stderr}"
    if done.returncode not in allowed:
        raise CommandError(said, done.returncode)
    return "" if done.returncode == DONE else said


def record_study(sessions: Sequence[Session], folder: Path, jobs: int) -> list[Recorded]:
    """Simulate all sessions as sub-01, sub-02, ... of ``folder/study``."""
    names = [f"sub-{k + 1:02d}" for k in range(len(sessions))]
    with ThreadPoolExecutor(jobs) as pool:
        parts = list(
            pool.map(lambda pair: record_session(*pair, folder), zip(sessions, names, strict=True))
        )
    lines = [line for line, _ in parts]
    header = "participant_id\tsex\tmass_kg\theight_m"
    (folder / "study" / "participants.tsv").write_text("\n".join([header, *lines]) + "\n")
    return [recorded for _, found in parts for recorded in found]


def record_session(session: Session, name: str, folder: Path) -> tuple[str, list[Recorded]]:
    """One person's recordings; returns the line of participants.tsv and the cases.

    A person who cannot move as planned with the effect gives way to another.
    """
    people = [replace(session, seed=session.seed + 1_000_000 * k) for k in range(PEOPLE)]
    for person in people[:-1]:
        try:
            return _record_person(person, name, folder)
        except CommandError as error:
            if error.code != NUMERICAL:
                raise
    return _record_person(people[-1], name, folder)


def _record_person(session: Session, name: str, folder: Path) -> tuple[str, list[Recorded]]:
    scratch, place = folder / "scratch" / name, folder / "study" / name
    shutil.rmtree(scratch, ignore_errors=True)  # of a run that was interrupted
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    whole = session.whole
    base = simulate(scratch / "base", session, whole, SESSION_TASKS if whole else HOST_TASKS)
    shutil.copyfile(base / "study.toml", folder / "study" / "study.toml")
    stems = take(base, place, name)
    cases = []
    if whole:
        cases.append(Recorded(whole, session.name, name, stems, truth_of(base, name)))
    else:
        runs = {"squat": 1}  # the clean one
        for case in session.cases:
            runs[case.place] = runs.get(case.place, 0) + 1
            study = simulate(scratch / case.name, session, case, (case.place,), runs[case.place])
            held = take(study, place, name)
            cases.append(Recorded(case, session.name, name, held, truth_of(study, name)))
    line = (base / "participants.tsv").read_text().splitlines()[1].replace(SIMULATED, name, 1)
    shutil.rmtree(scratch)
    return line, cases


def simulate(
    place: Path, session: Session, case: Case | None, tasks: Sequence[str], run: int = 1
) -> Path:
    """Some recordings of the session's person, with a case's effects in them."""
    arguments = [str(place), "--preset", "diagnosis", "--seed", str(session.seed)]
    arguments += ["--sequence-s", f"{session.sequence_s:g}", "--run", str(run)]
    if session.plate_per_foot:
        arguments.append("--plate-per-foot")
    for task in tasks:
        arguments += ["--task", task]
    for hidden in case.hidden if case else ():
        arguments += ["--effect", hidden.effect, "--size", f"{hidden.size:g}"]
        arguments += ["--target", hidden.target]
    bsip("simulate", *arguments)
    return place


def take(study: Path, place: Path, name: str) -> tuple[str, ...]:
    """Move the recordings of a simulated study to a person's; returns their stems."""
    stems = []
    for path in sorted((study / SIMULATED).glob("*.c3d")):
        renamed = place / path.name.replace(SIMULATED, name)
        path.replace(renamed)
        stems.append(renamed.stem)
    return tuple(stems)


def truth_of(study: Path, name: str) -> dict:
    """What the simulator knows, trials under their names in the blind study."""
    record = json.loads((study / "truth" / f"{SIMULATED}_truth.json").read_text())
    trials = {stem.replace(SIMULATED, name): trial for stem, trial in record["trials"].items()}
    return {"effects": record["effects"], "trials": trials}


def run_pipeline(folder: Path, stages: Sequence[str], jobs: int) -> list[str]:
    """Run the stages over ``folder/study`` into ``folder/out``; returns what went wrong.

    A stage that fails for one person has done the others, and the next stages go on with them.

    Raises
    ------
    CommandError : a wrong usage, which no other person would make right.
    """
    study, out, allowed = folder / "study", folder / "out", (DONE, BUG, REFUSED_SOME, NUMERICAL)
    said = [
        bsip(stage, str(study), "--out", str(out), "--jobs", str(jobs), allowed=allowed)
        for stage in stages
    ]
    return [complaint for complaint in said if complaint]


def cpu_seconds() -> float:
    """CPU time of all ended processes that this one started."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def write_atomically(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    partial = path.with_name(f".{path.name}.{os.getpid()}.part")
    partial.write_text(text + "\n", encoding="utf-8")
    partial.replace(path)
