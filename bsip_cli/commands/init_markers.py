"""The marker set of a study that ``bsip init`` makes: a shipped one, or one of the labels."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from shlex import quote

from bsip_cli.commands.init_files import Source
from bsip_cli.errors import BadDataError, printable
from bsip_cli.recordings.marker_guess import told_from
from bsip_cli.recordings.starter_set import starter_toml
from bsip_cli.study.new_study import Named
from bsip_cli.study.trials import listed

STARTER = "markers.toml"


@dataclass(frozen=True)
class StudyMarkers:
    """The marker set for study.toml, and the starter's TOML where no shipped one fits."""

    name: str
    starter: str
    notes: tuple[str, ...]


def study_markers(sources: Sequence[Source], named: Mapping[Path, Named]) -> StudyMarkers:
    """The one shipped set that recordings fit; several are left to guess; a starter where none."""
    guessed: dict[str, list[Source]] = defaultdict(list)
    for source in sources:
        guessed[_shipped(source)].append(source)
    unknown = guessed.pop("", [])
    if not guessed:
        return _starter(unknown, named)
    served = {named[source.path].participant for own in guessed.values() for source in own}
    others = {named[source.path].participant for source in unknown} - served
    name = next(iter(guessed)) if len(guessed) == 1 and not others else "auto"
    notes = []
    if unknown:
        notes.append(
            f"no shipped marker set fits {listed(source.path.name for source in unknown)}: ingest "
            f"may refuse them; `bsip markers {quote(str(unknown[0].path))}` makes one, which "
            "serves in a study of their own"
        )
    if len(guessed) > 1:
        notes.append(f"several marker sets, guessed for each recording: {', '.join(guessed)}")
    return StudyMarkers(name, "", tuple(notes))


def _shipped(source: Source) -> str:
    """The shipped set that a recording fits; empty without one, or with two people in the file."""
    try:
        guess = told_from(source.labels)
    except BadDataError:
        return ""  # ingest says it of the file
    return guess.name if guess.is_shipped else ""


def _starter(sources: Sequence[Source], named: Mapping[Path, Named]) -> StudyMarkers:
    """A first set of all labels, those of static trials first."""
    order = sorted(sources, key=lambda source: named[source.path].task != "static")
    labels = dict.fromkeys(label for source in order for label in source.labels)
    try:
        guess = told_from(tuple(labels))
    except BadDataError as several:
        note = f"no shipped marker set fits, nor one for all recordings together: {several.found}"
        return StudyMarkers("auto", "", (f"{note}; a study per laboratory may do",))
    note = (
        f"no shipped marker set fits: {STARTER} in the study is a first one, guessed from the "
        "labels; check it before you trust a number"
    )
    source = printable(order[0].path.name)
    return StudyMarkers(
        STARTER, starter_toml(guess.marker_set, guess.unknown, source, STARTER), (note,)
    )
