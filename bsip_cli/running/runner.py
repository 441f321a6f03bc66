"""Run stages over a study: skip what is fresh, write down what is refused, go on with the rest."""

from __future__ import annotations

import hashlib
import signal
import time
import traceback
from collections.abc import Callable, Collection, Generator, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import pandas as pd

from bsip_cli import errors
from bsip_cli.artifacts import (
    held_alone,
    read_artifact,
    read_header,
    remove,
    write_artifact,
    write_bytes,
)
from bsip_cli.config import Config
from bsip_cli.files import fingerprints
from bsip_cli.pipeline import STAGES, Stage, by_level, in_turn, producer, upstream
from bsip_cli.running.processes import Died, end_if_asked, work_on
from bsip_cli.running.unit import Unit, code_hash, library_versions
from bsip_cli.schemas import SCHEMAS
from bsip_cli.study.study import Participant, Study
from bsip_cli.study.trials import listed

_MOVED = "what all persons together show has moved"
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

    @property
    def owner(self) -> str:
        """The participant whom the unit is about, or ``group``."""
        return self.unit.split("_")[0]


@dataclass(frozen=True)
class _Task:
    """Stages of one participant, or of the cohort; ``doubtful``: whose results may be stale;
    ``part``: the first or last of all stages about one participant, or some of them."""

    stages: tuple[Stage, ...]
    study: Study
    out: Path
    config: Config
    force: bool
    verify: bool
    participant: Participant | None = None
    doubtful: frozenset[str] = frozenset()
    part: str = "some"

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
    stages: tuple[Stage, ...],
    study: Study,
    out: Path,
    config: Config,
    jobs: int,
    force: bool = False,
    verify: bool = False,
) -> Generator[Outcome, None, None]:
    """Run ``stages`` participant by participant and those of the cohort in turn; yield what became.

    ``force`` redoes what is fresh, ``verify`` hashes every file again, ``jobs`` participants run at
    once, each in a process of its own.

    EndedError: a signal asked this process or one of its workers to end.
    """
    personal, _ = by_level(stages)
    whole = all(stage in personal for stage in by_level(STAGES)[0])
    how = (out, config, force, verify)
    troubled: set[str] = set()
    for mine in in_turn(stages):
        if mine[0].level == "cohort":
            doubtful = troubled if whole else {one.id for one in study.participants}
            yield from _outcomes([_Task(mine, study, *how, doubtful=frozenset(doubtful))], 1)
            continue
        part = ("last" if personal[-1] in mine else "first") if whole else "some"
        alone = (  # all that a process needs to know
            _Task(mine, Study(study.root, (one,)), *how, one, part=part)
            for one in study.participants
        )
        for outcome in _outcomes(alone, jobs):
            troubled |= {outcome.owner} if outcome.exit_code else set()
            yield outcome


def _outcomes(tasks: Iterable[_Task], jobs: int) -> Iterator[Outcome]:
    for result in work_on(tasks, _run, jobs, _tidy):
        if isinstance(result, Died):
            task, code = result.task, result.exit_code or 0
            stage = task.stages[0].name if len({s.name for s in task.stages}) == 1 else "run"
            ending = signal.Signals(-code).name if code < 0 else f"exit code {code}"
            killed = code == -signal.SIGKILL
            how = _SHORT_OF_MEMORY if killed else f"the process crashed ({ending})"
            yield Outcome(stage, task.name, "bug", (f"{task.name}: {how}",), 1)
        else:
            yield result


def _tidy(task: _Task) -> None:
    """Take away what a killed process left half written, unless another bsip is at it by now."""
    with suppress(errors.UsageError, OSError), held_alone(task.folder):
        pass  # what cannot be taken away now, the next run takes


def _run(task: _Task) -> Iterator[Outcome]:
    try:
        with held_alone(task.folder):
            if _is_unchanged(task):
                for unit in task.units(task.study, {}):
                    yield Outcome(unit.stage.name, unit.name, "fresh")
                return
            is_true = True
            for outcome in _run_alone(task):
                is_true &= outcome.state in ("done", "fresh")
                yield outcome
            time.sleep(fingerprints.STEP_S)  # for what was written last to have its own time
            state = _state(task) if is_true and task.part == "last" else ""
            recordings = [task.study.root / task.participant.id] if task.participant else []
            kept = fingerprints.to_keep([task.folder, *recordings], state).encode()
            if fingerprints.kept_in(task.folder) != kept:
                write_bytes(task.folder / fingerprints.NAME, kept)
    except Exception as error:  # noqa: BLE001  a bug outside of the units stops one task only
        yield _failed(task.stages[0].name, task.name, error)


