"""One call of a stage command: load the study, run, report to the user, decide the exit code."""

from __future__ import annotations

import re
import sys
from collections import Counter
from collections.abc import Callable, Collection, Generator, Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import click
from tqdm import tqdm

from bsip_cli.body.markersets import load_marker_set
from bsip_cli.body.skeleton import load_skeleton
from bsip_cli.config import Config, Load, load_config
from bsip_cli.errors import UsageError, did_you_mean, printable
from bsip_cli.pipeline import FINDINGS, Stage, by_level, cost_s, stages_named
from bsip_cli.running.runner import Outcome, run_stages
from bsip_cli.study.study import Study, describe_dataset, load_study, make_out
from bsip_cli.study.trials import listed

_LOADS = "correct [[loads]] in study.toml"
_PART = "_(ses|task|tracksys|run)-"
_NAME = rf"sub-[A-Za-z0-9]+({_PART}[A-Za-z0-9]+)*"  # of a person or a recording
_IN_A_PATH = rf"(?<=/){_NAME}|{_NAME}(?=[/_.][A-Za-z])(?!{_PART})"  # or of a file
_TIME = r"\d+\.\d+ to \d+\.\d+ s"
_TIMES = rf"{_TIME}(, {_TIME})*( and \d+ more)?"
_BAR = "{desc}: {percentage:3.0f}%|{bar}| {elapsed} gone, about {remaining} left"
_SEVERITY = (0, 3, 4, 2, 1)  # of several exit codes the gravest counts


