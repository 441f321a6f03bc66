"""The commands ``bsip simulate`` and ``bsip inject``: presets and the options a user chooses."""

from __future__ import annotations

import json
import os
import re
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import click
import numpy as np

from bsip_cli.errors import BadDataError, UsageError, printable
from bsip_cli.files.folders import entries, is_folder, lies_in
from bsip_cli.files.force_files import ENDINGS
from bsip_cli.files.regular import check_regular, fault_of
from bsip_cli.instruments.c3d_file import rewrite_c3d
from bsip_cli.instruments.readings import Instruments
from bsip_cli.instruments.trc_mot_files import rewrite_trc_mot
from bsip_cli.simulate.effects import effects_of, pair_up, touches
from bsip_cli.simulate.effects.base import Effect
from bsip_cli.simulate.options import PRESETS, StudyOptions
from bsip_cli.simulate.study import simulate_study, write_text


def simulate_command(
    study: Path,
    preset_name: str,
    participants: int | None,
    seed: int | None,
    sequence_s: float | None,
    effects: Sequence[str] = (),
    sizes: Sequence[float] = (),
    targets: Sequence[str] = (),
    effect_tasks: Sequence[str] = (),
    tasks: Sequence[str] = (),
    run: int = 1,
    plate_per_foot: bool = False,
    soft_tissue: str = "light",
    shoulder_girdle: bool = False,
) -> None:
    """Write a simulated study into a new or empty folder."""
    _check_new(study)
    options = PRESETS[preset_name]
    if participants is not None:
        options = replace(options, participants=participants, sexes="")
    if sequence_s is not None:
        options = replace(options, durations_s={**options.durations_s, "sequence": sequence_s})
    tissue = soft_tissue == "measured"
    options = replace(
        options,
        seed=options.seed if seed is None else seed,
        tasks=tuple(tasks) or options.tasks,
        laboratory=replace(options.laboratory, plate_per_foot=plate_per_foot),
        richness=replace(options.richness, measured_tissue=tissue, girdle=shoulder_girdle),
        run=run,
        effects=pair_up(effects, sizes, targets),
        effect_tasks=tuple(effect_tasks),
    )
    with _writing(study):
        simulate_study(study, options)
    click.echo(f"bsip simulate: {options.participants} people in {printable(str(study))}", err=True)


def inject_command(
    source: Path,
    out: Path,
    participants: Sequence[str],
    seed: int,
    effects: Sequence[str],
    sizes: Sequence[float],
    targets: Sequence[str],
    effect_tasks: Sequence[str],
) -> int:
    """Copy a study or one recording with effects hidden in it; returns the exit code."""
    if not effects:
        raise UsageError("nothing to hide", expected="at least one --effect with its --size")
    if not source.is_dir():
        check_regular(source, UsageError)
    asked = pair_up(effects, sizes, targets, simulated=False)
    options = StudyOptions(seed=seed, effects=asked, effect_tasks=tuple(effect_tasks))
    if not source.is_dir():
        if participants or effect_tasks:
            raise UsageError("one recording has no participants or tasks to choose from")
        return _inject_one(source, out, options)
    if lies_in(out, source):
        raise UsageError(
            "lies in what is to be copied", file=out, remedy="name a folder outside the study"
        )
    _check_new(out)
    with _writing(out):
        changed, refused = inject_study(source, out, options, participants)
    for error in refused:
        click.echo(f"bsip inject: {error}", err=True)
    click.echo(f"bsip inject: {len(changed)} recordings changed in {printable(str(out))}", err=True)
    return BadDataError.exit_code if refused or not changed else 0


def _inject_one(source: Path, out: Path, options: StudyOptions) -> int:
    """One recording; OUT is the new file, or a folder for it."""
    copy = out if out.suffix.lower() == source.suffix.lower() else out / source.name
    if os.path.lexists(copy):
        raise UsageError("the file is there already", file=copy, remedy="name a new one")
    hidden = effects_of(options, 1)
    with _writing(copy):
        facts = inject_recording(source, copy, hidden)
        record = {"effects": [effect.record() for effect in hidden], **facts}
        write_truth(copy.with_name(f"{copy.stem}_injected.json"), record)
    click.echo(f"bsip inject: {printable(str(copy))}", err=True)
    return 0


def _check_new(folder: Path) -> None:
    """Nothing may be there but an empty folder."""
    remedy = "name a new folder"
    if os.path.lexists(folder) and not is_folder(folder):
        raise UsageError(fault_of(folder) or "is a file", file=folder, remedy=remedy)
    with _writing(folder):
        is_empty = not is_folder(folder) or not any(folder.iterdir())
    if not is_empty:
        raise UsageError("the folder is not empty", file=folder, remedy=remedy)


