"""Copy a study, or one recording, with effects hidden in what was measured."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bsip_cli.errors import BadDataError, UsageError
from bsip_cli.files.folders import entries, is_folder
from bsip_cli.files.force_files import ENDINGS
from bsip_cli.files.regular import fault_of
from bsip_cli.instruments.c3d_file import rewrite_c3d
from bsip_cli.instruments.trc_mot_files import rewrite_trc_mot
from bsip_cli.simulate.asked import effects_of, touches
from bsip_cli.simulate.effects.base import Effect
from bsip_cli.simulate.injection.changes import changed_by, check_injectable
from bsip_cli.simulate.options import StudyOptions

RECORDING = re.compile(
    r"(?P<participant>sub-[^_]+)(_ses-[^_]+)?_task-(?P<task>[^_]+).*\.(c3d|trc)$", re.I
)


@dataclass(frozen=True)
class Injection:
    """What became of the recordings. refused : with the reason, copied as they were, or not at all
    where they cannot be read."""

    changed: tuple[Path, ...]
    refused: tuple[BadDataError, ...]


def inject_recording(source: Path, copy: Path, effects: Sequence[Effect]) -> dict[str, object]:
    """Hide effects in one recording; returns the truth about it.

    Raises
    ------
    UsageError : an effect that measured data cannot have; a file of another kind.
    BadDataError : the recording cannot take an effect.
    """
    check_injectable(effects)
    writers = {".c3d": rewrite_c3d, ".trc": rewrite_trc_mot}
    kind = source.suffix.lower()
    if kind not in writers:
        raise UsageError("not a recording", file=source, expected="a .c3d, or a .trc with a .mot")
    copy.parent.mkdir(parents=True, exist_ok=True)
    after = writers[kind](source, copy, lambda before: changed_by(effects, before, source))
    return {"recorded_from_s": after.start_s, "effects": [effect.name for effect in effects]}


def inject_study(
    study: Path, out: Path, options: StudyOptions, participants: Sequence[str] = ()
) -> Injection:
    """Copy a study folder into a new one, with the options' effects in its recordings.

    Hidden files and folders (.git, of a study under version control) are left behind.

    participants : in whose recordings; empty: in everybody's.
    """
    people = sorted(path.name for path in study.glob("sub-*") if is_folder(path))
    unknown = sorted(set(participants) - set(people))
    if not people:
        raise UsageError("no folders sub-... in it", expected="a study", file=study)
    if unknown:
        raise UsageError(f"no participants {', '.join(unknown)}", expected=", ".join(people))
    effects = {name: effects_of(options, k) for k, name in enumerate(people, start=1)}
    check_injectable(effects[people[0]])
    chosen = set(participants or people)
    changed: list[Path] = []
    refused: list[BadDataError] = []
    trials: dict[str, dict[str, object]] = {name: {} for name in people}
    files = _files_in(study, refused, (study,))
    # forces come last: those of a changed TRC file are there by then
    for source in sorted(files, key=lambda path: path.suffix.lower() in ENDINGS):
        relative = source.relative_to(study)
        place = out / relative
        match = RECORDING.match(source.name)
        active = []
        if match and match["participant"] in chosen and relative.parts[0] == match["participant"]:
            every = effects[match["participant"]]
            active = [e for e in every if touches(e, match["task"], options.effect_tasks)]
        if not active or not match:
            _copy(source, place)
            continue
        try:
            trials[match["participant"]][source.stem] = inject_recording(source, place, active)
            changed.append(place)
        except BadDataError as error:
            refused.append(error)
            _copy(source, place)
    for name in chosen:
        _write_truth(out, name, effects[name], trials[name])
    return Injection(tuple(changed), tuple(refused))


def _files_in(folder: Path, refused: list[BadDataError], above: tuple[Path, ...]) -> Iterator[Path]:
    """Every file that can be read, also where links lead, but not in circles."""
    try:
        paths = entries(folder)
    except BadDataError as closed:
        refused.append(closed)
        return
    for path in paths:
        if is_folder(path) and not any(path.samefile(one) for one in above):
            yield from _files_in(path, refused, (*above, path))
        elif found := fault_of(path):
            found = "leads in a circle" if is_folder(path) else found
            refused.append(BadDataError(found, file=path, expected="a file that may be read"))
        else:
            yield path


def _copy(source: Path, place: Path) -> None:
    """Copy a file, unless the copy was written already (a MOT file with its TRC file)."""
    place.parent.mkdir(parents=True, exist_ok=True)
    if not place.exists():
        shutil.copyfile(source, place)


def write_truth_of_recording(
    copy: Path, effects: Sequence[Effect], facts: dict[str, object]
) -> None:
    """Beside a single recording: what is hidden in it."""
    record = {"effects": [effect.record() for effect in effects], **facts}
    _write_json(copy.with_name(f"{copy.stem}_injected.json"), record)


def _write_truth(
    out: Path, name: str, effects: Sequence[Effect], trials: dict[str, object]
) -> None:
    record: dict[str, object] = {
        "participant_id": name,
        "effects": [effect.record() for effect in effects],
        "trials": trials,
    }
    (out / "truth").mkdir(parents=True, exist_ok=True)
    _write_json(out / "truth" / f"{name}_injected.json", record)


def _write_json(file: Path, record: dict[str, object]) -> None:
    partial = file.with_name(file.name + ".part")
    partial.write_text(json.dumps(record, indent=1, default=_plain) + "\n", encoding="utf-8")
    partial.replace(file)


def _plain(value: object) -> object:
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{value!r} has no place in JSON")
