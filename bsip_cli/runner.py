"""Run stages over a study: skip what is fresh, write down what is refused, go on with the rest."""

from __future__ import annotations

import importlib
import multiprocessing
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import pandas as pd

from bsip_cli.artifacts import write_artifact
from bsip_cli.config import Config
from bsip_cli.errors import BadDataError, BsipError, NumericalError
from bsip_cli.pipeline import Stage, producer
from bsip_cli.study import Participant, Study
from bsip_cli.unit import Unit

State = Literal["done", "fresh", "waiting", "refused", "bug"]


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
    participants: tuple[Participant, ...],
    *,
    force: bool,
    jobs: int,
) -> Iterator[Outcome]:
    """Run ``stages`` participant by participant, then those of the cohort; yield what became.

    ``force`` redoes what is fresh; ``jobs`` participants run at once, each in its own process.
    """
    personal = tuple(stage for stage in stages if stage.level != "cohort")
    with ProcessPoolExecutor(jobs, multiprocessing.get_context("spawn")) as pool:
        running = {
            participant.id: pool.submit(
                _run_participant, personal, study, out, config, participant, force
            )
            for participant in participants
            if personal
        }
        for name, future in running.items():
            bug = future.exception()
            if bug is not None:
                yield _bug(name, bug)
            else:
                yield from future.result()
    for stage in stages:
        if stage.level == "cohort":
            yield perform(Unit(stage, study, out, config), force)


def _run_participant(
    stages: Iterable[Stage],
    study: Study,
    out: Path,
    config: Config,
    participant: Participant,
    force: bool,
) -> list[Outcome]:
    outcomes = []
    for stage in stages:
        trials = participant.trials if stage.level == "trial" else (None,)
        for trial in trials:
            outcomes.append(perform(Unit(stage, study, out, config, participant, trial), force))
    return outcomes


def perform(unit: Unit, force: bool = False) -> Outcome:
    """Do one unit unless it is fresh or lacks its inputs."""
    stage = unit.stage
    gone = unit.missing()
    if gone:
        first = producer(gone[0]).name
        why = f"{unit.name}: {stage.name} has no {', '.join(gone)} to read"
        if _refused_upstream(unit):
            return Outcome(stage.name, unit.name, "waiting", (f"{why}: refused before",))
        return Outcome(stage.name, unit.name, "waiting", (f"{why}; run `bsip {first}` first",), 2)
    if not force and unit.is_fresh():
        return Outcome(stage.name, unit.name, "fresh")
    try:
        importlib.import_module(stage.module).run(unit)
    except BsipError as error:
        _write_refusal(unit, error)
        sentence = str(error) if unit.name in str(error) else f"{unit.name}: {error}"
        return Outcome(stage.name, unit.name, "refused", (sentence,), error.exit_code)
    unit.refusal_path().unlink(missing_ok=True)
    return Outcome(stage.name, unit.name, "done", tuple(unit.messages))


def _refused_upstream(unit: Unit) -> bool:
    folders = [unit.out / participant.id for participant in unit.participants()]
    return any(any(folder.glob("*_refusal-*.parquet")) for folder in folders)


def _write_refusal(unit: Unit, error: BsipError) -> None:
    kind = "numerical failure" if isinstance(error, NumericalError) else "bad data"
    row = pd.DataFrame([{"stage": unit.stage.name, "kind": kind, "sentence": str(error)}])
    notes = {"made_by": unit.provenance(), "messages": [], "facts": {}}
    write_artifact(unit.refusal_path(), "refusal", row, notes)


def _bug(participant: str, error: BaseException) -> Outcome:
    trace = getattr(error, "__cause__", None) or error
    return Outcome("run", participant, "bug", (f"{participant}: a bug in bsip: {trace}",), 1)


def refusal_sentence(refusals: list[BadDataError]) -> Iterator[Outcome]:
    """Outcomes for participants that could not even be listed."""
    for refusal in refusals:
        yield Outcome("study", "study", "refused", (str(refusal),), refusal.exit_code)
