"""``bsip init``: a study of a folder of recordings; nothing is moved and nothing written over."""

from __future__ import annotations

import csv
import io
import os
import shutil
from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from shlex import quote
from typing import Literal

import click
from tqdm import tqdm

from bsip_cli.commands.init_files import NO_RECORDING, Source, Unused, list_files, read_sources
from bsip_cli.errors import BadDataError, UsageError, not_writable, printable
from bsip_cli.files.regular import check_path, is_folder
from bsip_cli.recordings.c3d_person import together
from bsip_cli.recordings.marker_guess import starter_toml, told_from
from bsip_cli.recordings.model import StatedPerson
from bsip_cli.report.blocks import environment
from bsip_cli.study import participants
from bsip_cli.study.new_study import Named, is_sequence, name_all, plain
from bsip_cli.study.trials import kinds, listed

# --- a table of people among the files that ``bsip init`` is given: what it says of them ----------

_NAMES = ("participants", "subjects")
_KINDS = (".tsv", ".csv")


def read_tables(
    files: Iterable[Path], people: Collection[str]
) -> tuple[dict[str, tuple[Path, StatedPerson]], list[str]]:
    """What tables say of the participants of the new study, by their names; and what is to be said.

    A person is known by the letters and digits of the name. Of several tables the first counts.
    """
    said: dict[str, tuple[Path, StatedPerson]] = {}
    notes: list[str] = []
    wanted = {name.removeprefix("sub-").casefold(): name for name in people}
    for file in files:
        try:
            table = participants.read_people(file)
        except BadDataError as refusal:
            notes.append(str(refusal))
            continue
        notes += table.notes
        named = [row.id for row in table.rows]
        if wanted.keys().isdisjoint(plain(one.removeprefix("sub-")).casefold() for one in named):
            notes.append(
                f"{file} names {listed(named)}, and nobody of these is found: the people here are "
                f"{listed(wanted.values())}; write what it says into the study's participants.tsv"
            )
        for row in table.rows:
            name = wanted.get(plain(row.id.removeprefix("sub-")).casefold())
            if name is None or name in said:
                continue
            try:
                person = participants.participant_of(replace(row, id=name), table)
            except BadDataError as refusal:
                notes.append(str(refusal))
                continue
            is_stated = row.cells[table.columns["sex"].index].casefold() not in participants.UNKNOWN
            sex = person.sex if is_stated else ""
            said[name] = file, StatedPerson(person.mass_kg, person.height_m, sex)
            notes += person.notes
    return said, notes


# --- the marker set of a study that ``bsip init`` makes: a shipped one, or one of the labels ------

STARTER = "markers.toml"


_Trials = Sequence[tuple[Source, Named]]


def _study_markers(trials: _Trials) -> tuple[str, str, list[str]]:
    """The marker set for study.toml: the one shipped set that recordings fit, "auto" where there
    are several; the TOML of a first one, where none fits; and what is to be said."""
    guessed: dict[str, list[tuple[Source, Named]]] = defaultdict(list)
    for source, named in trials:
        name = ""  # without a shipped set that fits, or with two people in the file, as ingest says
        with suppress(BadDataError):
            guess = told_from(source.written)
            name = guess.name if guess.is_shipped else ""
        guessed[name].append((source, named))
    unknown = guessed.pop("", [])
    if not guessed:
        return _starter(unknown)
    served = {named.participant for own in guessed.values() for _, named in own}
    others = {named.participant for _, named in unknown} - served
    notes = []
    if unknown:
        paths = [source.path for source, _ in unknown]
        notes.append(
            f"no shipped marker set fits {listed(path.name for path in paths)}: ingest "
            f"may refuse them; `bsip markers {quote(str(paths[0]))}` makes one, which "
            "serves in a study of their own"
        )
    if len(guessed) > 1:
        notes.append(f"several marker sets, guessed for each recording: {', '.join(guessed)}")
    return next(iter(guessed)) if len(guessed) == 1 and not others else "auto", "", notes


