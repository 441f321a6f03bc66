"""Studies with a known truth: simulated ones, and measured ones with effects hidden in them."""

from __future__ import annotations

import json
import os
import re
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path

import click
import numpy as np

from bsip_cli.errors import BadDataError, UsageError, printable
from bsip_cli.files.regular import ENDINGS, check_regular, entries, fault_of, is_folder, lies_in
from bsip_cli.instruments.c3d_file import rewrite_c3d
from bsip_cli.instruments.readings import Instruments
from bsip_cli.instruments.trc_mot_files import rewrite_trc_mot, write_whole
from bsip_cli.simulate.effects import Effect, effects_of, pair_up, touches
from bsip_cli.simulate.effects.base import body_of
from bsip_cli.simulate.effects.loads import WobblingMass
from bsip_cli.simulate.moving import MOVEMENTS
from bsip_cli.simulate.options import ALL_TASKS, MORE_TASKS, PRESETS, StudyOptions
from bsip_cli.simulate.people import Inertia, Person, draw_person
from bsip_cli.simulate.recording import (
    SIMULATION_HZ,
    Measurement,
    Trial,
    measure_trial,
    simulate_trial,
    write_trial,
)

HEADING_SPREAD_RAD = np.deg2rad(2.0)
SCALE_SPREAD_KG = 0.1
# Which stream of random numbers serves what, so that no draw depends on another's count.
PERSON, MOVEMENT, RECORDING, LABORATORY = range(4)
TASK_STREAMS = (*ALL_TASKS, "", *MORE_TASKS)  # new tasks at the end: old studies stay the same


def simulate_study(folder: Path, options: StudyOptions) -> list[Person]:
    """Write participants.tsv, study.toml, the recordings and truth/ into the folder; returns the
    people."""
    folder = Path(folder)
    check_options(options)
    (folder / "truth").mkdir(parents=True, exist_ok=True)
    numbers = range(1, options.participants + 1)
    people = [simulate_participant(folder, options, number)[0] for number in numbers]
    lines = ["participant_id\tsex\tmass_kg\theight_m"]  # as a lab notes them: a scale, a wall
    for number, person in zip(numbers, people, strict=True):
        scale = generator(options, number, LABORATORY, "static")
        mass = person.mass_kg + SCALE_SPREAD_KG * scale.standard_normal()
        lines.append(f"sub-{number:02d}\t{person.sex}\t{mass:.1f}\t{person.stature_m:.2f}")
    write_whole(folder / "participants.tsv", "\n".join(lines) + "\n")
    with_girdle = 'marker_set = "robert17"\nskeleton = "robert17"\n'
    settings = with_girdle if options.richness.girdle else 'marker_set = "hansen2017"\n'
    write_whole(folder / "study.toml", settings)
    return people


def check_options(options: StudyOptions) -> None:
    """Refuse options that no study can have."""
    unknown = [task for task in options.tasks if task not in MOVEMENTS]
    if unknown:
        raise UsageError(f"unknown tasks {unknown}", expected=", ".join(MOVEMENTS))
    absent = [task for task in options.effect_tasks if task not in options.tasks]
    if absent:
        raise UsageError(
            f"no trials of the tasks {absent} to hide effects in", expected=", ".join(options.tasks)
        )
    for rates in map(options.rates_of, options.tasks):
        whole = SIMULATION_HZ % rates.marker_hz == 0 and SIMULATION_HZ % rates.analog_hz == 0
        if not whole or rates.analog_hz % rates.marker_hz:
            raise UsageError(
                f"marker rate {rates.marker_hz} Hz with analog rate {rates.analog_hz} Hz",
                expected="divisors of 1000 Hz, the analog rate a multiple of the marker rate",
            )


def generator(options: StudyOptions, number: int, use: int, task: str = "") -> np.random.Generator:
    """The random numbers of one participant, use and task."""
    return np.random.default_rng(seed_of(options, number, use, task))


def seed_of(options: StudyOptions, number: int, use: int, task: str = "") -> list[int]:
    """The seed sequence behind `generator`; person and laboratory are the same in all runs."""
    seed = [options.seed, number, use, TASK_STREAMS.index(task)]
    return seed if options.run == 1 or use in (PERSON, LABORATORY) else [*seed, options.run]


