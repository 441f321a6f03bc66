"""Run stages over a study: skip what is fresh, write down what is refused, go on with the rest."""

from __future__ import annotations

import importlib
import multiprocessing
from collections.abc import Iterable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import pandas as pd

from bsip_cli.artifacts import remove, write_artifact
from bsip_cli.config import Config
from bsip_cli.errors import (
    BadDataError,
    BsipError,
    NotWritableError,
    NumericalError,
    UsageError,
)
from bsip_cli.lock import held_alone
from bsip_cli.pipeline import Stage, by_level, producer
from bsip_cli.study import Participant, Study
from bsip_cli.unit import Unit

State = Literal["done", "fresh", "waiting", "refused", "unwritten", "bug", "noted"]


@dataclass(frozen=True)
class Outcome:
    """What became of one unit."""

    stage: str
    unit: str
    state: State
    sentences: tuple[str, ...] = ()
    exit_code: int = 0


def run_stages(
    stages: tuple[Stage, ...],
    study: Study,
    out: Path,
    config: Config,
    *,
    force: bool,
    jobs: int,
) -> Iterator[Outcome]:
    """Run ``stages`` participant by participant, then those of the cohort; yield what became.

    ``force`` redoes what is fresh; ``jobs`` participants run at once, each in its own process.
    """
    personal, shared = by_level(stages)
    if personal:
        with _processes(jobs) as pool:
            running = {}
            for participant in study.participants:
                alone = Study(study.root, (participant,))  # all that its process needs to know
                work = pool.submit(_run, personal, alone, out, config, force, participant)
                running[participant.id] = work
            for name, future in running.items():
                yield from _outcomes(future, name, personal)
    if shared:
        with _processes(1) as pool:
            for stage in shared:
                future = pool.submit(_run, (stage,), study, out, config, force)
                yield from _outcomes(future, "group", (stage,))


def _processes(jobs: int) -> ProcessPoolExecutor:
    return ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn"))


def _outcomes(
    future: Future[list[Outcome]], name: str, stages: tuple[Stage, ...]
) -> Iterable[Outcome]:
    """What a process made of ``stages``; its bug stops nobody else's work."""
    error = future.exception()
    return future.result() if error is None else [_bug(name, stages, error)]


def _run(
    stages: tuple[Stage, ...],
    study: Study,
    out: Path,
    config: Config,
    force: bool,
    participant: Participant | None = None,
) -> list[Outcome]:
    """Stages of one participant, or of the cohort, unless another bsip is at them."""
    name = participant.id if participant else "group"
    try:
        with held_alone(out / name):
            return _run_alone(stages, study, out, config, force, participant)
    except UsageError as error:
        return [Outcome(stages[0].name, name, "refused", (str(error),), error.exit_code)]


def _run_alone(
    stages: Iterable[Stage],
    study: Study,
    out: Path,
    config: Config,
    force: bool,
    participant: Participant | None,
) -> list[Outcome]:
    """Unit by unit; what cannot be written ends it, else the rest would be made without it."""
    if participant is not None:
        _forget_gone_recordings(out / participant.id, participant)
    outcomes = []
    for stage in stages:
        trials = participant.trials if participant and stage.level == "trial" else (None,)
        for trial in trials:
            unit = Unit(stage, study, out, config, participant, trial)
            outcomes.append(perform(unit, force))
            if outcomes[-1].state == "unwritten":
                return outcomes
    return outcomes


def _forget_gone_recordings(folder: Path, participant: Participant) -> None:
    """A recording that was refused and then taken out of the study counts no more."""
    known = {participant.id, *(trial.stem for trial in participant.trials)}
    for path in folder.glob("*_refusal-*.parquet"):
        if path.name.split("_refusal-")[0] not in known:
            remove(path)


def perform(unit: Unit, force: bool = False) -> Outcome:
    """Do one unit unless it is fresh or lacks its inputs."""
    stage = unit.stage
    waiting = lacking(unit)
    if waiting is not None:
        return waiting
    fresh = unit.is_fresh()  # asked first: a file that changes from here on makes it stale
    if fresh and not force:
        return Outcome(stage.name, unit.name, "fresh")
    try:
        importlib.import_module(stage.module).run(unit)
        remove(unit.refusal_path())
    except BsipError as error:
        return _refused(unit, error)
    return Outcome(stage.name, unit.name, "done", tuple(unit.messages))


def _refused(unit: Unit, error: BsipError) -> Outcome:
    """Write down what is wrong with the data; say what is wrong, after the unit's warnings."""
    if not isinstance(error, UsageError):
        try:
            _write_refusal(unit, error)
        except NotWritableError as closed:
            return _refused(unit, closed)
    sentence = str(error) if unit.name in str(error) else f"{unit.name}: {error}"
    said = (*unit.messages, sentence)
    state: State = "unwritten" if isinstance(error, NotWritableError) else "refused"
    return Outcome(unit.stage.name, unit.name, state, said, error.exit_code)


def lacking(unit: Unit) -> Outcome | None:
    """Why a unit cannot begin: what it reads is not there, or was refused."""
    stage, gone = unit.stage.name, unit.missing()
    if not gone:
        return None
    if _refused_upstream(unit):
        why = f"{unit.name}: left out of {stage}, since its input was refused"
        return Outcome(stage, unit.name, "waiting", (why,))
    first = producer(gone[0]).name
    why = f"{unit.name}: {stage} has no {', '.join(gone)} to read"
    return Outcome(stage, unit.name, "waiting", (f"{why}; run `bsip {first}` first",), 2)


def _refused_upstream(unit: Unit) -> bool:
    folders = [unit.out / participant.id for participant in unit.participants()]
    return any(any(folder.glob("*_refusal-*.parquet")) for folder in folders)


def _write_refusal(unit: Unit, error: BsipError) -> None:
    kind = "numerical failure" if isinstance(error, NumericalError) else "bad data"
    row = pd.DataFrame([{"stage": unit.stage.name, "kind": kind, "sentence": str(error)}])
    notes = {"made_by": unit.made_by, "messages": list(unit.messages), "facts": {}}
    write_artifact(unit.refusal_path(), "refusal", row, notes)


def _bug(name: str, stages: tuple[Stage, ...], error: BaseException) -> Outcome:
    stage = stages[0].name if len({stage.name for stage in stages}) == 1 else "run"
    if isinstance(error, BrokenProcessPool):
        found = "the process was killed (out of memory?); run again, with fewer --jobs"
    else:
        trace = str(error.__cause__ or "").strip('"\n')
        found = f"a bug in bsip: {type(error).__name__}: {error}\n{trace}".rstrip()
    return Outcome(stage, name, "bug", (f"{name}: {found}",), 1)


def refusal_sentence(refusals: list[BadDataError]) -> Iterator[Outcome]:
    """Outcomes for participants that could not even be listed."""
    for refusal in refusals:
        yield Outcome("study", "study", "refused", (str(refusal),), refusal.exit_code)