def _starter(trials: _Trials) -> tuple[str, str, list[str]]:
    order = [source for source, _ in sorted(trials, key=lambda pair: pair[1].task != "static")]
    labels = dict.fromkeys(label for source in order for label in source.written)
    try:
        guess = told_from(tuple(labels))
    except BadDataError as several:
        note = f"no shipped marker set fits, nor one for all recordings together: {several.found}"
        return "auto", "", [f"{note}; a study per laboratory may do"]
    note = (
        f"no shipped marker set fits: {STARTER} in the study is a first one, guessed from the "
        "labels; check it before you trust a number"
    )
    named_in = printable(order[0].path.name), STARTER
    return STARTER, starter_toml(guess.marker_set, guess.unknown, *named_in), [note]


_COLUMNS = ("file", "source", "made", "participant_id", "task", "why")


@dataclass(frozen=True, eq=False)
class _Plan:
    """Everything that will be written, and where."""

    out: Path
    made: Literal["linked", "copied"]
    trials: _Trials
    people: Mapping[str, StatedPerson]
    marker_set: str
    starter: str
    unused: Sequence[Unused]
    tables: Collection[Path]
    notes: Sequence[str]

    def files(self) -> Iterator[tuple[Path, Path, Named]]:
        """Where each lies, and where in the study it will."""
        for source, named in self.trials:
            for path in filter(None, (source.path, source.forces)):
                yield path, named.folder / f"{named.stem}{path.suffix.lower()}", named


def init_command(given: tuple[Path, ...], out: Path, participant: str, link: bool) -> int:
    """Make the study, and print what lies where and what was not used.

    Returns 0, or 3 where a recording cannot be used.

    UsageError: something that is given is not there, the study's folder is not empty or cannot be
        written, or the participant's name cannot be one.
    BadDataError: no recording can be used.
    """
    wished = participant
    if participant and not participants.NAME.fullmatch(participant):
        participant = f"sub-{participant}"
        if not participants.NAME.fullmatch(participant):
            raise UsageError(
                f"--participant {wished!r}",
                expected="sub- and letters or digits",
                remedy="name it like sub-01",
            )
    _check_out(out)
    files = list_files(given, out)
    sources, unused = read_sources(
        files, lambda some: tqdm(some, desc="init", unit="recording", disable=None)
    )
    if not sources:
        _say(_unused_lines(unused))
        raise BadDataError(
            "no recording can be used" if unused else "no files",
            file=", ".join(map(str, given)),
            expected="C3D files, or TRC files with their MOT or STO next to them",
            remedy="correct what is said of each"
            if any(one.why != NO_RECORDING for one in unused)
            else "export the trials so, or name the folder they lie in",
        )
    called = [one.path for one in files if one.path.stem.casefold() in _NAMES]
    tables = [path for path in called if path.suffix.lower() in _KINDS]
    plan = _planned(out, "linked" if link else "copied", sources, unused, participant, tables)
    _write(plan)
    _say(_in_words(plan))
    return 3 if any(one.is_fault for one in unused) else 0


def _check_out(out: Path) -> None:
    check_path(out)
    try:
        is_free = not os.path.lexists(out) or (is_folder(out) and not any(out.iterdir()))
    except OSError as error:
        raise UsageError(f"cannot be listed ({error.strerror})", file=out) from None
    if not is_free:
        raise UsageError(
            "is there already, and nothing is written over",
            file=out,
            expected="a new or an empty folder",
            remedy="name another one with --out",
        )


# --- the plan -------------------------------------------------------------------------------------


def _planned(
    out: Path,
    made: Literal["linked", "copied"],
    sources: Sequence[Source],
    unused: Sequence[Unused],
    participant: str,
    tables: Sequence[Path],
) -> _Plan:
    all_named, notes = name_all(sources, participant)
    named = {one.found.path: one for one in all_named}
    trials = [(source, named[source.path]) for source in sources]
    of: dict[str, dict[str, StatedPerson]] = defaultdict(dict)
    for source, one in sorted(trials, key=lambda pair: pair[1].stem):
        of[one.participant][source.path.name] = source.stated
    in_tables, about_tables = read_tables(tables, of)
    people, said = {}, [*notes, *about_tables]
    for name, stated in sorted(of.items()):
        if name in in_tables:
            stated[in_tables[name][0].name] = in_tables[name][1]
        people[name], contradictions = together(stated)
        said += [f"{name}: {one}" for one in contradictions]
    used = {file for file, _ in in_tables.values()}
    left = [one for one in unused if one.path not in used]
    marker_set, starter, about_markers = _study_markers(trials)
    said += about_markers
    return _Plan(out, made, trials, people, marker_set, starter, left, used, said)


