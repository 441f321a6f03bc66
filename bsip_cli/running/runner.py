"""Run stages over a study: skip what is fresh, write down what is refused, go on with the rest."""

from __future__ import annotations

import fcntl
import hashlib
import signal
import time
import traceback
from collections.abc import Generator, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import pandas as pd

from bsip_cli import errors
from bsip_cli.artifacts import remove, remove_unfinished, write_artifact, write_bytes
from bsip_cli.config import Config
from bsip_cli.files import fingerprints
from bsip_cli.pipeline import STAGES, Stage, by_level, in_turn, producer
from bsip_cli.running.freshness import stale_upstream, units_of, was_changed, why_stale
from bsip_cli.running.processes import Died, end_if_asked, work_on
from bsip_cli.running.unit import Unit, code_hash, library_versions
from bsip_cli.schemas import SCHEMAS
from bsip_cli.study.study import Participant, Study
from bsip_cli.study.trials import listed

LOCK = ".lock"
_SHORT_OF_MEMORY = "the process was killed (out of memory?); run again, with fewer --jobs"

State = Literal["done", "fresh", "waiting", "refused", "unwritten", "bug", "noted"]


@dataclass(frozen=True)
class Outcome:
    """What became of one unit; ``reads``: kinds of artifacts and recordings, of one that was done,
    in so many ``seconds``."""

    stage: str
    unit: str
    state: State
    sentences: tuple[str, ...] = ()
    exit_code: int = 0
    seconds: float = 0.0
    reads: tuple[str, ...] = ()


@dataclass(frozen=True)
class Manner:
    """How stages are run: ``force`` redoes what is fresh, ``verify`` hashes every file again,
    ``jobs`` participants run at once, each in a process of its own."""

    force: bool = False
    verify: bool = False
    jobs: int = 1


_Part = Literal["first", "last", "some"]  # of all stages about one participant


@dataclass(frozen=True)
class _Task:
    """Stages of one participant, or of the cohort; ``doubtful``: whose results may be stale."""

    stages: tuple[Stage, ...]
    study: Study
    out: Path
    config: Config
    manner: Manner
    participant: Participant | None = None
    doubtful: frozenset[str] = frozenset()
    part: _Part = "some"

    @property
    def name(self) -> str:
        return self.participant.id if self.participant else "group"

    @property
    def folder(self) -> Path:
        return self.out / self.name

    def units(self, study: Study, left_out: Mapping[str, str]) -> Iterator[Unit]:
        """In order."""
        for stage in self.stages:
            yield from units_of(stage, study, self.out, self.config, self.participant, left_out)


def run_stages(
    stages: tuple[Stage, ...], study: Study, out: Path, config: Config, manner: Manner
) -> Generator[Outcome, None, None]:
    """Run ``stages`` participant by participant and those of the cohort in turn; yield what became.

    EndedError: a signal asked this process or one of its workers to end.
    """
    personal, _ = by_level(stages)
    whole = all(stage in personal for stage in by_level(STAGES)[0])
    troubled: set[str] = set()
    for mine in in_turn(stages):
        if mine[0].level == "cohort":
            doubtful = troubled if whole else {one.id for one in study.participants}
            group = _Task(mine, study, out, config, manner, doubtful=frozenset(doubtful))
            yield from (outcome for _, outcome in _outcomes([group], 1))
            continue
        part: _Part = ("last" if personal[-1] in mine else "first") if whole else "some"
        alone = (  # all that a process needs to know
            _Task(mine, Study(study.root, (one,)), out, config, manner, one, part=part)
            for one in study.participants
        )
        for owner, outcome in _outcomes(alone, manner.jobs):
            troubled |= {owner} if outcome.exit_code else set()
            yield outcome


def _outcomes(tasks: Iterable[_Task], jobs: int) -> Iterator[tuple[str, Outcome]]:
    for result in work_on(tasks, _run, jobs, _tidy):
        if isinstance(result, Died):
            task, code = result.task, result.exit_code or 0
            stage = task.stages[0].name if len({s.name for s in task.stages}) == 1 else "run"
            ending = signal.Signals(-code).name if code < 0 else f"exit code {code}"
            killed = code == -signal.SIGKILL
            how = _SHORT_OF_MEMORY if killed else f"the process crashed ({ending})"
            yield task.name, Outcome(stage, task.name, "bug", (f"{task.name}: {how}",), 1)
        else:
            yield result


