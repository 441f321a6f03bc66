"""A jump throw: squat, jump, let the ball go near the highest point, land, settle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bsip_cli.simulate.calculus import bridge
from bsip_cli.simulate.curves import glide, soft_polyline, step
from bsip_cli.simulate.kinematics import centre_of_mass, poses_of, turns_of
from bsip_cli.simulate.loads import GRAVITY
from bsip_cli.simulate.movements.standing import add_breath_of_motion, add_sway, plate_under
from bsip_cli.simulate.people import SIDES, Person
from bsip_cli.simulate.plan import STEP_S, Plan
from bsip_cli.simulate.sketch import Sketch, held_ball, sketch_for

G = -GRAVITY[1]


@dataclass(frozen=True)
class Jump:
    """Times [s] and heights [m] (relative to standing) of one jump."""

    start_s: float
    bottom_s: float
    takeoff_s: float
    landing_s: float
    caught_s: float
    end_s: float
    takeoff_m: float
    depth_m: float
    speed_m_s: float


def basketball(
    person: Person, rng: np.random.Generator, duration_s: float, ball_mass_kg: float
) -> Plan:
    """Both feet on the plate, flight, both feet on the plate again."""
    sketch = sketch_for(person, duration_s)
    jump = _draw_jump(sketch, rng, duration_s)
    side = str(rng.choice(SIDES, p=(0.1, 0.9)))
    release = 0.55 * jump.takeoff_s + 0.45 * jump.landing_s
    _legs(sketch, jump)
    _arms(sketch, rng, jump, release)
    add_breath_of_motion(sketch, rng, np.deg2rad(0.3))
    add_sway(sketch, rng, 0.6)
    ball = held_ball(sketch, rng, side, release, ball_mass_kg)
    return sketch.plan(
        com_height_m=standing_com_height(sketch) + _rise(sketch, jump),
        flights=(tuple(sample_of(sketch, s) for s in (jump.takeoff_s, jump.landing_s)),),
        plate_centre_m=plate_under(sketch, rng),
        ball=ball,
        notes={"throwing_side": side},
    )


def sample_of(sketch: Sketch, time_s: float) -> int:
    """The sample at a time of the sketch."""
    return round((time_s - sketch.t_s[0]) / STEP_S)


def _draw_jump(sketch: Sketch, rng: np.random.Generator, duration_s: float) -> Jump:
    speed = rng.uniform(1.55, 1.85)
    depth = rng.uniform(0.115, 0.135) * sketch.person.stature_m
    dip, push, caught = 0.52, 0.24, 0.24
    flight = 2.0 * speed / G
    settle = 0.62
    start = max(0.12, 0.5 * (duration_s - dip - push - flight - caught - settle))
    times = np.round(start + np.cumsum([0.0, dip, push, flight, caught, settle]), 3)
    speed = 0.5 * G * (times[3] - times[2])
    start, bottom, takeoff, landing, caught, end = times.tolist()
    return Jump(start, bottom, takeoff, landing, caught, end, 0.01, depth, speed)


def standing_com_height(sketch: Sketch) -> float:
    """Height of the centre of mass in the first sample."""
    first = sketch.plan().thinned(len(sketch.t_s))
    turns = turns_of(sketch.person, first)
    poses = poses_of(sketch.person, first, turns, first.pelvis_m, turns["lower_torso"])
    return float(centre_of_mass(sketch.person, poses)[0, 1])


def _rise(sketch: Sketch, jump: Jump) -> np.ndarray:
    """(T,) rise of the centre of mass: septic pieces between events, a fall in flight."""
    t = sketch.t_s
    rest = np.array([0.0, 0.0, 0.0, 0.0])
    bottom = np.array([-jump.depth_m, 0.0, 1.0 * G, 0.0])
    leave = np.array([jump.takeoff_m, jump.speed_m_s, -G, 0.0])
    arrive = np.array([jump.takeoff_m, -jump.speed_m_s, -G, 0.0])
    knots = [
        (jump.start_s, jump.bottom_s, rest, bottom),
        (jump.bottom_s, jump.takeoff_s, bottom, leave),
        (jump.landing_s, jump.caught_s, arrive, bottom),
        (jump.caught_s, jump.end_s, bottom, rest),
    ]
    height = np.zeros_like(t)
    for first, last, a, b in knots:
        inside = (t >= first) & (t <= last)
        piece = bridge(a[:, None], b[:, None], last - first, t[inside] - first)
        height[inside] = piece[:, 0]
    air = (t > jump.takeoff_s) & (t < jump.landing_s)
    since = t[air] - jump.takeoff_s
    height[air] = jump.takeoff_m + jump.speed_m_s * since - 0.5 * G * since**2
    return height


def _legs(sketch: Sketch, jump: Jump) -> None:
    """Heels rise before take-off, feet come up in the air, land toes first."""
    t = sketch.t_s
    apex = 0.5 * (jump.takeoff_s + jump.landing_s)
    half = apex - jump.takeoff_s
    rise = glide(t, jump.takeoff_s, apex + 0.2 * half, 0.06)
    fall = glide(t, apex - 0.2 * half, jump.landing_s, 0.06)
    height = 0.85 * 0.5 * jump.speed_m_s**2 / G
    push = step(t, jump.takeoff_s - 0.20, jump.takeoff_s + 0.08)
    catch = step(t, jump.landing_s - 0.08, jump.landing_s + 0.16)
    for side in SIDES:
        foot = sketch.feet[side]
        foot.raised_m[:, 1] += height * (rise - fall)
        foot.toe_roll_rad += np.deg2rad(62.0) * (push - catch)
        toes = step(t, jump.takeoff_s - 0.25, jump.takeoff_s - 0.1)
        toes = toes - step(t, jump.landing_s, jump.landing_s + 0.15)
        foot.cop_ahead_m += 0.42 * sketch.person.lengths_m[f"foot_{side}"] * toes
        foot.share[(t > jump.takeoff_s) & (t < jump.landing_s)] = 0.0


def _arms(sketch: Sketch, rng: np.random.Generator, jump: Jump, release_s: float) -> None:
    """Hold the ball low while squatting, lift it overhead, push it away."""
    frames = np.array(
        [jump.start_s, jump.bottom_s, jump.takeoff_s, release_s, jump.landing_s, jump.end_s]
    )
    size = rng.uniform(0.9, 1.1)
    flexion = size * np.deg2rad([0.0, 25.0, 85.0, 125.0, 90.0, 0.0])
    elbow = size * np.deg2rad([30.0, 70.0, 85.0, 10.0, 20.0, 0.0])
    lean = np.deg2rad([0.0, -28.0, -4.0, -3.0, -6.0, 0.0])
    for side in SIDES:
        shoulder = sketch.angles[f"shoulder_{side}"]
        shoulder[:, 0] += soft_polyline(sketch.t_s, frames, flexion, 0.05)
        sketch.angles[f"elbow_{side}"] += soft_polyline(sketch.t_s, frames, elbow, 0.04)
    sketch.angles["waist"][:, 0] += soft_polyline(sketch.t_s, frames, lean, 0.06)
    sketch.pelvis_angles[:, 0] += soft_polyline(sketch.t_s, frames, 0.7 * lean, 0.06)
    sketch.angles["neck"][:, 0] -= soft_polyline(sketch.t_s, frames, 1.3 * lean, 0.06)
