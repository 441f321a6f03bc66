"""One call of a stage command: load the study, run, tell the user, decide the exit code."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Generator, Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import click
from tqdm import tqdm

from bsip_cli.body.markersets import load_marker_set
from bsip_cli.body.skeleton import load_skeleton
from bsip_cli.config import Config, load_config, with_estimators
from bsip_cli.errors import BadDataError, UsageError, printable
from bsip_cli.pipeline import Stage, by_level, stages_named
from bsip_cli.running.runner import Manner, Outcome, refusal_sentence, run_stages
from bsip_cli.study.dataset import describe_dataset, make_out
from bsip_cli.study.named_in_options import check_prefixes, check_segments, check_trials
from bsip_cli.study.study import Study, load_study
from bsip_cli.study.trials import listed

_SEVERITY = (0, 3, 4, 2, 1)  # of several exit codes the gravest counts


def run_session(
    command: str,
    root: Path,
    out: Path,
    chosen: tuple[str, ...],
    config_file: Path | None,
    *,
    jobs: int,
    force: bool,
    verify: bool = False,
    estimators: tuple[str, ...] = (),
    group: bool = False,
    until: str | None = None,
) -> int:
    """Run a command's stages on a study and return the exit code.

    ``estimators`` stand for the configured ones, unless empty; ``group`` leaves out what is
    about one participant; ``until`` is the last stage; ``verify`` hashes every file, also where its
    times have not changed.
    """
    stages = _stages(command, chosen, group, until)
    if any(stage.level == "cohort" for stage in stages):
        chosen = ()  # what is about all needs all
    opened = open_study(root, out, chosen, config_file, estimators)
    notes = [describe_dataset(out, opened.study.root)]
    if not chosen:
        notes.append(_left_behind(out, opened.study))
    refusals = (*opened.refusals, *_notes(*notes))
    participants = opened.study.participants
    manner = Manner(force=force, verify=verify, jobs=jobs)
    running = run_stages(stages, opened.study, out, opened.config, manner)
    total = sum(
        1
        if s.level == "cohort"
        else sum(len(p.trials) if s.level == "trial" else 1 for p in participants)
        for s in stages
    )
    return follow(command, refusals, running, total, out)


def _stages(
    command: str, chosen: tuple[str, ...], group: bool, until: str | None
) -> tuple[Stage, ...]:
    """A command's stages, without those of the group for some participants, or these alone."""
    if group and chosen:
        raise UsageError("--group is about all participants", remedy="leave out --participant")
    stages = stages_named(command)
    if until is not None:
        stages = stages[: 1 + max(k for k, one in enumerate(stages) if one.name == until)]
    personal, of_all = by_level(stages)
    if group:
        return of_all
    return personal or of_all if chosen else stages


@dataclass(frozen=True)
class OpenedStudy:
    """A study as a command meets it: its chosen participants, and who or what is not used."""

    study: Study
    config: Config
    refusals: tuple[Outcome, ...]


def open_study(
    root: Path,
    out: Path,
    chosen: tuple[str, ...],
    config_file: Path | None,
    estimators: tuple[str, ...] = (),
) -> OpenedStudy:
    """Read configuration and study, and make sure that there is a folder for the results.

    Raises
    ------
    UsageError
        An option, the study, a participant or the folder is not what it should be.
    BadDataError
        participants.tsv cannot be used.
    """
    config = with_estimators(_config(root, config_file), estimators)
    roles = config.roles.model_dump()
    study, refusals = load_study(root, roles, chosen)
    if config.loads or config.ingest.prefixes:
        whole = load_study(root, roles) if chosen else (study, refusals)
        _check_names(config, *whole)
    make_out(out, root)
    return OpenedStudy(study, config, (*_notes(*study.notes), *refusal_sentence(refusals)))


def _check_names(config: Config, study: Study, refusals: list[BadDataError]) -> None:
    """Whether loads and prefixes name who and what is there, in the whole study."""
    if not refusals:  # else a load may belong to who or what was refused
        check_trials(config.loads, study)
        check_prefixes(config.ingest.prefixes, study)


def _left_behind(out: Path, study: Study) -> str:
    """Whose results lie there who are no more in the study."""
    known = {participant.id for participant in study.participants}
    gone = [path.name for path in sorted(out.glob("sub-*/*_skeleton.parquet"))]
    names = sorted({name.split("_")[0] for name in gone} - known)
    whose = f"results of {listed(names)}, not of this study as it is now: they do not count"
    return f"{out}: holds {whose}" if names else ""


def _notes(*sentences: str) -> Iterator[Outcome]:
    """Of what is no fault: it is said, and the exit code stays."""
    for sentence in filter(None, sentences):
        yield Outcome("study", "study", "noted", (printable(sentence),))


def follow(
    command: str,
    refusals: Iterable[Outcome],
    running: Generator[Outcome, None, None],
    total: int,
    out: Path | None,
) -> int:
    """Tell the user what becomes of the units, with a bar of ``total`` steps; the exit code.

    ``out``: the results' folder, None if they are not kept.
    """
    outcomes = list(refusals)
    for outcome in outcomes:
        _tell(outcome)
    bar = tqdm(total=total, desc=command, unit="unit", disable=None)
    with bar as progress, closing(running):  # whatever happens here, no process goes on
        for outcome in running:
            outcomes.append(outcome)
            progress.update(outcome.state != "noted")
            _tell(outcome)
    _summary(command, outcomes, out)
    return _exit_code(outcomes)


def _config(root: Path, config_file: Path | None) -> Config:
    if config_file is not None and not config_file.is_file():
        raise UsageError("there is no such file", file=config_file, remedy="check --config")
    config = load_config([root / "study.toml", *([config_file] if config_file else [])])
    config = config.model_copy(
        update={name: _own_file(root, getattr(config, name)) for name in ("marker_set", "skeleton")}
    )
    if config.marker_set != "auto":
        load_marker_set(config.marker_set)
    check_segments(config.loads, load_skeleton(config.skeleton))
    return config


def _own_file(root: Path, name: str) -> str:
    """A user's own TOML file lies in the study, or where the command was given."""
    in_study = root / name
    return str(in_study) if name.endswith(".toml") and in_study.is_file() else name


def _tell(outcome: Outcome) -> None:
    for sentence in outcome.sentences:
        lines = sentence.split("\n") if outcome.state == "bug" else [sentence]  # with its trace
        tqdm.write(f"{outcome.stage}: " + "\n".join(map(printable, lines)), file=sys.stderr)


def _summary(command: str, outcomes: Iterable[Outcome], out: Path | None) -> None:
    states: Counter[str] = Counter(outcome.state for outcome in outcomes)
    words = {
        "done": "done",
        "fresh": "up to date",
        "refused": "refused",
        "unwritten": "not to be written",
        "waiting": "without input",
        "bug": "failed by a bug",
    }
    said = ", ".join(f"{states[state]} {word}" for state, word in words.items() if states[state])
    where = f"; results in {printable(str(out))}" if out else ""
    click.echo(f"bsip {command}: {said or 'nothing to do'}{where}", err=True)


def _exit_code(outcomes: Iterable[Outcome]) -> int:
    return max((outcome.exit_code for outcome in outcomes), key=_SEVERITY.index, default=0)