def _tidy(task: _Task) -> None:
    """Take away what a killed process left half written, unless another bsip is at it by now."""
    with suppress(errors.UsageError, OSError), held_alone(task.folder):
        pass  # what cannot be taken away now, the next run takes


def _run(task: _Task) -> Iterator[tuple[str, Outcome]]:
    try:
        with held_alone(task.folder):
            if _is_unchanged(task):
                for unit in task.units(task.study, {}):
                    yield task.name, Outcome(unit.stage.name, unit.name, "fresh")
                return
            is_true = True
            for outcome in _run_alone(task):
                is_true &= outcome.state in ("done", "fresh")
                yield task.name, outcome
            time.sleep(fingerprints.STEP_S)  # for what was written last to have its own time
            state = _state(task) if is_true and task.part == "last" else ""
            recordings = [task.study.root / task.participant.id] if task.participant else []
            kept = fingerprints.to_keep([task.folder, *recordings], state).encode()
            if fingerprints.kept_in(task.folder) != kept:
                write_bytes(task.folder / fingerprints.NAME, kept)
    except errors.BsipError as error:
        yield task.name, _stopped(task, error)
    except OSError as error:
        yield task.name, _stopped(task, errors.not_readable(error))
    except Exception as error:  # noqa: BLE001  a bug outside of the units stops one task only
        yield task.name, _bug(task.stages[0].name, task.name, error)


def _stopped(task: _Task, error: errors.BsipError) -> Outcome:
    sentence = str(error) if task.name in str(error) else f"{task.name}: {error}"
    return Outcome(task.stages[0].name, task.name, "refused", (sentence,), error.exit_code)


def _is_unchanged(task: _Task) -> bool:
    """Nothing has changed since all of a participant's results were found to be up to date."""
    fingerprints.forget_all()
    now = _state(task)
    if task.manner.verify:
        return False
    folders = [task.out / participant.id for participant in task.study.participants]
    notes = [fingerprints.recall(folder) for folder in [task.folder, *folders]]
    return notes[0] == now != "" and not task.manner.force


def _state(task: _Task) -> str:
    """All that decides whether a participant's results are up to date, as a hash; of all stages."""
    if task.participant is None or task.part == "some":
        return ""
    named = (Path(task.config.marker_set), Path(task.config.skeleton))
    options = [path for path in named if path.suffix == ".toml"]
    recordings = [file for trial in task.participant.trials for file in trial.files]
    stages = by_level(STAGES)[0]
    kinds = {k for stage in stages for k in stage.inputs if SCHEMAS[k].level == "cohort"}
    group = [task.out / "group" / f"group_{SCHEMAS[k].file_name}.parquet" for k in sorted(kinds)]
    of_all = [path for path in group if path.exists()]
    files = fingerprints.snapshot(task.folder, [*recordings, *options, *of_all])
    code = [code_hash(stage.module) for stage in stages]
    facts = (files, code, library_versions(), task.config.model_dump_json(), task.participant)
    return hashlib.sha256(repr(facts).encode()).hexdigest() if files else ""


def _run_alone(task: _Task) -> Iterator[Outcome]:
    """Unit by unit; what cannot be written ends it, else the rest would be made without it. Who is
    not up to date is left out of the group; and a word is said where stages that are run alone
    build on what is not."""
    study, left_out = task.study, dict[str, str]()
    if task.participant is not None:
        _forget_gone_recordings(task.folder, task.participant)
    else:
        like, people = next(task.units(study, {})), study.participants
        doubtful = (one for one in people if one.id in task.doubtful)
        found = {one.id: stale_upstream(like, one, task.stages) for one in doubtful}
        left_out = {name: why for name, why in found.items() if why}
        study = Study(study.root, tuple(one for one in people if one.id not in left_out))
        for why in dict.fromkeys(left_out.values()):
            whose = listed(name for name, its_own in left_out.items() if its_own == why)
            said = (f"{whose}: left out of the group, since {why}; run `bsip run` first",)
            stage, code = task.stages[0].name, errors.BadDataError.exit_code
            yield Outcome(stage, "group", "refused", said, code)
    units = list(task.units(study, left_out))
    if why := stale_upstream(units[0], task.participant, task.stages):
        said = (f"{task.name}: {why}; `bsip run` brings it up to date",)
        yield Outcome(task.stages[0].name, task.name, "noted", said)
    for unit in units:
        outcome = perform(unit, task.manner.force)
        yield outcome
        if outcome.state == "unwritten":
            return