def _failed(stage: str, name: str, error: Exception) -> Outcome:
    """What to say of what stops a unit or a task; of a bug with its trace, for the report of it."""
    end_if_asked()
    if isinstance(error, OSError):
        error = errors.not_readable(error)
    if isinstance(error, errors.BsipError):
        sentence = str(error) if name in str(error) else f"{name}: {error}"
        return Outcome(stage, name, "refused", (sentence,), error.exit_code)
    if isinstance(error, MemoryError):
        return Outcome(stage, name, "bug", (f"{name}: {_SHORT_OF_MEMORY}",), 1)
    trace = "".join(traceback.format_exception(error)).strip()
    found = f"a bug in bsip: {type(error).__name__}: {errors.printable(str(error))}"
    return Outcome(stage, name, "bug", (f"{name}: {found}\n{trace}",), 1)


def _is_unchanged(task: _Task) -> bool:
    """Nothing has changed since all of a participant's results were found to be up to date."""
    fingerprints.forget_all()
    now = _state(task)
    if task.verify:
        return False
    for participant in task.study.participants:
        fingerprints.recall(task.out / participant.id)
    return fingerprints.recall(task.folder) == now != "" and not task.force


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
        outcome = perform(unit, task.force)
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
        if (waiting := lacking(unit)) is not None:
            return waiting
        why = why_stale(unit)  # asked first: a file that changes from here on makes it stale
        if not why and not force:
            return Outcome(stage.name, unit.name, "fresh")
        said = [f"{changed}: made again" for changed in was_changed(unit)]
        before = _files_beside(unit)
        stage.run(unit)
        for name in before - _files_beside(unit):  # a figure of what is no more to be said
            remove(unit.out / name)
        remove(unit.refusal_path())
    except Exception as error:  # noqa: BLE001  a bug in one unit leaves the others standing
        return _written_down(unit, error)
    seconds, reads = time.perf_counter() - start, tuple(unit.kinds_read())
    return Outcome(stage.name, unit.name, "done", (*said, *unit.messages), 0, seconds, reads)


def _written_down(unit: Unit, error: Exception) -> Outcome:
    """What stopped a unit, written into its folder, too, unless the data have no part in it; said
    after the unit's warnings."""
    if isinstance(error, OSError):
        error = errors.not_readable(error)
    outcome = _failed(unit.stage.name, unit.name, error)
    if not isinstance(error, errors.UsageError):
        kind, sentence = "bad data", str(error)
        if isinstance(error, errors.NumericalError):
            kind = "numerical failure"
        elif outcome.state == "bug":
            kind, sentence = "bug", outcome.sentences[0].splitlines()[0]
        row = pd.DataFrame([{"stage": unit.stage.name, "kind": kind, "sentence": sentence}])
        notes = {"made_by": unit.made_by, "messages": list(unit.messages), "facts": {}}
        try:
            write_artifact(unit.refusal_path(), "refusal", row, notes)
        except errors.NotWritableError as closed:
            return _written_down(unit, closed)
    if outcome.state == "bug":
        return outcome
    state: State = "unwritten" if isinstance(error, errors.NotWritableError) else "refused"
    return replace(outcome, state=state, sentences=(*unit.messages, *outcome.sentences))


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


def attempt(unit: Unit, work: Callable[[], Iterable[str]]) -> Outcome:
    """Do for a unit what is no stage; ``work`` gives what to say of it, after its messages."""
    if (waiting := lacking(unit, errors.BadDataError.exit_code)) is not None:
        return waiting
    try:
        said = [f"{unit.name}: {one}" for one in work()]
    except errors.BsipError as error:
        said = [*unit.messages, str(error)]
        return Outcome(unit.stage.name, unit.name, "refused", tuple(said), error.exit_code)
    return Outcome(unit.stage.name, unit.name, "done", (*unit.messages, *said))


# --- whether results are still true: by this code and these options, from what is there now -------


def why_stale(unit: Unit) -> str:
    """Why a unit has work to do, as a clause; empty if all that it writes is there and true.

    BadDataError: a file that it reads cannot be read.
    """
    if unit.refusal_path().exists():
        return "it was refused before"
    for kind in unit.stage.writes:
        if why := _why_not(unit, kind, "made_by"):
            return why
        if names := _changed_files(unit, kind):  # next to the artifact: pages, figures, tables
            return f"{names[0]} has changed since bsip wrote it"
    amended = (_why_not(unit, kind, "amended_by") for kind in unit.stage.amends)
    return next(filter(None, amended), "")


def was_changed(unit: Unit) -> list[str]:
    """Files that the unit has written and that are no more what it wrote, as clauses."""
    found = []
    for kind in unit.stage.writes:
        path = unit.path(kind)
        if not path.is_file():  # a folder in its place is reported when it is to be written
            continue
        try:
            read_header(path, kind)
        except errors.BadDataError as error:
            if not fingerprints.fingerprint(path).intact:  # else it is of another version of bsip
                found.append(f"{path.name} {error.found}")
            continue
        names = (name for name in _changed_files(unit, kind) if (unit.out / name).exists())
        found += [f"{name} has changed since bsip wrote it" for name in names]
    return found


