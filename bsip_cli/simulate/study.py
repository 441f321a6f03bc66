"""Write a whole study folder with a known truth next to it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np

from bsip_cli.errors import UsageError
from bsip_cli.simulate.effects import effects_of, touches
from bsip_cli.simulate.effects.base import Effect, body_of
from bsip_cli.simulate.effects.loads import WobblingMass
from bsip_cli.simulate.movements import MOVEMENTS
from bsip_cli.simulate.options import ALL_TASKS, MORE_TASKS, StudyOptions
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
    write_text(folder / "participants.tsv", "\n".join(lines) + "\n")
    with_girdle = 'marker_set = "robert17"\nskeleton = "robert17"\n'
    settings = with_girdle if options.richness.girdle else 'marker_set = "hansen2017"\n'
    write_text(folder / "study.toml", settings)
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
    if options.participants < 1:
        raise UsageError("no participants", expected="at least one")
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
    write_text(folder / "truth" / f"{name}_truth.json", json.dumps(record, indent=1) + "\n")
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
    segments = person.segment_inertias()
    return {
        "sex": person.sex,
        "mass_kg": person.mass_kg,
        "stature_m": person.stature_m,
        **{f"{name}_width_m": person.widths_m[name] for name in ("pelvis", "thorax")},
        "ankle_height_m": person.ankle_height_m,
        "swinging_tissue": {name: asdict(swing) for name, swing in person.tissue.items()},
        "segment_lengths_m": person.lengths_m,
        "joints_in_parent_m": {name: p.tolist() for name, p in person.joints_m.items()},
        "hinge_axes": {name: axis.tolist() for name, axis in person.hinges.items()},
        "segments": {name: _inertia_record(part) for name, part in segments.items()},
        "trunk_parts": {name: _inertia_record(part) for name, part in parts.items()},
        "markers": {
            label: {"body": marker.body, "position_m": marker.position_m.tolist()}
            for label, marker in person.markers.items()
        },
    }


def _inertia_record(part: Inertia) -> dict[str, float]:
    """Names and conventions of the inertial-parameter artifact (about the centre of mass)."""
    tensor = part.tensor_kgm2
    record = {"mass_kg": part.mass_kg}
    record |= {f"com_{a}_m": part.com_m[i] for i, a in enumerate("xyz")}
    record |= {f"i{a}{a}_kgm2": tensor[i, i] for i, a in enumerate("xyz")}
    record |= {"ixy_kgm2": tensor[0, 1], "ixz_kgm2": tensor[0, 2], "iyz_kgm2": tensor[1, 2]}
    return {name: float(value) for name, value in record.items()}


def _trial_record(
    trial: Trial, measurement: Measurement, effects: Sequence[Effect], seed: list[int]
) -> dict[str, object]:
    """Contacts, ball, effects, plate pose and summary of one trial.

    Times are on the movement's clock, on which the file starts at `recorded_from_s`.
    """
    pose, plan, ball = measurement.pose, trial.plan, trial.plan.ball
    times = plan.recorded_times_s()
    spans = [(times[first], times[last]) for first, last in plan.flights]
    length = len(trial.time_s) * plan.step_s
    on_plate_n = [trial.on_plate[s] * force[:, 1] for s, force in trial.feet_force_n.items()]
    held = ball and {
        "segment": ball.body,
        "mass_kg": ball.mass_kg,
        "position_m": ball.position_m.tolist(),
        "release_s": ball.release_s,
    }
    of_a_contact = ("side", "start_s", "end_s", "on_plate")
    inside = (span for span in spans if span[1] > 0.0 and span[0] < length)
    return {
        "seed": seed,
        "duration_s": len(measurement.points_m) / measurement.marker_hz,
        "recorded_from_s": measurement.start_s,
        "effects": [effect.name for effect in effects],
        "ball": held,
        "contacts": [{name: getattr(one, name) for name in of_a_contact} for one in trial.contacts],
        "flights_s": [[round(float(time), 3) for time in span] for span in inside],
        "all_contacts_measured_share": float(np.mean(trial.all_contacts_measured())),
        "largest_vertical_force_n": float(sum(on_plate_n).max()),
        "walkway_to_lab": {"rotation": pose.rotation.tolist(), "offset_m": pose.offset_m.tolist()},
        **plan.notes,
    }


def write_text(path: Path, text: str) -> None:
    """Under a temporary name first: no half file under the final one."""
    partial = path.with_name(path.name + ".part")
    partial.write_text(text, encoding="utf-8")
    partial.replace(path)