# --- what is written ------------------------------------------------------------------------------


def _write(plan: _Plan) -> None:
    """Everything into a folder next to it, which gets the study's name when it is whole."""
    out = plan.out.absolute()
    made = out.with_name(f".{out.name}.{os.getpid()}.bsip-part")
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        made.mkdir()
        try:
            for source, target, _ in plan.files():
                place = made / target
                place.parent.mkdir(parents=True, exist_ok=True)
                if plan.made == "linked":
                    place.symlink_to(source.resolve())
                else:
                    shutil.copy2(source, place)
            people = [
                (name, one.sex or "n/a", *("n/a" if x is None else f"{x:.6g}" for x in known))
                for name, one in plan.people.items()
                for known in [(one.mass_kg, one.height_m)]
            ]
            texts = {
                "participants.tsv": _table([participants.KNOWN, *people]),
                "study.toml": _study_toml(plan),
                "sources.tsv": _table(_source_rows(plan)),
            } | ({STARTER: plan.starter} if plan.starter else {})
            for name, text in texts.items():
                (made / name).write_text(text, encoding="utf-8")
            if out.is_dir():
                out.rmdir()  # it is empty
            made.rename(out)
        except BaseException:
            shutil.rmtree(made, ignore_errors=True)
            raise
    except OSError as error:
        raise not_writable(plan.out, error) from None


def _source_rows(plan: _Plan) -> Iterator[tuple[str, ...]]:
    yield _COLUMNS
    for source, target, named in plan.files():
        place = str(target), str(source.absolute()), plan.made
        yield *place, named.participant, named.task, ""
    for table in plan.tables:
        yield "participants.tsv", str(table.absolute()), "read", "n/a", "n/a", ""
    for one in sorted(plan.unused, key=lambda one: one.path):
        yield "n/a", str(one.path.absolute()), "not used", "n/a", "n/a", one.why


def _table(rows: Iterable[tuple[str, ...]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, delimiter="\t", lineterminator="\n")
    writer.writerows([printable(cell) for cell in row] for row in rows)
    return text.getvalue()


def _study_toml(plan: _Plan) -> str:
    tasks = sorted({named.task for _, named in plan.trials})
    sequences = ", ".join(f'"{task}"' for task in tasks if is_sequence(task))
    moving = Counter(n.participant for _, n in plan.trials if n.task != "static")
    alone = set(moving.values()) == {1} and not sequences
    known = {"marker_set": plan.marker_set, "sequences": sequences, "alone": alone}
    return environment().get_template("study.toml.j2").render(known)


# --- what is said ---------------------------------------------------------------------------------


def _say(lines: Iterator[str]) -> None:
    for line in lines:
        click.echo(printable(line))


def _in_words(plan: _Plan) -> Iterator[str]:
    for name, stated in plan.people.items():
        trials = sorted(n.stem for _, n in plan.trials if n.participant == name)
        short = listed(stem.removeprefix(f"{name}_") for stem in trials)
        yield f"{name}: {stated.words() or 'mass, height and sex not stated'}: {short}"
    lacking = [name for name, one in plan.people.items() if not one.sex]
    if lacking:
        whose = "" if len(lacking) == len(plan.people) else f" of {listed(lacking)}"
        yield (
            f"no file states the sex{whose}: write M or F into participants.tsv, else the mean of "
            "both tables is used"
        )
    if plan.tables:
        yield f"read of people: {listed(str(table) for table in plan.tables)}"
    yield f"marker set: {plan.marker_set}"
    yield from plan.notes
    yield from _unused_lines(plan.unused)
    yield f"{len([*plan.files()])} files {plan.made}; sources.tsv says what came from where"
    results = plan.out / "derivatives" / "bsip"
    yield f"next: bsip run {quote(str(plan.out))} --out {quote(str(results))}"


def _unused_lines(unused: Sequence[Unused]) -> Iterator[str]:
    """What is no recording in one line for all kinds; everything else with its reason."""
    others = [one for one in unused if one.why == NO_RECORDING]
    if others:
        yield f"not used, no recordings: {kinds(one.path for one in others)}"
    reasons: dict[str, list[str]] = defaultdict(list)
    for one in unused:
        if one not in others:
            reasons[one.why].append(one.path.name)
    for why, names in reasons.items():
        yield f"not used: {listed(names)}: {why}"
