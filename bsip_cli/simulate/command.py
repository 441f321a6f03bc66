"""The commands ``bsip simulate`` and ``bsip inject``: presets and the options a user chooses."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import click

from bsip_cli.errors import BadDataError, UsageError, printable
from bsip_cli.files.folders import is_folder, lies_in
from bsip_cli.files.regular import check_regular, fault_of
from bsip_cli.simulate.effects import effects_of, pair_up
from bsip_cli.simulate.inject import inject_recording, inject_study, write_truth
from bsip_cli.simulate.options import StudyOptions, preset
from bsip_cli.simulate.study import simulate_study


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
    options = preset(preset_name)
    if participants is not None:
        options = replace(options, participants=participants, sexes="")
    if sequence_s is not None:
        options = replace(options, durations_s={**options.durations_s, "sequence": sequence_s})
    richness = replace(
        options.richness, measured_tissue=soft_tissue == "measured", girdle=shoulder_girdle
    )
    options = replace(
        options,
        seed=options.seed if seed is None else seed,
        tasks=tuple(tasks) or options.tasks,
        laboratory=replace(options.laboratory, plate_per_foot=plate_per_foot),
        richness=richness,
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
