"""Plans of people who leave their place (gait, hops and jumps), and the table of all movements."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from bsip_cli.simulate import standing
from bsip_cli.simulate.numerics import bridge, glide, integral, soft_polyline, step
from bsip_cli.simulate.people import SIDE_SIGN, SIDES, Person
from bsip_cli.simulate.plan import (
    STEP_S,
    G,
    Plan,
    Sketch,
    add_breath_of_motion,
    held_ball,
    moved_a_little,
    other_side,
    plate_under,
    poses_of,
    sketch_for,
    turns_of,
)

LONGEST_REACH = 0.985  # the knee stays bent, about 20 degrees
STEPS = range(-8, 8)  # planned before and after the one on the plate


@dataclass(frozen=True)
class Gait:
    """A steady gait. Step 0 starts at 0 s (its foot touches down) and lies on the plate.

    step_s : from one touch-down to the next. stance_s : contact of one foot.
    rise_s, fall_s : in which a swinging foot gains and loses its speed.
    toe_roll_rad, heel_roll_rad : largest heel rise, and toe rise at touch-down.
    toe_roll_share : part of the stance after which the heel rises.
    cop_from, cop_to : centre of pressure ahead of the ankle, in lengths of the foot.
    """

    speed_m_s: float
    step_s: float
    stance_s: float
    first_side: str
    half_width_m: float
    rise_s: float
    fall_s: float
    clearance_m: float
    toe_roll_rad: float
    heel_roll_rad: float
    toe_roll_share: float
    cop_from: float
    cop_to: float
    arm_swing_rad: float
    elbow_rad: float

    def side_of(self, k: int) -> str:
        """The foot of step k."""
        return self.first_side if k % 2 == 0 else other_side(self.first_side)


# What all gaits of a kind share: the fields of `Gait` from half_width_m on.
_rad = np.deg2rad
WALKING = (0.05, 0.24, 0.10, 0.04, _rad(58), _rad(24), 0.50, -0.20, 0.68, _rad(22), _rad(10))
RUNNING = (0.035, 0.13, 0.05, 0.14, _rad(75), _rad(20), 0.45, 0.10, 0.68, _rad(28), _rad(75))


def walking(person: Person, rng: np.random.Generator, duration_s: float, _ball: float) -> Plan:
    """A part of walking around one stance on the plate."""
    size = person.stature_m / 1.7
    step_s = rng.uniform(0.50, 0.53)
    speed, first_side = rng.uniform(1.18, 1.28) * size, str(rng.choice(SIDES))
    gait = Gait(speed, step_s, 1.14 * step_s, first_side, *WALKING)
    sketch = _sketch(person, gait, duration_s)
    t, double = sketch.t_s, gait.stance_s - step_s
    sketch.pelvis_m[:, 1] -= 0.016 * size * np.cos(2.0 * np.pi * (t - 0.5 * double) / step_s)
    for k in STEPS:  # load comes from the other foot after touch-down and goes to it at the end
        on = step(t, k * step_s, k * step_s + double)
        off = step(t, (k + 1) * step_s, (k + 1) * step_s + double)
        sketch.feet[gait.side_of(k)].share += on - off
    return _finished(sketch, gait, rng)


def running(person: Person, rng: np.random.Generator, duration_s: float, _ball: float) -> Plan:
    """A part of running around one stance on the plate, with flight before and after."""
    size = person.stature_m / 1.7
    step_s = round(rng.uniform(0.335, 0.35), 3)
    stance_s = round(0.70 * step_s, 3)
    speed, first_side = rng.uniform(2.7, 2.9) * size, str(rng.choice(SIDES))
    gait = Gait(speed, step_s, stance_s, first_side, *RUNNING)
    sketch = _sketch(person, gait, duration_s)
    t, flights = sketch.t_s, []
    for k in STEPS:
        touch, lift = k * step_s, k * step_s + stance_s
        stance = (t > touch - 0.5 * STEP_S) & (t < lift + 0.5 * STEP_S)
        sketch.feet[gait.side_of(k)].share[stance] = 1.0
        first, last = sketch.sample_of(lift), sketch.sample_of((k + 1) * step_s)
        if first > 0 and last < len(t) - 1:
            flights.append((first, last))
    sketch.angles["waist"][:, 0] -= np.deg2rad(8.0)
    # height of the centre of mass for ground forces 30 s^2 (1-s)^2 over each stance
    time = np.mod(t + 1e-9, step_s) - 1e-9
    s, after = np.clip(time / stance_s, 0.0, 1.0), time - np.minimum(time, stance_s)
    height = G * step_s * stance_s * _hump_twice(s) + G * step_s * after
    height += -0.5 * G * (step_s - stance_s) * time - 0.5 * G * time**2
    height = 0.56 * person.stature_m + height
    return _finished(sketch, gait, rng, flights=tuple(flights), com_height_m=height)


def _hump_twice(s: np.ndarray) -> np.ndarray:
    """Double integral of a force 30 s^2 (1-s)^2."""
    return 2.5 * s**4 - 3.0 * s**5 + s**6


def _sketch(person: Person, gait: Gait, duration_s: float) -> Sketch:
    """From mid-stance to mid-stance, recorded around the middle of the stance on the plate."""
    middle = 0.5 * gait.stance_s
    count = round(8 * gait.step_s / STEP_S)  # four steps before the middle and four after it
    t = (np.round((middle - gait.step_s * 4.0) / STEP_S) + np.arange(count + 1)) * STEP_S
    start = float(np.round((middle - 0.5 * duration_s) / STEP_S) * STEP_S)
    sketch = Sketch(person, t, (start, start + duration_s))
    for side in SIDES:
        _move_foot(sketch, gait, side)
    # pelvis and arms swing with the stride
    phase = np.pi * t / gait.step_s  # 0 when the first side touches down
    sign = SIDE_SIGN[gait.first_side]
    turn, drop = sign * np.deg2rad(5.0) * np.cos(phase), sign * np.deg2rad(3.0) * np.sin(phase)
    sketch.pelvis_m[:, 0] = gait.speed_m_s * t
    sketch.pelvis_angles += np.stack([np.full_like(t, -np.deg2rad(4.0)), drop, turn], axis=1)
    sketch.angles["waist"] -= np.stack([np.zeros_like(t), drop, 2.0 * turn], axis=1)
    for side in SIDES:
        swing = -SIDE_SIGN[side] * sign * np.cos(phase)
        sketch.bend(f"shoulder_{side} 0", gait.arm_swing_rad * swing)
        sketch.bend(f"elbow_{side}", gait.elbow_rad + 0.4 * gait.arm_swing_rad * swing)
    return sketch


def _move_foot(sketch: Sketch, gait: Gait, side: str) -> None:
    t, foot, stance = sketch.t_s, sketch.feet[side], gait.stance_s
    length = sketch.person.lengths_m[f"foot_{side}"]
    own = [k for k in STEPS if gait.side_of(k) == side]
    foot.aside_m[:] = SIDE_SIGN[side] * gait.half_width_m
    foot.ahead_m[:] = gait.speed_m_s * own[0] * gait.step_s
    foot.share[:] = 0.0
    foot.on_plate[:] = False
    foot.cop_ahead_m[:] = gait.cop_from * length
    for k in own:
        touch, land = k * gait.step_s, (k + 2) * gait.step_s
        lift = touch + stance
        swing = land - lift
        stride = 2.0 * gait.step_s * gait.speed_m_s
        foot.ahead_m += stride * glide(t, lift, land, gait.rise_s, gait.fall_s)
        up = step(t, lift, lift + 0.5 * swing) - step(t, lift + 0.5 * swing, land)
        foot.raised_m[:, 1] += gait.clearance_m * up
        rise = touch + gait.toe_roll_share * stance
        roll = step(t, rise, lift + 0.12 * swing) - step(t, lift + 0.1 * swing, lift + 0.8 * swing)
        foot.toe_roll_rad += gait.toe_roll_rad * roll
        toes_up = step(t, land - 0.5 * swing, land - 0.02 * swing)
        toes_up -= step(t, land - 0.02 * swing, land + 0.2 * stance)
        foot.heel_roll_rad += gait.heel_roll_rad * toes_up
        forward = step(t, touch, touch + 0.8 * stance) - step(t, lift, land)
        foot.cop_ahead_m += (gait.cop_to - gait.cop_from) * length * forward
        if k == 0:
            foot.on_plate[(t > touch - 0.5 * swing) & (t < lift + 0.5 * swing)] = True


def _finished(sketch: Sketch, gait: Gait, rng: np.random.Generator, **options: Any) -> Plan:
    add_breath_of_motion(sketch, rng, np.deg2rad(0.5))
    middle = 0.25 * sketch.person.lengths_m[f"foot_{gait.first_side}"]
    aside = SIDE_SIGN[gait.first_side] * gait.half_width_m
    centre = (middle + rng.normal(0.0, 0.02), aside + rng.normal(0.0, 0.05))
    return sketch.plan(
        speed_m_s=gait.speed_m_s, longest_reach=LONGEST_REACH, plate_centre_m=centre, **options
    )


# --- flights from both feet: a jump throw, and hops on the spot whose landings strike -------------


TAKEOFF_M = 0.01  # height of the centre of mass at take-off and landing, against standing
STANCE_S = 0.30  # between hops
IMPACT_S = (0.008, 0.070)  # start and end of the strike after touch-down
MOST_HOPS = 12
# Of a jump throw, in degrees at: start, bottom, take-off, release, landing, end.
FLEXION, ELBOW = (0.0, 25.0, 85.0, 125.0, 90.0, 0.0), (30.0, 70.0, 85.0, 10.0, 20.0, 0.0)
LEAN = (0.0, -28.0, -4.0, -3.0, -6.0, 0.0)


@dataclass(frozen=True, eq=False)
class Jumps:
    """Equal jumps: dip to the bottom, push off, fly, are caught, and settle.

    times_s : of start, bottom, each take-off and landing, caught, end. depth_m : of the first dip
    and last catch, against standing. speed_m_s : at each take-off.
    """

    times_s: list[float]
    depth_m: float
    speed_m_s: float

    @property
    def flights_s(self) -> list[tuple[float, float]]:
        """Take-off and landing of each."""
        return list(zip(self.times_s[2:-2:2], self.times_s[3:-2:2], strict=True))


def basketball(
    person: Person, rng: np.random.Generator, duration_s: float, ball_mass_kg: float
) -> Plan:
    """Squat, jump, let the ball go near the highest point, land, settle."""
    sketch = sketch_for(person, duration_s)
    t, speed = sketch.t_s, rng.uniform(1.55, 1.85)
    depth = rng.uniform(0.115, 0.135) * person.stature_m
    lengths = [0.52, 0.24, 2.0 * speed / G, 0.24, 0.62]  # dip, push, flight, catch, settle
    before = max(0.12, 0.5 * (duration_s - sum(lengths)))
    times = np.round(before + np.cumsum([0.0, *lengths]), 3).tolist()
    start, bottom, takeoff, landing, _, end = times
    jump = Jumps(times, depth, 0.5 * G * (landing - takeoff))
    side = str(rng.choice(SIDES, p=(0.1, 0.9)))
    release = 0.55 * takeoff + 0.45 * landing
    _move_feet(sketch, jump, 62.0, (0.20, 0.08), (0.08, 0.16), (0.25, 0.1, 0.15))
    apex = 0.5 * (takeoff + landing)
    overlap = 0.2 * (apex - takeoff)
    _lift_feet(sketch, jump, 0.85, 0.06, [(apex + overlap, apex - overlap)])
    frames, size = np.array([start, bottom, takeoff, release, landing, end]), rng.uniform(0.9, 1.1)
    lean = np.deg2rad(LEAN)
    for name, angles, softness_s in (
        ("shoulder_l 0", size * np.deg2rad(FLEXION), 0.05),
        ("shoulder_r 0", size * np.deg2rad(FLEXION), 0.05),
        ("elbow_l", size * np.deg2rad(ELBOW), 0.04),
        ("elbow_r", size * np.deg2rad(ELBOW), 0.04),
        ("waist 0", lean, 0.06),
        ("pelvis 0", 0.7 * lean, 0.06),
        ("neck 0", -1.3 * lean, 0.06),
    ):
        sketch.bend(name, soft_polyline(t, frames, angles, softness_s))
    moved_a_little(sketch, rng, 0.3, 0.6)
    ball = held_ball(sketch, rng, side, release, ball_mass_kg)
    return _plan(sketch, rng, jump, _rise(sketch, jump), ball=ball, notes={"throwing_side": side})


def hops(person: Person, rng: np.random.Generator, duration_s: float, _ball: float) -> Plan:
    """Stand, hop several times, stand again."""
    sketch = sketch_for(person, duration_s)
    t = sketch.t_s
    dip, push, catch, settle = 0.50, 0.24, 0.26, 0.70
    flight = round(2.0 * rng.uniform(1.15, 1.45) / G, 3)
    room = duration_s - (0.5 + dip + push + catch + settle) + STANCE_S
    count = int(np.clip(np.floor(room / (flight + STANCE_S)), 1, MOST_HOPS))
    used = dip + push + count * flight + (count - 1) * STANCE_S + catch + settle
    start = round(max(0.1, 0.5 * (duration_s - used)), 3)
    takeoffs = start + dip + push + np.arange(count) * (flight + STANCE_S)
    flights = np.round(np.stack([takeoffs, takeoffs + flight], axis=1), 3)
    first, last = flights[0, 0], flights[-1, 1]
    caught, depth = last + catch, rng.uniform(0.075, 0.095) * person.stature_m
    times = [start, start + dip, *np.ravel(flights), caught, caught + settle]
    series = Jumps(times, depth, 0.5 * G * flight)
    impact = rng.uniform(1.0, 1.8) * G
    _move_feet(sketch, series, 42.0, (0.17, 0.06), (0.06, 0.12), (0.25, 0.05, 0.2))
    rises = ((a, b, 1.1 * (0.5 * (b - a))) for a, b in series.flights_s)
    _lift_feet(sketch, series, 0.8, 0.05, [(a + rise, b - rise) for a, b, rise in rises])
    # elbows bent, swinging a little with the hops
    ready = step(t, start, start + dip) - step(t, last + 0.2, last + 0.8)
    pace = 1.0 / (flights[0, 1] - first + STANCE_S)
    wave = ready * np.sin(2.0 * np.pi * pace * (t - first))
    swing, lean = np.deg2rad(rng.uniform(8.0, 14.0)), np.deg2rad(8.0) * ready
    sketch.bend_both("elbow_*", np.deg2rad(50.0) * ready)
    sketch.bend_both("shoulder_* 0", swing * wave)
    for name, part in {"pelvis 0": -1.0, "waist 0": -0.5, "neck 0": 1.0}.items():
        sketch.bend(name, part * lean)
    moved_a_little(sketch, rng, 0.3, 0.6)
    height = _rise(sketch, series)
    for landing in flights[:, 1]:
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
    return sketch.plan(
        com_height_m=float(moment / mass) + rise_m,
        flights=tuple((sketch.sample_of(a), sketch.sample_of(b)) for a, b in jumps.flights_s),
        plate_centre_m=plate_under(sketch, rng),
        **options,
    )


def _rise(sketch: Sketch, jumps: Jumps) -> np.ndarray:
    """(T,) rise of the centre of mass: septic pieces on the ground, a fall in flight."""
    t, v = sketch.t_s, jumps.speed_m_s
    rest, bottom = np.zeros(4), np.array([-jumps.depth_m, 0.0, 1.0 * G, 0.0])
    leave, arrive = np.array([TAKEOFF_M, v, -G, 0.0]), np.array([TAKEOFF_M, -v, -G, 0.0])
    height, times = np.zeros_like(t), jumps.times_s
    on_ground = {0: (rest, bottom), 1: (bottom, leave), -3: (arrive, bottom), -2: (bottom, rest)}
    for k, (before, after) in on_ground.items():
        start, end = times[k], times[k + 1]
        inside = (t >= start) & (t <= end)
        height[inside] = bridge(before, after, end - start, t[inside] - start)
    for start, end in jumps.flights_s:
        air = (t > start) & (t < end)
        since = t[air] - start
        height[air] = TAKEOFF_M + v * since - 0.5 * G * since**2
    for start, end in zip(times[3:-3:2], times[4:-3:2], strict=True):
        ground, stance = (t >= start) & (t <= end), end - start
        since = t[ground] - start  # a force of one hump turns -v into v
        lifted = (2.0 * v / stance + G) * stance**2 * _hump_twice(since / stance)
        height[ground] = TAKEOFF_M + (lifted - v * since - 0.5 * G * since**2)
    return height


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


def _move_feet(
    sketch: Sketch,
    jumps: Jumps,
    roll_deg: float,
    push_s: tuple[float, float],
    catch_s: tuple[float, float],
    toes_s: tuple[float, float, float],
) -> None:
    """Heels rise before each take-off, the toes land first.

    roll_deg : of the heels, over push_s and catch_s about take-off and landing.
    toes_s : in which the load goes to the toes and comes back.
    """
    t, first, last = sketch.t_s, jumps.times_s[2], jumps.times_s[-3]
    early, late, back = toes_s
    toes = step(t, first - early, first - late) - step(t, last, last + back)
    for side, foot in sketch.feet.items():
        foot.cop_ahead_m += 0.42 * sketch.person.lengths_m[f"foot_{side}"] * toes
        for start, end in jumps.flights_s:
            push = step(t, start - push_s[0], start + push_s[1])
            catch = step(t, end - catch_s[0], end + catch_s[1])
            foot.toe_roll_rad += np.deg2rad(roll_deg) * (push - catch)
            foot.share[(t > start) & (t < end)] = 0.0


def _lift_feet(
    sketch: Sketch, jumps: Jumps, share: float, ramp_s: float, turns_s: list[tuple[float, float]]
) -> None:
    """In each flight by a share of its height.

    turns_s : until when the feet rise and from when they sink, in each flight.
    """
    t, top = sketch.t_s, share * 0.5 * jumps.speed_m_s**2 / G
    for (start, end), (risen, sinking) in zip(jumps.flights_s, turns_s, strict=True):
        up, down = glide(t, start, risen, ramp_s), glide(t, sinking, end, ramp_s)
        for foot in sketch.feet.values():
            foot.raised_m[:, 1] += top * (up - down)


Movement = Callable[[Person, np.random.Generator, float, float], Plan]
"""(person, rng, duration_s, ball_mass_kg) -> plan."""
MOVEMENTS: dict[str, tuple[Movement, float]] = {
    "static": (standing.static, 2.0),
    "sequence": (standing.sequence, 120.0),
    "throwing": (standing.throwing, 3.0),
    "basketball": (basketball, 3.0),
    "squat": (standing.squat, 6.0),
    "steps": (standing.steps, 5.0),
    "walking": (walking, 1.2),
    "running": (running, 0.8),
    "hops": (hops, 5.0),
    "stepon": (standing.stepon, 9.0),
    "postures": (standing.postures, 35.0),
}
"""By task, the movement and its usual duration [s]."""
