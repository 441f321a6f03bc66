"""Quiet standing and squats, both feet on the plate."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from bsip_cli.simulate.curves import wander, window
from bsip_cli.simulate.people import SIDES, Person
from bsip_cli.simulate.plan import Plan
from bsip_cli.simulate.sketch import Sketch, sketch_for

SWAY_M = (0.004, 0.003)  # ahead, aside


def plate_under(sketch: Sketch, rng: np.random.Generator) -> tuple[float, float]:
    """A plate centre near the middle of natural stance."""
    return (sketch.mid_foot_m() + rng.normal(0.0, 0.02), rng.normal(0.0, 0.03))


def add_sway(sketch: Sketch, rng: np.random.Generator, scale: float = 1.0) -> None:
    """Slow wandering of the COP: along the feet, and between them while both carry load."""
    t = sketch.t_s
    ahead = wander(t, rng, scale * SWAY_M[0], 0.15, 0.8)
    aside = wander(t, rng, scale * SWAY_M[1], 0.15, 0.8) / (2.0 * sketch.half_stance_m())
    for side in SIDES:
        sketch.feet[side].cop_ahead_m += ahead
    aside *= 4.0 * sketch.feet["r"].share * sketch.feet["l"].share
    sketch.feet["r"].share += aside
    sketch.feet["l"].share -= aside


def add_breath_of_motion(sketch: Sketch, rng: np.random.Generator, size_rad: float) -> None:
    """Tiny wandering of all joint angles of the upper body, and of the pelvis."""
    for angle in [*sketch.angles.values(), sketch.pelvis_angles]:
        for column in np.atleast_2d(angle.T):
            column += wander(sketch.t_s, rng, size_rad, 0.15, 0.7)


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
    times = np.linspace(0.1, duration_s - 0.1, count + 1)
    down = np.zeros_like(sketch.t_s)
    for start, end in pairwise(times):
        depth = rng.uniform(0.6, 1.0)
        pause = rng.uniform(0.0, 0.15)
        down += depth * window(sketch.t_s, start + pause, end, 0.5 * (end - start - pause))
    add_squat(sketch, down, 0.16 * person.stature_m)
    for side in SIDES:
        lift = np.deg2rad(rng.uniform(55.0, 75.0)) * down
        sketch.angles[f"shoulder_{side}"][:, 0] += lift
    add_breath_of_motion(sketch, rng, np.deg2rad(0.4))
    add_sway(sketch, rng)
    return sketch.plan(plate_centre_m=plate_under(sketch, rng), sway_share=0.3)


def add_squat(sketch: Sketch, down: np.ndarray, depth_m: float) -> None:
    """Lower the pelvis by depth_m times `down` (T,), and lean the trunk with it."""
    sketch.pelvis_m[:, 1] -= depth_m * down
    lean = np.deg2rad(60.0) * depth_m * down
    sketch.pelvis_angles[:, 0] -= 1.6 * lean
    sketch.angles["waist"][:, 0] -= 1.5 * lean
    sketch.angles["neck"][:, 0] += 1.5 * lean
