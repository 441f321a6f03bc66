"""Write a whole study folder with a known truth beside it."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

import numpy as np

from bsip_cli.errors import UsageError
from bsip_cli.simulate.asked import effects_of, touches
from bsip_cli.simulate.effects.places import body_of
from bsip_cli.simulate.effects.wobbling_mass import WobblingMass
from bsip_cli.simulate.movements import DEFAULT_DURATION_S, MOVEMENTS
from bsip_cli.simulate.options import ALL_TASKS, MORE_TASKS, Rates, StudyOptions
from bsip_cli.simulate.people import Person, draw_person
from bsip_cli.simulate.recording import SIMULATION_HZ, write_trial
from bsip_cli.simulate.trial import simulate_trial
from bsip_cli.simulate.truth import ParticipantTruth, StudyTruth, person_record, trial_record

HEADING_SPREAD_RAD = np.deg2rad(2.0)
SCALE_SPREAD_KG = 0.1
# Which stream of random numbers serves what, so that no draw depends on another's count.
PERSON, MOVEMENT, RECORDING, LABORATORY = range(4)
TASK_STREAMS = (*ALL_TASKS, "", *MORE_TASKS)  # new tasks at the end: old studies stay the same


def simulate_study(folder: Path, options: StudyOptions) -> StudyTruth:
    """Write participants.tsv, study.toml, the recordings and truth/ into the folder."""
    folder = Path(folder)
    check_options(options)
    (folder / "truth").mkdir(parents=True, exist_ok=True)
    truths = [
        simulate_participant(folder, options, number)
        for number in range(1, options.participants + 1)
    ]
    _write_text(folder / "participants.tsv", _participants_table(options, truths))
    _write_text(folder / "study.toml", _settings(options))
    return StudyTruth(tuple(truths))


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
    if options.participants < 1:
        raise UsageError("no participants", expected="at least one")
    for task in options.tasks:
        _check_rates(options.rates_of(task))


def _check_rates(rates: Rates) -> None:
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


def simulate_participant(folder: Path, options: StudyOptions, number: int) -> ParticipantTruth:
    """Write all recordings and the truth of one participant."""
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
        trial = simulate_trial(
            person,
            task,
            generator(options, number, MOVEMENT, task),
            options.durations_s.get(task, DEFAULT_DURATION_S[task]),
            ball_mass,
            body,
        )
        measurement = write_trial(
            folder / name / f"{stem}.c3d",
            trial,
            person,
            options.rates_of(task),
            options.laboratory,
            options.richness,
            generator(options, number, RECORDING, task),
            heading_error,
            name,
            body,
        )
        trials[stem] = trial_record(
            trial, measurement, active, seed_of(options, number, MOVEMENT, task)
        )
    truth = ParticipantTruth(name, person, trials)
    record = {
        "participant_id": name,
        "options": asdict(options),
        "person": person_record(person),
        "effects": [{**effect.record(), **effect.facts(person)} for effect in effects],
        "trials": trials,
    }
    _write_text(folder / "truth" / f"{name}_truth.json", json.dumps(record, indent=1) + "\n")
    return truth


def wobbling(person: Person) -> list[WobblingMass]:
    """What swings on the person's bones; part of the body, no effect that is hidden in it."""
    return [
        WobblingMass(
            swing.mass_share * person.inertias[body_of(segment)].mass_kg,
            segment,
            swing.frequency_hz,
            swing.damping_ratio,
        )
        for segment, swing in person.tissue.items()
    ]


def _settings(options: StudyOptions) -> str:
    if options.richness.girdle:
        return 'marker_set = "robert17"\nskeleton = "robert17"\n'
    return 'marker_set = "hansen2017"\n'


def _participants_table(options: StudyOptions, truths: list[ParticipantTruth]) -> str:
    """As a lab would note it: mass from a scale, height from a wall."""
    lines = ["participant_id\tsex\tmass_kg\theight_m"]
    for number, truth in enumerate(truths, start=1):
        scale = generator(options, number, LABORATORY, "static")
        mass = truth.person.mass_kg + SCALE_SPREAD_KG * scale.standard_normal()
        height = truth.person.stature_m
        lines.append(f"{truth.participant}\t{truth.person.sex}\t{mass:.1f}\t{height:.2f}")
    return "\n".join(lines) + "\n"


def _write_text(path: Path, text: str) -> None:
    partial = path.with_name(path.name + ".part")
    partial.write_text(text, encoding="utf-8")
    partial.replace(path)
