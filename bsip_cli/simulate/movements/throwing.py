"""An overarm throw with both feet on the plate."""

from __future__ import annotations

import numpy as np

from bsip_cli.simulate.curves import soft_polyline, step
from bsip_cli.simulate.movements.standing import (
    add_breath_of_motion,
    add_squat,
    add_sway,
    plate_under,
)
from bsip_cli.simulate.people import SIDES, Person
from bsip_cli.simulate.plan import Plan
from bsip_cli.simulate.sketch import Sketch, held_ball, sketch_for

RIGHT_HANDED_SHARE = 0.9
SOFTNESS_S = 0.032
STAGGER_M = 0.11  # each foot from the middle
# Degrees at: start, cocked, release, followed through, back (relative times below).
SHOULDER_FLEXION = (0.0, 115.0, 45.0, 5.0, 0.0)
SHOULDER_ABDUCTION = (0.0, 75.0, 78.0, 35.0, 0.0)
ELBOW = (0.0, 95.0, 12.0, 10.0, 0.0)
TURN = (0.0, -38.0, 16.0, 34.0, 0.0)
LEAN = (0.0, 8.0, -14.0, -28.0, 0.0)


def throwing(
    person: Person, rng: np.random.Generator, duration_s: float, ball_mass_kg: float
) -> Plan:
    """Stand with one foot ahead, cock the arm, throw, follow through, stand."""
    sketch = sketch_for(person, duration_s)
    side = "r" if rng.random() < RIGHT_HANDED_SHARE else "l"
    other = "l" if side == "r" else "r"
    sketch.feet[side].ahead_m -= STAGGER_M
    sketch.feet[other].ahead_m += STAGGER_M
    throw_s = rng.uniform(0.20, 0.26)
    release = 0.5 * duration_s
    frames = np.array([0.15, release - throw_s, release, release + 0.22, duration_s - 0.15])
    _throwing_arm(sketch, rng, side, frames)
    _other_arm(sketch, rng, other, frames)
    _trunk(sketch, rng, side, frames)
    ahead = 0.25 * soft_polyline(sketch.t_s, frames, np.array([0, -1.0, 0.6, 1.0, 0]), 0.08)
    sketch.feet[other].share += ahead
    sketch.feet[side].share -= ahead
    add_breath_of_motion(sketch, rng, np.deg2rad(0.4))
    add_sway(sketch, rng, 0.6)
    ball = held_ball(sketch, rng, side, release, ball_mass_kg)
    return sketch.plan(
        plate_centre_m=plate_under(sketch, rng),
        sway_share=0.3,
        ball=ball,
        notes={"throwing_side": side},
    )


def _curve(
    sketch: Sketch, rng: np.random.Generator, frames: np.ndarray, degrees: tuple[float, ...]
) -> np.ndarray:
    size = np.deg2rad(np.array(degrees)) * rng.uniform(0.85, 1.1)
    return soft_polyline(sketch.t_s, frames, size, SOFTNESS_S)


def _throwing_arm(sketch: Sketch, rng: np.random.Generator, side: str, frames: np.ndarray) -> None:
    sketch.angles[f"shoulder_{side}"][:, 0] += _curve(sketch, rng, frames, SHOULDER_FLEXION)
    sketch.angles[f"shoulder_{side}"][:, 1] += _curve(sketch, rng, frames, SHOULDER_ABDUCTION)
    sketch.angles[f"elbow_{side}"] += _curve(sketch, rng, frames - 0.01, ELBOW)
    snap = _curve(sketch, rng, frames, (0.0, -30.0, 10.0, 30.0, 0.0))
    sketch.angles[f"wrist_{side}"][:, 0] += snap


def _other_arm(sketch: Sketch, rng: np.random.Generator, side: str, frames: np.ndarray) -> None:
    """The free arm points ahead, then comes in."""
    flexion = _curve(sketch, rng, frames, (0.0, 50.0, 20.0, 0.0, 0.0))
    bend = _curve(sketch, rng, frames, (0.0, 15.0, 60.0, 50.0, 0.0))
    sketch.angles[f"shoulder_{side}"][:, 0] += flexion
    sketch.angles[f"elbow_{side}"] += bend


def _trunk(sketch: Sketch, rng: np.random.Generator, side: str, frames: np.ndarray) -> None:
    sign = 1.0 if side == "r" else -1.0
    turn = sign * _curve(sketch, rng, frames - 0.04, TURN)
    sketch.angles["waist"][:, 2] += 0.7 * turn
    sketch.pelvis_angles[:, 2] += 0.3 * turn
    sketch.angles["waist"][:, 0] += _curve(sketch, rng, frames, LEAN)
    sketch.angles["neck"][:, 2] -= 0.7 * turn
    dip = step(sketch.t_s, frames[0], frames[1]) - step(sketch.t_s, frames[3], frames[4])
    add_squat(sketch, dip, 0.04 * sketch.person.stature_m)
    for name in SIDES:
        sketch.angles[f"wrist_{name}"][:, 2] -= np.deg2rad(20.0) * dip