def stale_upstream(unit: Unit, participant: Participant | None, stages: Collection[Stage]) -> str:
    """The first result of a participant, or of the group, on which ``stages`` build and that is no
    more true, and why; empty if all are."""
    own, of_group = {stage.label for stage in stages}, participant is None
    whole = unit.study, unit.out, unit.config_of_all, participant, unit.left_out
    for stage in upstream(stages, lambda one: one.inputs):
        if stage.label in own or (stage.level == "cohort") != of_group:
            continue
        for other in units_of(stage, *whole):
            refusal, kinds = other.refusal_path(), other.stage.writes
            if refusal.exists():  # what was refused as it stands, or is not there, is no lie
                made_by = read_header(refusal, "refusal")["provenance"]["made_by"]
                why = _differs(made_by, other.made_by)
            else:
                there = not other.missing() and any(other.path(kind).exists() for kind in kinds)
                why = why_stale(other) if there else ""
            if why and why != _MOVED:  # such a person counts in the group all the same
                return f"what `bsip {stage.name}` made of {other.name} is not up to date ({why})"
    return ""


def units_of(
    stage: Stage,
    study: Study,
    out: Path,
    config: Config,
    participant: Participant | None,
    left_out: Mapping[str, str],
) -> Iterator[Unit]:
    """A stage's units about a participant, or the group."""
    trials = participant.trials if participant and stage.level == "trial" else (None,)
    for trial in trials:
        yield Unit(stage, study, out, config, participant, trial, left_out=left_out)


def _why_not(unit: Unit, kind: str, maker: str) -> str:
    path = unit.path(kind)
    if not path.exists():
        return f"{path.name} is not there"
    try:
        provenance = read_header(path, kind)["provenance"]
    except errors.BadDataError as error:
        return f"{path.name} {error.found}"
    return _differs(provenance.get(maker), unit.made_by)


def _differs(known: Mapping[str, Any] | None, wanted: Mapping[str, Any]) -> str:
    """What two provenances do not have in common, as a clause."""
    if known == wanted:
        return ""
    if known is None:
        return "nothing was added to it yet"
    words = {
        "code": "the code or a shipped table has changed",
        "bsip_version": "the version of bsip has changed",
        "libraries": "the version of a library has changed",
    }
    for part, sentence in words.items():
        if known.get(part) != wanted[part]:
            return sentence
    options = _names(known["options"], wanted["options"])
    if options:
        return f"other options ({', '.join(options)})"
    inputs = _names(known["inputs"], wanted["inputs"])
    if all(name.endswith(" of the group") for name in inputs):
        return _MOVED
    return f"other input ({', '.join(inputs[:3])})"


def _names(one: Mapping[str, Any], other: Mapping[str, Any]) -> list[str]:
    return sorted(key for key in one.keys() | other.keys() if one.get(key) != other.get(key))


def _changed_files(unit: Unit, kind: str) -> list[str]:
    return [
        name
        for name, known in _files_listed_in(unit, kind).items()
        if not (path := unit.out / name).is_file() or fingerprints.file_hash(path) != known
    ]


def _files_beside(unit: Unit) -> set[str]:
    """Files that the unit has written next to its artifacts, as far as those can be read."""
    found: set[str] = set()
    for kind in unit.stage.writes:
        with suppress(errors.BadDataError):  # `was_changed` says so
            found |= _files_listed_in(unit, kind).keys()
    return found


def _files_listed_in(unit: Unit, kind: str) -> dict[str, str]:
    """By their paths below the folder of results, with their hashes."""
    if SCHEMAS[kind].column("sha256") is None or not (path := unit.path(kind)).is_file():
        return {}
    listed = read_artifact(path, kind)
    return dict(zip(listed["file"], listed["sha256"], strict=True))


def outdated(path: Path) -> str:
    """Why an artifact is no more true as far as the folder of results shows, without the study.

    Its code has changed, or an artifact that it was made from, or one that that was made from.

    BadDataError: it is missing, is no artifact or has changed since it was written.
    """
    waiting, seen = [path], set()
    while waiting:
        one = waiting.pop()
        header = read_header(one)
        made_by = header["provenance"]["made_by"]
        makers = [stage for stage in STAGES if header["kind"] in stage.writes]
        if made_by.get("code") != (code_hash(makers[0].module) if makers else ""):
            return f"{one.name} was made by other code"
        for name, known in made_by["inputs"].items():
            source = one.with_name(name)
            if source.suffix != ".parquet" or source.name in seen:
                continue
            if not source.exists() or fingerprints.file_hash(source) != known:
                return f"{one.name} was made from another {name}"
            seen.add(source.name)
            waiting.append(source)
    return ""
