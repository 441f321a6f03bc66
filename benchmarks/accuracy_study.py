"""A study of simulated people with good and poor recordings. Import ``measure`` before this."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from bsip_cli.simulate.balance import balanced
from bsip_cli.simulate.numerics import window
from bsip_cli.simulate.options import PRESETS
from bsip_cli.simulate.people import Person
from bsip_cli.simulate.plan import Plan, add_breath_of_motion, add_sway, plate_under, sketch_for
from bsip_cli.simulate.recording import (
    THIN,
    Trial,
    measure_trial,
    simulate_trial,
    trial_of,
    write_trial,
)
from bsip_cli.simulate.study import participant_person, simulate_study

POOR_S = 10.0
SQUATS, ONE_ARM = "squats", "onearm"
RAISED_RAD = np.deg2rad([20.0, 10.0, 0.0])  # of the right shoulder, about Z, X and Y
BENT_RAD = np.deg2rad(10.0)
PACE_HZ = 0.5


def write_study(folder: Path, people: int, seed: int, quick: bool = False) -> None:
    """The preset ``sample`` with other people, and two poor recordings of each.

    quick : static trial and sequence alone.
    """
    options = replace(PRESETS["sample"], participants=people, seed=seed)
    if quick:
        simulate_study(folder, replace(options, tasks=("static", "sequence")))
        return
    simulate_study(folder, options)
    for number in range(1, people + 1):
        person = participant_person(options, number)
        for k, (task, move) in enumerate(POOR.items()):
            rng = np.random.default_rng([seed, number, k])
            name = f"sub-{number:02d}"
            measured = measure_trial(
                move(person, rng),
                person,
                options.rates_of("squat"),
                options.laboratory,
                options.richness,
                rng,
            )
            path = folder / name / f"{name}_task-{task}_run-1.c3d"
            write_trial(path, measured, options.richness.quantised, name)


def squats(person: Person, rng: np.random.Generator) -> Trial:
    return simulate_trial(person, "squat", rng, POOR_S)


def one_arm(person: Person, rng: np.random.Generator) -> Trial:
    """Standing, and the right arm swings a little."""
    plan = one_arm_plan(person, rng)
    return trial_of(person, ONE_ARM, plan, balanced(person, plan, THIN))


def one_arm_plan(person: Person, rng: np.random.Generator) -> Plan:
    sketch = sketch_for(person, POOR_S)
    phase = rng.uniform(0.0, 2.0 * np.pi)
    inside = window(sketch.t_s, 0.0, POOR_S, 0.6)
    swing = inside * (1.0 - np.cos(2.0 * np.pi * PACE_HZ * sketch.t_s + phase)) / 2.0
    sketch.angles["shoulder_r"] += RAISED_RAD * swing[:, None]
    sketch.angles["elbow_r"] += BENT_RAD * swing
    add_breath_of_motion(sketch, rng, np.deg2rad(0.2))
    add_sway(sketch, rng, 1.0)
    return sketch.plan(plate_centre_m=plate_under(sketch, rng))


POOR = {SQUATS: squats, ONE_ARM: one_arm}