def participant_person(options: StudyOptions, number: int) -> Person:
    """The person behind a participant number (1, 2, ...)."""
    sexes = options.sexes or "MF"
    sex = sexes[(number - 1) % len(sexes)]
    return draw_person(generator(options, number, PERSON), options.richness, sex)


def simulate_participant(
    folder: Path, options: StudyOptions, number: int
) -> tuple[Person, dict[str, dict[str, object]]]:
    """Write all recordings and the truth of one participant; returns the person, and the facts of
    each trial."""
    name = f"sub-{number:02d}"
    person = participant_person(options, number)
    effects = effects_of(options, number)
    for effect in effects:
        person = effect.person(person)
    lab = generator(options, number, LABORATORY)
    heading_error = HEADING_SPREAD_RAD * lab.standard_normal()
    ball_mass = float(lab.uniform(*options.ball_mass_kg))
    (folder / name).mkdir(parents=True, exist_ok=True)
    trials = {}
    for task in options.tasks:
        stem = f"{name}_task-{task}" + ("" if task == "static" else f"_run-{options.run}")
        active = [e for e in effects if touches(e, task, options.effect_tasks)]
        body = [*wobbling(person), *active]
        seed = seed_of(options, number, MOVEMENT, task)
        rng, duration_s = np.random.default_rng(seed), options.durations_s.get(task)
        trial = simulate_trial(person, task, rng, duration_s, ball_mass, body)
        rates, noise = options.rates_of(task), generator(options, number, RECORDING, task)
        world = rates, options.laboratory, options.richness
        measurement = measure_trial(trial, person, *world, noise, heading_error, body)
        path = folder / name / f"{stem}.c3d"
        write_trial(path, measurement, options.richness.quantised, name)
        trials[stem] = _trial_record(trial, measurement, active, seed)
    record = {
        "participant_id": name,
        "options": asdict(options),
        "person": _person_record(person),
        "effects": [{**effect.record(), **effect.facts(person)} for effect in effects],
        "trials": trials,
    }
    write_truth(folder / "truth" / f"{name}_truth.json", record)
    return person, trials


def wobbling(person: Person) -> list[WobblingMass]:
    """What swings on the person's bones; part of the body, no effect that is hidden in it."""
    masses = {name: person.inertias[body_of(name)].mass_kg for name in person.tissue}
    return [
        WobblingMass(one.mass_share * masses[name], name, one.frequency_hz, one.damping_ratio)
        for name, one in person.tissue.items()
    ]


def _person_record(person: Person) -> dict[str, object]:
    """The person in SI units, segment axes."""
    parts = {name: person.inertias[name] for name in ("abdomen", "thorax")}
    segments, markers = person.segment_inertias(), person.markers.items()
    return {
        "sex": person.sex,
        "mass_kg": person.mass_kg,
        "stature_m": person.stature_m,
        **{f"{name}_width_m": person.widths_m[name] for name in ("pelvis", "thorax")},
        "ankle_height_m": person.ankle_height_m,
        "swinging_tissue": {name: asdict(swing) for name, swing in person.tissue.items()},
        "segment_lengths_m": person.lengths_m,
        "joints_in_parent_m": person.joints_m,
        "hinge_axes": person.hinges,
        "segments": {name: _inertia_record(part) for name, part in segments.items()},
        "trunk_parts": {name: _inertia_record(part) for name, part in parts.items()},
        "markers": {k: {"body": one.body, "position_m": one.position_m} for k, one in markers},
    }


def _inertia_record(part: Inertia) -> dict[str, float]:
    """Names and conventions of the inertial-parameter artifact (about the centre of mass)."""
    axes = {axis: number for number, axis in enumerate("xyz")}
    pairs = ("xx", "yy", "zz", "xy", "xz", "yz")
    return {
        "mass_kg": part.mass_kg,
        **{f"com_{axis}_m": x for axis, x in zip("xyz", part.com_m, strict=True)},
        **{f"i{ab}_kgm2": part.tensor_kgm2[axes[ab[0]], axes[ab[1]]] for ab in pairs},
    }