def _forget_gone_recordings(folder: Path, participant: Participant) -> None:
    """A recording that was refused and then taken out of the study counts no more."""
    known = {participant.id, *(trial.stem for trial in participant.trials)}
    for path in folder.glob("*_refusal-*.parquet"):
        if path.name.split("_refusal-")[0] not in known:
            remove(path)


def perform(unit: Unit, force: bool = False) -> Outcome:
    """Do one unit unless it is fresh or lacks its inputs; its bug is written down, too."""
    end_if_asked()
    stage, start = unit.stage, time.perf_counter()
    try:
        waiting = lacking(unit)
        if waiting is not None:
            return waiting
        why = why_stale(unit)  # asked first: a file that changes from here on makes it stale
        if not why and not force:
            return Outcome(stage.name, unit.name, "fresh")
        said = [f"{changed}: made again" for changed in was_changed(unit)]
        stage.run(unit)
        remove(unit.refusal_path())
    except errors.BsipError as error:
        return _refused(unit, error)
    except OSError as error:
        return _refused(unit, errors.not_readable(error))
    except Exception as error:  # noqa: BLE001  a bug in one unit leaves the others standing
        bug = _bug(stage.name, unit.name, error)
        _write_refusal(unit, "bug", bug.sentences[0].splitlines()[0])
        return bug
    seconds, reads = time.perf_counter() - start, tuple(unit.kinds_read())
    return Outcome(stage.name, unit.name, "done", (*said, *unit.messages), 0, seconds, reads)


def _refused(unit: Unit, error: errors.BsipError) -> Outcome:
    """Write down what is wrong with the data; say what is wrong, after the unit's warnings."""
    end_if_asked()
    if not isinstance(error, errors.UsageError):
        try:
            kind = "numerical failure" if isinstance(error, errors.NumericalError) else "bad data"
            _write_refusal(unit, kind, str(error))
        except errors.NotWritableError as closed:
            return _refused(unit, closed)
    sentence = str(error) if unit.name in str(error) else f"{unit.name}: {error}"
    said = (*unit.messages, sentence)
    state: State = "unwritten" if isinstance(error, errors.NotWritableError) else "refused"
    return Outcome(unit.stage.name, unit.name, state, said, error.exit_code)


def lacking(unit: Unit, refused_code: int = 0) -> Outcome | None:
    """Why a unit cannot begin: what it reads is not there, or was refused, which ends in that exit
    code."""
    stage, gone = unit.stage.name, unit.missing()
    people, code = unit.participants(), refused_code
    if people and not gone:
        return None
    if not people:
        why = f"nobody is left for {stage}"
    elif any(any((unit.out / one.id).glob("*_refusal-*.parquet")) for one in people):
        why = f"left out of {stage}, since its input was refused"
    else:
        first, code = producer(gone[0]).name, 2
        why = f"{stage} has no {', '.join(gone)} to read; run `bsip {first}` first"
    return Outcome(stage, unit.name, "waiting", (f"{unit.name}: {why}",), code)


def _write_refusal(unit: Unit, kind: str, sentence: str) -> None:
    row = pd.DataFrame([{"stage": unit.stage.name, "kind": kind, "sentence": sentence}])
    notes = {"made_by": unit.made_by, "messages": list(unit.messages), "facts": {}}
    write_artifact(unit.refusal_path(), "refusal", row, notes)


def _bug(stage: str, name: str, error: Exception) -> Outcome:
    """What to say of an exception that nobody foresaw, with its trace for the report of a bug."""
    end_if_asked()
    if isinstance(error, MemoryError):
        return Outcome(stage, name, "bug", (f"{name}: {_SHORT_OF_MEMORY}",), 1)
    trace = "".join(traceback.format_exception(error)).strip()
    found = f"a bug in bsip: {type(error).__name__}: {errors.printable(str(error))}"
    return Outcome(stage, name, "bug", (f"{name}: {found}\n{trace}",), 1)


# --- only one program at a time writes into a folder of results -------------------------------


@contextmanager
def held_alone(folder: Path) -> Iterator[None]:
    """Hold a folder's lock; the system lets go of it whatever becomes of the process.

    What killed processes left half written there is taken away.

    UsageError: another process holds it, or the folder cannot be written to.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        handle = (folder / LOCK).open("a")
    except OSError as error:
        raise errors.not_writable(folder, error) from None
    with handle:
        try:
            fcntl.flock(handle.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise errors.UsageError(
                "another bsip is writing there",
                file=folder,
                remedy="wait until it has ended, and run again",
            ) from None
        except OSError as error:
            raise errors.not_writable(folder, error) from None
        remove_unfinished(folder)
        yield