@contextmanager
def _writing(place: Path) -> Iterator[None]:
    """What the system refuses while files are made, in one sentence."""
    try:
        yield
    except OSError as error:
        raise UsageError(
            f"cannot be made ({error.strerror or error})",
            file=place,
            remedy="make room there, or name another place",
        ) from None


# --- measured recordings --------------------------------------------------------------------------


RECORDING = re.compile(
    r"(?P<participant>sub-[^_]+)(_ses-[^_]+)?_task-(?P<task>[^_]+).*\.(c3d|trc)$", re.I
)


def inject_recording(source: Path, copy: Path, effects: Sequence[Effect]) -> dict[str, object]:
    """Hide effects in one recording; returns the truth about it.

    UsageError: an effect that measured data cannot have; a file of another kind.
    BadDataError: the recording cannot take an effect.
    """
    check_injectable(effects)
    kind = source.suffix.lower()
    if kind not in (".c3d", ".trc"):
        raise UsageError("not a recording", file=source, expected="a .c3d, or a .trc with a .mot")
    copy.parent.mkdir(parents=True, exist_ok=True)
    rewrite = rewrite_c3d if kind == ".c3d" else rewrite_trc_mot
    after = rewrite(source, copy, lambda before: _changed_by(effects, before, source))
    return {"recorded_from_s": after.start_s, "effects": [effect.name for effect in effects]}


def check_injectable(effects: Sequence[Effect]) -> None:
    """Refuse effects that measured data cannot have afterwards."""
    for effect in effects:
        if not effect.injectable:
            raise UsageError(
                f"{effect.name} cannot be hidden in measured data: {effect.hint}",
                remedy="hide it in a simulated study (bsip simulate)",
            )


def _changed_by(effects: Sequence[Effect], instruments: Instruments, file: Path) -> Instruments:
    """Instruments with all effects, each of which must have changed something."""
    for effect in effects:
        if "plates" in effect.needs and not instruments.plates:
            raise BadDataError(f"{effect.name} needs force plates, and there are none", file=file)
        if "surface" in effect.needs and not instruments.surfaces_known:
            raise BadDataError(
                f"{effect.name} needs to know where the plates lie, and a MOT file does not say",
                file=file,
            )
        try:
            changed = effect.injected(instruments)
        except (UsageError, BadDataError) as error:  # what is asked for may be in the other files
            raise BadDataError(
                error.found, expected=error.expected, remedy=error.remedy, file=file
            ) from error
        pairs = [(x.points_m, x.readings) for x in (instruments, changed)]
        if all(np.array_equal(a, b, equal_nan=True) for a, b in zip(*pairs, strict=True)):
            raise BadDataError(f"{effect.name} changes nothing in this recording", file=file)
        instruments = changed
    return instruments


def inject_study(
    study: Path, out: Path, options: StudyOptions, participants: Sequence[str] = ()
) -> tuple[list[Path], list[BadDataError]]:
    """Copy a study folder into a new one, with the options' effects in its recordings.

    Hidden files and folders (.git, of a study under version control) are left behind.

    participants : in whose recordings; empty: in everybody's.
    Returns the changed recordings, and why others were refused; those are copied as they were, or
    not at all where they cannot be read.
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
        place, match = out / relative, RECORDING.match(source.name)
        who = match["participant"] if match else ""
        active = []
        if match and who in chosen and relative.parts[0] == who:
            active = [e for e in effects[who] if touches(e, match["task"], options.effect_tasks)]
        if active:
            try:
                trials[who][source.stem] = inject_recording(source, place, active)
                changed.append(place)
            except BadDataError as error:
                refused.append(error)
        place.parent.mkdir(parents=True, exist_ok=True)
        if not place.exists():  # neither changed, nor forces that were written with their TRC file
            shutil.copyfile(source, place)
    (out / "truth").mkdir(parents=True, exist_ok=True)
    for name in chosen:
        hidden = [effect.record() for effect in effects[name]]
        record = {"participant_id": name, "effects": hidden, "trials": trials[name]}
        write_truth(out / "truth" / f"{name}_injected.json", record)
    return changed, refused


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


def write_truth(file: Path, record: Mapping[str, object]) -> None:
    """What is hidden in a recording, or in all of a participant."""
    write_text(file, json.dumps(record, indent=1, default=np.generic.item) + "\n")