def run_session(
    command: str,
    study: Path,
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
    **voice: bool,
) -> int:
    """Run a command's stages on a study and return the exit code.

    ``estimators`` stand for the configured ones, unless empty; ``group`` leaves out what is
    about one participant; ``until`` is the last stage; ``verify`` hashes every file, also where
    its times have not changed; ``voice`` as `follow` takes it.
    """
    stages = _stages(command, chosen, group, until)
    if any(stage.level == "cohort" for stage in stages):
        chosen = ()  # what is about all needs all
    opened = open_study(study, out, chosen, config_file, estimators)
    notes = [describe_dataset(out, opened.study.root)]
    if not chosen:
        notes.append(_left_behind(out, opened.study))
    refusals = (*opened.refusals, *_notes(*notes))
    whole = (stages, opened.study, out, opened.config)
    running = run_stages(*whole, force=force, verify=verify, jobs=jobs)
    trials = {p.id: len(p.trials) for p in opened.study.participants}
    units = {"cohort": [1], "participant": trials.values(), "trial": [1] * sum(trials.values())}
    total = sum(cost_s(s.name, s.level, n) for s in stages for n in units[s.level])

    def cost(outcome: Outcome) -> float:
        level = "cohort" if outcome.unit == "group" else "participant"
        level = "trial" if "_task-" in outcome.unit else level
        return cost_s(outcome.stage, level, trials.get(outcome.unit, 1))

    return follow(command, refusals, running, total, out, cost, **voice)


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

    UsageError: an option, the study, a participant or the folder is not what it should be.
    BadDataError: participants.tsv cannot be used.
    """
    config = _config(root, config_file, estimators)
    roles = config.roles.model_dump()
    study, refusals = load_study(root, roles, chosen)
    if config.loads or config.ingest.prefixes:
        whole, refused = load_study(root, roles) if chosen else (study, refusals)
        if not refused:  # else a load may belong to who or what was refused
            _check_trials(config.loads, whole)
            known = [participant.id for participant in whole.participants]
            remedy = "correct [ingest] prefixes in study.toml"
            _check_known("ingest.prefixes", config.ingest.prefixes, known, remedy)
    make_out(out, root)
    outcomes = (
        Outcome("study", "study", "refused", (str(one),), one.exit_code) for one in refusals
    )
    return OpenedStudy(study, config, (*_notes(*study.notes), *outcomes))


def _left_behind(out: Path, study: Study) -> str:
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
    total: float,
    out: Path | None,
    cost: Callable[[Outcome], float] = lambda outcome: 1.0,
    /,
    **how: bool,
) -> int:
    """Report to the user what becomes of the units, with a bar of ``total`` steps; the exit code.

    ``cost``: how many steps a unit is; what need not be done takes its steps from the total, so
    that the time left is that of what is done. ``out``: the results' folder, None if they are not
    kept. ``verbose``: of each unit what it read and how long it took. ``quiet``: findings and
    errors only.
    """
    outcomes, voice = list(refusals), _Voice(**how)
    for outcome in outcomes:
        voice.report(outcome)
    off = True if voice.quiet else None  # None: where nobody watches
    bar = tqdm(total=total, desc=command, bar_format=_BAR, smoothing=0, disable=off)
    with bar as progress, closing(running):  # whatever happens here, no process goes on
        for outcome in running:
            outcomes.append(outcome)
            steps, is_idle = cost(outcome), outcome.state in ("fresh", "waiting")
            progress.total -= steps if is_idle else 0
            progress.update(0 if is_idle or outcome.state == "noted" else steps)
            voice.report(outcome)
    voice.report_the_others()
    if not voice.quiet:
        _summary(command, outcomes, out)
    return max((outcome.exit_code for outcome in outcomes), key=_SEVERITY.index, default=0)


@dataclass
class _Voice:
    """What the user hears; a remark that many recordings get is made once, and at the end it is
    said of which others it is true, and from which stages a refusal kept whom."""

    verbose: bool = False
    quiet: bool = False
    said: dict[tuple[str, str], dict[str, list[str]]] = field(init=False, default_factory=dict)
    kept_from: dict[str, list[str]] = field(init=False, default_factory=dict)  # by person

    def report(self, outcome: Outcome) -> None:
        if outcome.state == "waiting" and not outcome.exit_code:
            stages = self.kept_from.setdefault(outcome.owner, [])
            stages += [outcome.stage] if outcome.stage not in stages else []
            return
        is_finding = outcome.exit_code != 0 or outcome.stage in FINDINGS
        for sentence in outcome.sentences if is_finding or not self.quiet else ():
            whose = match.group() if (match := re.search(_NAME, sentence)) else outcome.unit
            general = re.sub(_NAME, partial(_named, whose), re.sub(_IN_A_PATH, "...", sentence))
            if outcome.stage == "ingest":  # whose quality table has the times
                general = re.sub(_TIMES, "at times", general)
            alike = self.said.setdefault((outcome.stage, general), {})
            is_of_the_first = next(iter(alike), whose) == whose
            if is_finding or (is_of_the_first and sentence not in alike.get(whose, ())):
                _say(outcome, sentence)
            if not is_finding:
                alike.setdefault(whose, []).append(sentence)
        if self.verbose and outcome.state == "done":
            what = f"{outcome.seconds:.1f} s; read {', '.join(outcome.reads)}"
            _say(outcome, f"{outcome.unit}: {what}")

    def report_the_others(self) -> None:
        for (stage, sentence), units in self.said.items():
            if len(units) > 1:
                others = f"the same of {listed([*units][1:])}: {sentence.removeprefix('it: ')}"
                tqdm.write(f"{stage}: {others}", file=sys.stderr)
        kept: dict[str, list[str]] = {}
        for name, stages in self.kept_from.items():
            kept.setdefault(", ".join(stages), []).append(name)
        for which, names in kept.items():
            said = f"{listed(sorted(names))}: left out of {which}, since an input was refused"
            tqdm.write(said, file=sys.stderr)


def _named(whose: str, match: re.Match[str]) -> str:
    """A name in what is said of ``whose``, as it may be said of others alike."""
    if (name := match.group()) == whose:
        return "it"
    return "one of its trials" if name.startswith(f"{whose}_") else "another trial"


def _say(outcome: Outcome, sentence: str) -> None:
    lines = sentence.split("\n") if outcome.state == "bug" else [sentence]  # with its trace
    text = "\n".join(map(printable, lines))
    tqdm.write(f"{outcome.stage}: {text}", file=sys.stderr)


def _config(root: Path, config_file: Path | None, estimators: tuple[str, ...]) -> Config:
    if config_file is not None and not config_file.is_file():
        raise UsageError("there is no such file", file=config_file, remedy="check --config")
    files = [root / "study.toml", *([config_file] if config_file else [])]
    config = load_config(files, estimators)
    for option in ("marker_set", "skeleton"):  # a user's own file lies in the study, or here
        in_study = root / (name := getattr(config, option))
        if name.endswith(".toml") and in_study.is_file():
            config = config.model_copy(update={option: str(in_study)})
    if config.marker_set != "auto":
        load_marker_set(config.marker_set)
    with_mass = load_skeleton(config.skeleton).body_names
    for k, load in enumerate(config.loads):
        _check_known(f"loads.{k}.segment", [load.segment], with_mass)
    return config


def _summary(command: str, outcomes: Iterable[Outcome], out: Path | None) -> None:
    states: Counter[str] = Counter(outcome.state for outcome in outcomes)
    words = {"done": "done", "fresh": "up to date", "refused": "refused"}
    words |= {"unwritten": "not to be written", "waiting": "without input"}
    words |= {"bug": "failed by a bug"}
    said = ", ".join(f"{states[state]} {word}" for state, word in words.items() if states[state])
    where = f"; results in {printable(str(out))}" if out else ""
    click.echo(f"bsip {command}: {said or 'nothing to do'}{where}", err=True)


# --- whether loads and prefixes of study.toml fit the study: nothing named that is not there ------


def _check_trials(loads: Sequence[Load], study: Study) -> None:
    trials = [trial for participant in study.participants for trial in participant.trials]
    participants = sorted({trial.participant_id for trial in trials})
    tasks = sorted({trial.task for trial in trials})
    runs = sorted({trial.run for trial in trials if trial.run is not None})
    for k, load in enumerate(loads):
        _check_known(f"loads.{k}.participants", load.participants, participants)
        _check_known(f"loads.{k}.tasks", load.tasks, tasks)
        _check_known(f"loads.{k}.runs", map(str, load.runs), [str(run) for run in runs])
        if not any(load.is_carried_in(t.participant_id, t.task, t.run) for t in trials):
            raise UsageError(
                f"loads.{k}: {load.mass_kg:g} kg on {load.segment} are carried in no recording",
                expected="participants, tasks and runs that some recording has together",
                remedy=_LOADS,
            )


def _check_known(
    option: str, names: Iterable[str], known: Collection[str], remedy: str = _LOADS
) -> None:
    for name in names:
        if name not in known:
            raise UsageError(
                f"{option}: there is no {name}{did_you_mean(name, known)}",
                expected=f"one of {', '.join(known)}" if known else "none, no recording has any",
                remedy=remedy,
            )
