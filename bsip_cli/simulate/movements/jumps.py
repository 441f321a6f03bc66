"""Flights from both feet: a jump throw, and hops on the spot whose landings strike."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bsip_cli.simulate.kinematics import poses_of, turns_of
from bsip_cli.simulate.numerics import bridge, glide, integral, soft_polyline, step
from bsip_cli.simulate.people import SIDES, Person
from bsip_cli.simulate.plan import (
    STEP_S,
    G,
    Plan,
    Sketch,
    held_ball,
    moved_a_little,
    plate_under,
    sketch_for,
)

TAKEOFF_M = 0.01  # height of the centre of mass at take-off and landing, against standing
STANCE_S = 0.30  # between hops
IMPACT_S = (0.008, 0.070)  # start and end of the strike after touch-down
MOST_HOPS = 12


@dataclass(frozen=True, eq=False)
class Jumps:
    """Equal jumps: dip to the bottom, push off, fly, are caught, and settle.

    takeoffs_s, landings_s : (n,) of each flight. depth_m : of the first dip and last catch, against
    standing. speed_m_s : at each take-off.
    """

    start_s: float
    bottom_s: float
    takeoffs_s: np.ndarray
    landings_s: np.ndarray
    caught_s: float
    end_s: float
    depth_m: float
    speed_m_s: float


@dataclass(frozen=True)
class Feet:
    """How the feet move with each flight.

    roll_rad : of the heels, over push_s and catch_s about take-off and landing.
    toes_s : in which the load goes to the toes and comes back.
    """

    roll_rad: float
    push_s: tuple[float, float]
    catch_s: tuple[float, float]
    toes_s: tuple[float, float, float]


JUMP = Feet(np.deg2rad(62.0), (0.20, 0.08), (0.08, 0.16), (0.25, 0.1, 0.15))
HOP = Feet(np.deg2rad(42.0), (0.17, 0.06), (0.06, 0.12), (0.25, 0.05, 0.2))


def basketball(
    person: Person, rng: np.random.Generator, duration_s: float, ball_mass_kg: float
) -> Plan:
    """Squat, jump, let the ball go near the highest point, land, settle."""
    sketch = sketch_for(person, duration_s)
    t, angles = sketch.t_s, sketch.angles
    speed = rng.uniform(1.55, 1.85)
    depth = rng.uniform(0.115, 0.135) * person.stature_m
    lengths = [0.0, 0.52, 0.24, 2.0 * speed / G, 0.24, 0.62]
    start = max(0.12, 0.5 * (duration_s - lengths[1] - lengths[2] - lengths[3] - 0.24 - 0.62))
    times = np.round(start + np.cumsum(lengths), 3)
    start, bottom, takeoff, landing, caught, end = times.tolist()
    speed = 0.5 * G * (landing - takeoff)
    jump = Jumps(start, bottom, times[2:3], times[3:4], caught, end, depth, speed)
    side = str(rng.choice(SIDES, p=(0.1, 0.9)))
    release = 0.55 * takeoff + 0.45 * landing
    _move_feet(sketch, jump, JUMP)
    apex = 0.5 * (takeoff + landing)
    overlap = 0.2 * (apex - takeoff)
    up, down = glide(t, takeoff, apex + overlap, 0.06), glide(t, apex - overlap, landing, 0.06)
    for foot in sketch.feet.values():
        foot.raised_m[:, 1] += 0.85 * 0.5 * speed**2 / G * (up - down)
    frames = np.array([start, bottom, takeoff, release, landing, end])
    size = rng.uniform(0.9, 1.1)
    flexion = size * np.deg2rad([0.0, 25.0, 85.0, 125.0, 90.0, 0.0])
    elbow = size * np.deg2rad([30.0, 70.0, 85.0, 10.0, 20.0, 0.0])
    lean = np.deg2rad([0.0, -28.0, -4.0, -3.0, -6.0, 0.0])
    for name in SIDES:
        angles[f"shoulder_{name}"][:, 0] += soft_polyline(t, frames, flexion, 0.05)
        angles[f"elbow_{name}"] += soft_polyline(t, frames, elbow, 0.04)
    angles["waist"][:, 0] += soft_polyline(t, frames, lean, 0.06)
    sketch.pelvis_angles[:, 0] += soft_polyline(t, frames, 0.7 * lean, 0.06)
    angles["neck"][:, 0] -= soft_polyline(t, frames, 1.3 * lean, 0.06)
    moved_a_little(sketch, rng, 0.3, 0.6)
    ball = held_ball(sketch, rng, side, release, ball_mass_kg)
    return _plan(sketch, rng, jump, _rise(sketch, jump), ball=ball, notes={"throwing_side": side})


def hops(person: Person, rng: np.random.Generator, duration_s: float, _ball: float) -> Plan:
    """Stand, hop several times, stand again."""
    sketch = sketch_for(person, duration_s)
    t = sketch.t_s
    dip, push, catch, settle = 0.50, 0.24, 0.26, 0.70
    flight = round(2.0 * rng.uniform(1.15, 1.45) / G, 3)
    around = 0.5 + dip + push + catch + settle
    room = duration_s - around + STANCE_S
    count = int(np.clip(np.floor(room / (flight + STANCE_S)), 1, MOST_HOPS))
    used = dip + push + count * flight + (count - 1) * STANCE_S + catch + settle
    start = round(max(0.1, 0.5 * (duration_s - used)), 3)
    takeoffs = start + dip + push + np.arange(count) * (flight + STANCE_S)
    landings = np.round(takeoffs + flight, 3)
    takeoffs = np.round(takeoffs, 3)
    first, last = takeoffs[0], landings[-1]
    depth = rng.uniform(0.075, 0.095) * person.stature_m
    speed, caught = 0.5 * G * flight, last + catch
    series = Jumps(start, start + dip, takeoffs, landings, caught, caught + settle, depth, speed)
    impact = rng.uniform(1.0, 1.8) * G
    _move_feet(sketch, series, HOP)
    for start, end in zip(takeoffs, landings, strict=True):
        rise = 1.1 * (0.5 * (end - start))
        up, down = glide(t, start, start + rise, 0.05), glide(t, end - rise, end, 0.05)
        for foot in sketch.feet.values():
            foot.raised_m[:, 1] += 0.8 * 0.5 * speed**2 / G * (up - down)
    # elbows bent, swinging a little with the hops
    ready = step(t, series.start_s, series.bottom_s) - step(t, last + 0.2, last + 0.8)
    pace = 1.0 / (landings[0] - first + STANCE_S)
    wave = ready * np.sin(2.0 * np.pi * pace * (t - first))
    swing, lean = np.deg2rad(rng.uniform(8.0, 14.0)), np.deg2rad(8.0) * ready
    for side in SIDES:
        sketch.angles[f"elbow_{side}"] += np.deg2rad(50.0) * ready
        sketch.angles[f"shoulder_{side}"][:, 0] += swing * wave
    sketch.pelvis_angles[:, 0] -= lean
    sketch.angles["waist"][:, 0] -= 0.5 * lean
    sketch.angles["neck"][:, 0] += lean
    moved_a_little(sketch, rng, 0.3, 0.6)
    height = _rise(sketch, series)
    for landing in landings:
        length = STANCE_S if landing < last else catch
        struck = (t >= landing) & (t <= landing + length)
        height[struck] += impact * _strike(int(struck.sum()), length)
    return _plan(sketch, rng, series, height)


def _plan(
    sketch: Sketch, rng: np.random.Generator, jumps: Jumps, rise_m: np.ndarray, **options: object
) -> Plan:
    """The centre of mass at a rise (T,) above its height in the first sample."""
    person, first = sketch.person, sketch.plan().thinned(len(sketch.t_s))
    turns = turns_of(person, first)
    poses = poses_of(person, first, turns, first.pelvis_m, turns["lower_torso"])
    moment, mass = 0.0, sum(part.mass_kg for part in person.inertias.values())
    for body, part in person.inertias.items():
        moment += part.mass_kg * poses.point(body, part.com_m)[0, 1]
    flights = zip(jumps.takeoffs_s, jumps.landings_s, strict=True)
    return sketch.plan(
        com_height_m=float(moment / mass) + rise_m,
        flights=tuple((sketch.sample_of(a), sketch.sample_of(b)) for a, b in flights),
        plate_centre_m=plate_under(sketch, rng),
        **options,
    )


def _rise(sketch: Sketch, jumps: Jumps) -> np.ndarray:
    """(T,) rise of the centre of mass: septic pieces on the ground, a fall in flight."""
    t, v = sketch.t_s, jumps.speed_m_s
    first, last = jumps.takeoffs_s[0], jumps.landings_s[-1]
    rest, bottom = np.zeros(4), np.array([-jumps.depth_m, 0.0, 1.0 * G, 0.0])
    leave, arrive = np.array([TAKEOFF_M, v, -G, 0.0]), np.array([TAKEOFF_M, -v, -G, 0.0])
    height = np.zeros_like(t)
    for start, end, a, b in (
        (jumps.start_s, jumps.bottom_s, rest, bottom),
        (jumps.bottom_s, first, bottom, leave),
        (last, jumps.caught_s, arrive, bottom),
        (jumps.caught_s, jumps.end_s, bottom, rest),
    ):
        inside = (t >= start) & (t <= end)
        height[inside] = bridge(a, b, end - start, t[inside] - start)
    for start, end in zip(jumps.takeoffs_s, jumps.landings_s, strict=True):
        air = (t > start) & (t < end)
        since = t[air] - start
        height[air] = TAKEOFF_M + v * since - 0.5 * G * since**2
    for start, end in zip(jumps.landings_s[:-1], jumps.takeoffs_s[1:], strict=True):
        ground = (t >= start) & (t <= end)
        height[ground] = TAKEOFF_M + _bounce(t[ground] - start, end - start, v)
    return height


def _bounce(since_s: np.ndarray, stance_s: float, speed_m_s: float) -> np.ndarray:
    """(T,) height over a stance that turns -speed into speed with a force of one hump."""
    s = since_s / stance_s
    twice = 2.5 * s**4 - 3.0 * s**5 + s**6  # double integral of 30 s^2 (1 - s)^2
    mean = 2.0 * speed_m_s / stance_s + G
    return mean * stance_s**2 * twice - speed_m_s * since_s - 0.5 * G * since_s**2


def _strike(samples: int, length_s: float) -> np.ndarray:
    """(samples,) height for a short hump of acceleration of peak 1 after touch-down.

    The rest of the stance pushes less, so that neither speed nor height differ at its end.
    """
    t = np.arange(samples) * STEP_S
    u = np.clip((t - IMPACT_S[0]) / (IMPACT_S[1] - IMPACT_S[0]), 0.0, 1.0)
    s = t / length_s
    even = (s * (1.0 - s)) ** 3
    speeds = [integral(a, STEP_S) for a in ((4.0 * u * (1.0 - u)) ** 4, even, even * (s - 0.5))]
    heights = [integral(speed, STEP_S) for speed in speeds]
    ends = np.array([[speeds[k][-1], heights[k][-1]] for k in range(3)])
    less = np.linalg.solve(ends[1:].T, ends[0])
    return heights[0] - less[0] * heights[1] - less[1] * heights[2]


def _move_feet(sketch: Sketch, jumps: Jumps, how: Feet) -> None:
    """Heels rise before each take-off, the toes land first."""
    t, first, last = sketch.t_s, jumps.takeoffs_s[0], jumps.landings_s[-1]
    early, late, back = how.toes_s
    toes = step(t, first - early, first - late) - step(t, last, last + back)
    for side, foot in sketch.feet.items():
        foot.cop_ahead_m += 0.42 * sketch.person.lengths_m[f"foot_{side}"] * toes
        for start, end in zip(jumps.takeoffs_s, jumps.landings_s, strict=True):
            push = step(t, start - how.push_s[0], start + how.push_s[1])
            catch = step(t, end - how.catch_s[0], end + how.catch_s[1])
            foot.toe_roll_rad += how.roll_rad * (push - catch)
            foot.share[(t > start) & (t < end)] = 0.0
