"""Whether results are still true: made by this code and these options, from what is there now."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

from bsip_cli.artifacts import read_artifact, read_header
from bsip_cli.config import Config
from bsip_cli.errors import BadDataError
from bsip_cli.files.fingerprints import file_hash, fingerprint
from bsip_cli.pipeline import STAGES, Stage, upstream
from bsip_cli.running.unit import Unit, code_hash
from bsip_cli.schemas import SCHEMAS
from bsip_cli.study.study import Participant, Study

_MOVED = "what all persons together show has moved"


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
        except BadDataError as error:
            if not fingerprint(path).intact:  # else it is of another version of bsip
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


# --- one artifact -----------------------------------------------------------------------------


def _why_not(unit: Unit, kind: str, maker: str) -> str:
    path = unit.path(kind)
    if not path.exists():
        return f"{path.name} is not there"
    try:
        provenance = read_header(path, kind)["provenance"]
    except BadDataError as error:
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
    if SCHEMAS[kind].column("sha256") is None:
        return []
    listed = read_artifact(unit.path(kind), kind)
    return [
        name
        for name, known in zip(listed["file"], listed["sha256"], strict=True)
        if not (path := unit.out / name).is_file() or file_hash(path) != known
    ]


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
            if not source.exists() or file_hash(source) != known:
                return f"{one.name} was made from another {name}"
            seen.add(source.name)
            waiting.append(source)
    return ""
