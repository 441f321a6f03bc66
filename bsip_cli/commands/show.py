"""What ``bsip show`` prints of a finished run: a line per finding, or all with its tables."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from shutil import get_terminal_size
from textwrap import fill
from typing import Any

import pandas as pd

from bsip_cli.artifacts import is_made_from, read_artifact, read_header
from bsip_cli.errors import BadDataError, UsageError, printable
from bsip_cli.report.blocks import Light
from bsip_cli.report.budget import BEFORE, numbered_pieces
from bsip_cli.report.causes import analysed, candidates_of, causes_of, effects_in
from bsip_cli.report.cohort import named_sentences, unnamed_sentences
from bsip_cli.report.cohort_record import SHARED, Searched, searched, shared_causes
from bsip_cli.report.joints import largest_changes, moment_change, peaks_of
from bsip_cli.report.records import with_all_causes
from bsip_cli.report.tables.build import show as tables_of
from bsip_cli.report.verdict import Verdict, cause_line, corrected_sentence, light_of, verdict_of
from bsip_cli.report.words import count, listing
from bsip_cli.running.runner import outdated
from bsip_cli.schemas import SCHEMAS
from bsip_cli.study.trials import listed

_WIDEST = 100  # letters in a line
_MOST = 3  # causes of a person, without --full: all fits on a screen of 24 lines


def shown(out: Path, full: bool = False) -> Iterator[str]:
    """The parts of the answer, in order; with ``full`` tables and causes with all their numbers.

    UsageError: Nothing to show has been written there, or it is a file.
    BadDataError: A diagnosis cannot be read.
    """
    if out.is_file():
        raise UsageError(
            "this is a file, not a folder of results",
            file=out,
            remedy="name the folder that `bsip run` was given with --out, or look at one artifact "
            "with `bsip info`",
        )
    tables = tables_of(out)
    people = sorted(out.glob("sub-*/*_diagnosis.parquet"))
    choices = any(_path(folder, "choice").exists() for folder in _folders(out))
    stated = list(_notes(out, "person", "mass_note", "height_note"))
    if not tables and not people and not stated and not choices:
        raise UsageError(
            "there are no tables and no diagnoses",
            file=out,
            remedy="run `bsip run` first, or name the folder that it was given with --out",
        )
    if stated:
        yield "\n".join(stated)
    folders = _folders(out)
    if full and tables and len(list(out.glob("sub-*"))) > 1:  # of one person nothing is tested
        yield "\n".join(map(printable, tables.split("\n")))
    everybody, unread = [], []
    for folder in folders:
        try:
            if found := _person(folder, full, len(folders) == 1):
                everybody.append(found[0])
                yield found[1]
        except BadDataError as error:
            unread.append(folder.name)
            yield f"\n{error}"
    laboratory = out / "group" / "group_laboratory.parquet"
    if laboratory.exists():
        table = read_artifact(laboratory, "laboratory")
        yield from map(_wrapped, (*named_sentences(table), *unnamed_sentences(table)))
    if old := _no_more_true(out):
        yield _listed("\n## Not up to date: run `bsip run` again", old)
    if shared := shared_causes(everybody):
        yield _listed(f"\n## What several participants share\n{_wrapped(SHARED)}", shared)
    reports = [out / "group" / "report.html"] if len(folders) > 1 else []
    if full or not reports:
        reports += sorted(out.glob("sub-*/report.html"))
    yield from (f"report: {printable(str(report))}" for report in reports if report.exists())
    if unread:
        raise BadDataError(
            f"the diagnosis of {listed(unread)} cannot be shown",
            file=out,
            remedy="run `bsip run` again",
        )


def _folders(out: Path) -> list[Path]:
    return sorted(path for path in out.glob("sub-*") if path.is_dir())


def _notes(out: Path, kind: str, *columns: str) -> Iterator[str]:
    for folder in _folders(out):
        try:
            table = _table(folder, kind)
        except BadDataError as error:
            yield str(error)
            continue
        said = () if table is None else table[list(columns)].iloc[0]
        yield from (_wrapped(f"{folder.name}: {one}") for one in said if one)


def _person(folder: Path, full: bool, alone: bool) -> tuple[Searched, str] | None:
    diagnosis, detection = (_table(folder, kind) for kind in ("overall-diagnosis", "detection"))
    if diagnosis is None or detection is None:
        return None
    facts = read_header(_path(folder, "overall-diagnosis"))["provenance"]["facts"]
    if not full:
        lines = _findings(folder, diagnosis, detection, alone)
        return searched(folder.name, diagnosis, facts), "\n".join(lines)
    gains, changes = (_extended(folder, kind) for kind in ("overall-gain", "bsip-change"))
    budget = _table(folder, "overall-error-budget")
    page = _of_the_page(folder)
    found = verdict_of(diagnosis, detection, gains, changes, budget, page.get("large", ()))
    right = corrected_sentence(_of_trials(folder, "marker-events"))
    headline = "{title}. {text}".format(**page["light"]) if page else found.headline
    peaks = peaks_of(_of_trials(folder, "joint-peaks"))
    more = *(f"{said}." for said in largest_changes(peaks)), page.get("said", "")
    found = replace(found, headline=headline, results=(*found.results, *more))
    return searched(folder.name, diagnosis, facts), verdict_text(folder.name, found, right)


def _findings(
    folder: Path, diagnosis: pd.DataFrame, detection: pd.DataFrame, alone: bool
) -> Iterator[str]:
    """A line each, the most important first: whether anything is wrong, the causes, what makes the
    error, which parameters to use. Of one among many the first."""
    budget, page = _table(folder, "overall-error-budget"), _of_the_page(folder)
    light = Light(**page["light"]) if page else light_of(diagnosis, detection, budget)
    use = f" Use {page['use']}." if page and not alone else ""
    yield _wrapped(f"{folder.name}: {light.title}. {light.text}{use}")
    if not alone:
        return
    large = page.get("large", ())
    causes = causes_of(candidates_of(diagnosis))
    everywhere = analysed(detection, diagnosis)
    peaks = peaks_of(_of_trials(folder, "joint-peaks"))
    shown_here = causes[: _MOST - len(large)]
    lines = [cause_line(c, everywhere, moment_change(c, causes, peaks)) for c in shown_here]
    for number, line in enumerate((*large, *lines), start=1):
        yield _wrapped(line, f"{number:2d}. ")
    if more := len(causes) - len(shown_here):
        yield f"  - {count(more, 'more finding')}: --full"
    found = {k: effects_in([c]) for k, c in enumerate(causes, start=1 + len(large))}
    if budget is not None and (pieces := numbered_pieces(budget, found)):
        parts = listing([f"{one.label} {one.share:.0f} %" for one in pieces])
        yield _wrapped(f"The {BEFORE}: {parts}.", "  - ")
    if page:
        yield _wrapped(page["said"], "  - ")


def _of_the_page(folder: Path) -> dict[str, Any]:
    """What the report's pages say: the answer (light), its finding of a large error if any, which
    parameters to use; nothing where there is no report of this diagnosis."""
    page = _path(folder, "report-files")
    if not page.exists() or not is_made_from(page, _path(folder, "overall-diagnosis")):
        return {}
    facts: dict[str, Any] = read_header(page, "report-files")["provenance"]["facts"]
    return facts


def _of_trials(folder: Path, kind: str) -> list[tuple[str, pd.DataFrame]]:
    ending = f"_{SCHEMAS[kind].file_name}.parquet"
    paths = sorted(folder.glob(f"{folder.name}_*{ending}"))
    return [(path.name.removesuffix(ending), read_artifact(path, kind)) for path in paths]


def _no_more_true(out: Path) -> list[str]:
    """Whose reports are of other code, or of artifacts that were made anew since."""
    reasons: dict[str, list[str]] = {}
    for folder in sorted(out.glob("sub-*")):
        if (path := _path(folder, "report-files")).exists():
            try:
                why = outdated(path)
            except BadDataError as error:
                why = str(error)
            reasons.setdefault(why.replace(f"{folder.name}_", ""), []).append(folder.name)
    return [f"{listed(names)}: {why}" for why, names in reasons.items() if why]


def _listed(head: str, sentences: Sequence[str]) -> str:
    return "\n".join([head, *(_wrapped(text, "  - ") for text in sentences)])


def verdict_text(name: str, found: Verdict, right: tuple[str, ...]) -> str:
    """A diagnosis for a terminal: causes numbered, lines broken; ``right`` says what was corrected
    before."""
    lines = [f"\n## Is anything wrong: {printable(name)}", _wrapped(found.headline)]
    lines += [_wrapped(one, f"{k:2d}. ") for k, one in enumerate(found.causes, start=1)]
    rest = (*right, *found.results, *found.advice, found.limits)
    lines += [_wrapped(text, "  - ") for text in rest if text]
    return "\n".join(lines)


def _wrapped(text: str, first: str = "") -> str:
    """In lines as wide as the terminal."""
    return fill(
        printable(text),
        max(40, min(get_terminal_size().columns, _WIDEST)),
        initial_indent=first,
        subsequent_indent=" " * len(first),
        break_long_words=False,
        break_on_hyphens=False,
    )


def _table(folder: Path, kind: str) -> pd.DataFrame | None:
    path = _path(folder, kind)
    return read_artifact(path, kind) if path.exists() else None


def _path(folder: Path, kind: str) -> Path:
    return folder / f"{folder.name}_{SCHEMAS[kind].file_name}.parquet"


def _extended(folder: Path, kind: str) -> pd.DataFrame | None:
    """A table of ``extend`` with all causes in the model; nothing of an earlier diagnosis."""
    changes, diagnosis = (_path(folder, name) for name in ("bsip-change", "overall-diagnosis"))
    if not changes.exists() or not is_made_from(changes, diagnosis):
        return None
    table = _table(folder, kind)
    return None if table is None else with_all_causes(table)