def _trial_record(
    trial: Trial, measurement: Measurement, effects: Sequence[Effect], seed: list[int]
) -> dict[str, object]:
    """Contacts, ball, effects, plate pose and summary of one trial.

    Times are on the movement's clock, on which the file starts at `recorded_from_s`.
    """
    plan, ball = trial.plan, trial.plan.ball
    times, length = plan.recorded_times_s(), len(trial.time_s) * plan.step_s
    spans = [(times[first], times[last]) for first, last in plan.flights]
    on_plate_n = [trial.on_plate[side] * force[:, 1] for side, (force, _) in trial.feet.items()]
    of_the_ball = ("mass_kg", "position_m", "release_s")
    of_a_contact = ("side", "start_s", "end_s", "on_plate")
    return {
        "seed": seed,
        "duration_s": len(measurement.points_m) / measurement.marker_hz,
        "recorded_from_s": measurement.start_s,
        "effects": [effect.name for effect in effects],
        "ball": ball and {"segment": ball.body, **{k: getattr(ball, k) for k in of_the_ball}},
        "contacts": [{name: getattr(one, name) for name in of_a_contact} for one in trial.contacts],
        "flights_s": [np.round(span, 3) for span in spans if span[1] > 0.0 and span[0] < length],
        "all_contacts_measured_share": np.mean(trial.all_contacts_measured()),
        "largest_vertical_force_n": sum(on_plate_n).max(),
        "walkway_to_lab": vars(measurement.pose),
        **plan.notes,
    }


# --- the commands, and effects in measured recordings ---------------------------------------------


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
    preset, tissue = PRESETS[preset_name], soft_tissue == "measured"
    options = replace(
        preset if participants is None else replace(preset, participants=participants, sexes=""),
        seed=preset.seed if seed is None else seed,
        tasks=tuple(tasks) or preset.tasks,
        durations_s=preset.durations_s | ({} if sequence_s is None else {"sequence": sequence_s}),
        laboratory=replace(preset.laboratory, plate_per_foot=plate_per_foot),
        richness=replace(preset.richness, measured_tissue=tissue, girdle=shoulder_girdle),
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
        copy = out if out.suffix.lower() == source.suffix.lower() else out / source.name
        if os.path.lexists(copy):
            raise UsageError("the file is there already", file=copy, remedy="name a new one")
        hidden = effects_of(options, 1)
        with _writing(copy):
            facts = inject_recording(source, copy, hidden)
            record = {**facts, "effects": [effect.record() for effect in hidden]}
            write_truth(copy.with_name(f"{copy.stem}_injected.json"), record)
        click.echo(f"bsip inject: {printable(str(copy))}", err=True)
        return 0
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


_NAMED = re.compile(
    r"(?P<participant>sub-[^_]+)(_ses-[^_]+)?_task-(?P<task>[^_]+).*\.(c3d|trc)$", re.I
)


def inject_recording(source: Path, copy: Path, effects: Sequence[Effect]) -> dict[str, object]:
    """Hide effects in one recording; returns the truth about it.

    UsageError: a file of another kind.
    BadDataError: the recording cannot take an effect.
    """
    kind = source.suffix.lower()
    if kind not in (".c3d", ".trc"):
        raise UsageError("not a recording", file=source, expected="a .c3d, or a .trc with a .mot")
    copy.parent.mkdir(parents=True, exist_ok=True)
    rewrite = rewrite_c3d if kind == ".c3d" else rewrite_trc_mot
    after = rewrite(source, copy, lambda before: _changed_by(effects, before, source))
    return {"recorded_from_s": after.start_s, "effects": [effect.name for effect in effects]}


def _changed_by(effects: Sequence[Effect], instruments: Instruments, file: Path) -> Instruments:
    """Instruments with all effects, each of which must have changed something."""
    lacking = {} if instruments.plates else {"plates": "force plates, and there are none"}
    if not instruments.surfaces_known:
        lacking["surface"] = "to know where the plates lie, and a MOT file does not say"
    for effect in effects:
        if why := next((lacking[need] for need in effect.needs if need in lacking), ""):
            raise BadDataError(f"{effect.name} needs {why}", file=file)
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
    chosen = set(participants or people)
    changed: list[Path] = []
    refused: list[BadDataError] = []
    trials: dict[str, dict[str, object]] = {name: {} for name in people}
    files = _files_in(study, refused, (study,))
    # forces come last: those of a changed TRC file are there by then
    for source in sorted(files, key=lambda path: path.suffix.lower() in ENDINGS):
        relative = source.relative_to(study)
        place, match = out / relative, _NAMED.match(source.name)
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
    write_whole(file, json.dumps(record, indent=1, default=lambda array: array.tolist()) + "\n")
