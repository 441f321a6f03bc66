"""On the plate: quiet stance, squats, an overarm throw, and postures that are held."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from bsip_cli.simulate.numerics import soft_polyline, step, window
from bsip_cli.simulate.people import SIDES, Person
from bsip_cli.simulate.plan import Plan
from bsip_cli.simulate.sketch import (
    Sketch,
    add_breath_of_motion,
    add_squat,
    add_sway,
    held_ball,
    plate_under,
    sketch_for,
)

RIGHT_HANDED_SHARE = 0.9
SOFTNESS_S = 0.032
STAGGER_M = 0.11  # each foot from the middle
# Of a throw, in degrees at: start, cocked, release, followed through, back.
SHOULDER_FLEXION = (0.0, 115.0, 45.0, 5.0, 0.0)
SHOULDER_ABDUCTION = (0.0, 75.0, 78.0, 35.0, 0.0)
ELBOW = (0.0, 95.0, 12.0, 10.0, 0.0)
SNAP = (0.0, -30.0, 10.0, 30.0, 0.0)
FREE_SHOULDER = (0.0, 50.0, 20.0, 0.0, 0.0)
FREE_ELBOW = (0.0, 15.0, 60.0, 50.0, 0.0)
TURN = (0.0, -38.0, 16.0, 34.0, 0.0)
LEAN = (0.0, 8.0, -14.0, -28.0, 0.0)


def static(person: Person, rng: np.random.Generator, duration_s: float, _ball: float) -> Plan:
    """Upright and nearly still, arms slightly away from the body."""
    sketch = sketch_for(person, duration_s)
    for side in SIDES:
        sketch.angles[f"shoulder_{side}"][:, 1] += np.deg2rad(13.0)
    add_breath_of_motion(sketch, rng, np.deg2rad(0.15))
    add_sway(sketch, rng, 0.4)
    return sketch.plan(plate_centre_m=plate_under(sketch, rng))


def squat(person: Person, rng: np.random.Generator, duration_s: float, _ball: float) -> Plan:
    """Several squats with the arms raised in front."""
    sketch = sketch_for(person, duration_s)
    count = max(2, round(duration_s / 1.7))
    down = np.zeros_like(sketch.t_s)
    for start, end in pairwise(np.linspace(0.1, duration_s - 0.1, count + 1)):
        depth, pause = rng.uniform(0.6, 1.0), rng.uniform(0.0, 0.15)
        down += depth * window(sketch.t_s, start + pause, end, 0.5 * (end - start - pause))
    add_squat(sketch, down, 0.16 * person.stature_m)
    for side in SIDES:
        sketch.angles[f"shoulder_{side}"][:, 0] += np.deg2rad(rng.uniform(55.0, 75.0)) * down
    add_breath_of_motion(sketch, rng, np.deg2rad(0.4))
    add_sway(sketch, rng)
    return sketch.plan(plate_centre_m=plate_under(sketch, rng), sway_share=0.3)


def throwing(
    person: Person, rng: np.random.Generator, duration_s: float, ball_mass_kg: float
) -> Plan:
    """Stand with one foot ahead, cock the arm, throw, follow through, stand."""
    sketch = sketch_for(person, duration_s)
    angles, feet = sketch.angles, sketch.feet
    side, other = ("r", "l") if rng.random() < RIGHT_HANDED_SHARE else ("l", "r")
    feet[side].ahead_m -= STAGGER_M
    feet[other].ahead_m += STAGGER_M
    throw_s, release = rng.uniform(0.20, 0.26), 0.5 * duration_s
    frames = np.array([0.15, release - throw_s, release, release + 0.22, duration_s - 0.15])

    def curve(degrees: tuple[float, ...], early_s: float = 0.0) -> np.ndarray:
        size = np.deg2rad(np.array(degrees)) * rng.uniform(0.85, 1.1)
        return soft_polyline(sketch.t_s, frames - early_s, size, SOFTNESS_S)

    angles[f"shoulder_{side}"][:, 0] += curve(SHOULDER_FLEXION)
    angles[f"shoulder_{side}"][:, 1] += curve(SHOULDER_ABDUCTION)
    angles[f"elbow_{side}"] += curve(ELBOW, 0.01)
    angles[f"wrist_{side}"][:, 0] += curve(SNAP)
    # the free arm points ahead, then comes in
    angles[f"shoulder_{other}"][:, 0] += curve(FREE_SHOULDER)
    angles[f"elbow_{other}"] += curve(FREE_ELBOW)
    turn = (1.0 if side == "r" else -1.0) * curve(TURN, 0.04)
    angles["waist"][:, 2] += 0.7 * turn
    sketch.pelvis_angles[:, 2] += 0.3 * turn
    angles["waist"][:, 0] += curve(LEAN)
    angles["neck"][:, 2] -= 0.7 * turn
    dip = step(sketch.t_s, frames[0], frames[1]) - step(sketch.t_s, frames[3], frames[4])
    add_squat(sketch, dip, 0.04 * person.stature_m)
    for name in SIDES:
        angles[f"wrist_{name}"][:, 2] -= np.deg2rad(20.0) * dip
    ahead = 0.25 * soft_polyline(sketch.t_s, frames, np.array([0, -1.0, 0.6, 1.0, 0]), 0.08)
    feet[other].share += ahead
    feet[side].share -= ahead
    add_breath_of_motion(sketch, rng, np.deg2rad(0.4))
    add_sway(sketch, rng, 0.6)
    ball = held_ball(sketch, rng, side, release, ball_mass_kg)
    return sketch.plan(
        plate_centre_m=plate_under(sketch, rng),
        sway_share=0.3,
        ball=ball,
        notes={"throwing_side": side},
    )


def postures(person: Person, rng: np.random.Generator, duration_s: float, _ball: float) -> Plan:
    """A bow, arms ahead and aside, each leg raised with a bent and a straight knee: all held."""
    sketch = sketch_for(person, duration_s)
    starts = np.linspace(0.0, duration_s, 8)
    for number, (start, end) in enumerate(pairwise(starts)):
        shift = 0.3 * (end - start)
        held = window(sketch.t_s, start, end, shift) * rng.uniform(0.85, 1.0)
        if number == 0:
            sketch.angles["waist"][:, 0] -= np.deg2rad(35.0) * held
        elif number < 3:
            for side in SIDES:
                sketch.angles[f"shoulder_{side}"][:, number - 1] += np.deg2rad(80.0) * held
        else:
            _raise_leg(sketch, SIDES[number % 2], number < 5, (start, end, shift), held)
    add_breath_of_motion(sketch, rng, np.deg2rad(0.2))
    add_sway(sketch, rng)
    return sketch.plan(plate_centre_m=plate_under(sketch, rng), sway_share=0.3)


def _raise_leg(
    sketch: Sketch, side: str, bent: bool, times_s: tuple[float, float, float], held: np.ndarray
) -> None:
    """Stand on the other leg for the middle of (start, end), and hold the foot ahead and up."""
    start, end, shift = times_s
    other, foot, stature = SIDES[side == "l"], sketch.feet[side], sketch.person.stature_m
    part = 0.5 * window(sketch.t_s, start, end, 0.5 * shift)
    sketch.feet[side].share -= part
    sketch.feet[other].share += part
    lifted = held * window(sketch.t_s, start + 0.5 * shift, end - 0.5 * shift, 0.8 * shift)
    ahead, up, tilt_deg = (0.14, 0.22, 0.0) if bent else (0.30, 0.16, 35.0)
    foot.raised_m[:, 0] += ahead * stature * lifted
    foot.raised_m[:, 1] += up * stature * lifted
    foot.tilt_rad[:, 0] += np.deg2rad(tilt_deg) * lifted
