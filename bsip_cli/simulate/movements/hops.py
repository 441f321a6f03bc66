"""Hops on the spot with both feet: flights, and landings that strike."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bsip_cli.simulate.calculus import bridge, integral
from bsip_cli.simulate.curves import glide, step
from bsip_cli.simulate.loads import GRAVITY
from bsip_cli.simulate.movements.basketball import sample_of, standing_com_height
from bsip_cli.simulate.movements.standing import add_breath_of_motion, add_sway, plate_under
from bsip_cli.simulate.people import SIDES, Person
from bsip_cli.simulate.plan import STEP_S, Plan
from bsip_cli.simulate.sketch import Sketch, sketch_for

G = -GRAVITY[1]
DIP_S, PUSH_S, CATCH_S, SETTLE_S = 0.50, 0.24, 0.26, 0.70
STANCE_S = 0.30
TAKEOFF_M = 0.01  # height of the centre of mass at take-off and landing, against standing
IMPACT_S = (0.008, 0.070)  # start and end of the strike after touch-down
MOST_HOPS = 12


@dataclass(frozen=True, eq=False)
class Hops:
    """Times [s] and speed of a series of equal hops.

    takeoffs_s, landings_s : (n,) of each flight. depth_m : of the first dip and last catch.
    impact_m_s2 : peak of the strike's extra acceleration.
    """

    start_s: float
    bottom_s: float
    takeoffs_s: np.ndarray
    landings_s: np.ndarray
    speed_m_s: float
    depth_m: float
    impact_m_s2: float


def hops(person: Person, rng: np.random.Generator, duration_s: float, _ball: float) -> Plan:
    """Stand, hop several times, stand again."""
    sketch = sketch_for(person, duration_s)
    series = _draw_hops(sketch, rng, duration_s)
    _legs(sketch, series)
    _arms(sketch, rng, series)
    add_breath_of_motion(sketch, rng, np.deg2rad(0.3))
    add_sway(sketch, rng, 0.6)
    flights = tuple(
        (sample_of(sketch, a), sample_of(sketch, b))
        for a, b in zip(series.takeoffs_s, series.landings_s, strict=True)
    )
    return sketch.plan(
        com_height_m=standing_com_height(sketch) + _rise(sketch, series),
        flights=flights,
        plate_centre_m=plate_under(sketch, rng),
    )


def _draw_hops(sketch: Sketch, rng: np.random.Generator, duration_s: float) -> Hops:
    flight = round(2.0 * rng.uniform(1.15, 1.45) / G, 3)
    around = 0.5 + DIP_S + PUSH_S + CATCH_S + SETTLE_S
    room = duration_s - around + STANCE_S
    count = int(np.clip(np.floor(room / (flight + STANCE_S)), 1, MOST_HOPS))
    used = DIP_S + PUSH_S + count * flight + (count - 1) * STANCE_S + CATCH_S + SETTLE_S
    start = round(max(0.1, 0.5 * (duration_s - used)), 3)
    takeoffs = start + DIP_S + PUSH_S + np.arange(count) * (flight + STANCE_S)
    return Hops(
        start_s=start,
        bottom_s=start + DIP_S,
        takeoffs_s=np.round(takeoffs, 3),
        landings_s=np.round(takeoffs + flight, 3),
        speed_m_s=0.5 * G * flight,
        depth_m=rng.uniform(0.075, 0.095) * sketch.person.stature_m,
        impact_m_s2=rng.uniform(1.0, 1.8) * G,
    )


def _rise(sketch: Sketch, series: Hops) -> np.ndarray:
    """(T,) rise of the centre of mass against standing."""
    t, v = sketch.t_s, series.speed_m_s
    rest = np.zeros(4)
    bottom = np.array([-series.depth_m, 0.0, 1.0 * G, 0.0])
    leave = np.array([TAKEOFF_M, v, -G, 0.0])
    arrive = np.array([TAKEOFF_M, -v, -G, 0.0])
    first, last = series.takeoffs_s[0], series.landings_s[-1]
    height = np.zeros_like(t)
    for start, end, a, b in (
        (series.start_s, series.bottom_s, rest, bottom),
        (series.bottom_s, first, bottom, leave),
        (last, last + CATCH_S, arrive, bottom),
        (last + CATCH_S, last + CATCH_S + SETTLE_S, bottom, rest),
    ):
        inside = (t >= start) & (t <= end)
        height[inside] = bridge(a[:, None], b[:, None], end - start, t[inside] - start)[:, 0]
    for start, end in zip(series.takeoffs_s, series.landings_s, strict=True):
        air = (t > start) & (t < end)
        since = t[air] - start
        height[air] = TAKEOFF_M + v * since - 0.5 * G * since**2
    for start, end in zip(series.landings_s[:-1], series.takeoffs_s[1:], strict=True):
        ground = (t >= start) & (t <= end)
        height[ground] = TAKEOFF_M + _bounce(t[ground] - start, end - start, v)
    for landing in series.landings_s:
        length = STANCE_S if landing < last else CATCH_S
        struck = (t >= landing) & (t <= landing + length)
        height[struck] += series.impact_m_s2 * _strike(int(struck.sum()), length)
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
    shapes = [(4.0 * u * (1.0 - u)) ** 4, even, even * (s - 0.5)]
    speeds = [integral(shape, STEP_S) for shape in shapes]
    heights = [integral(speed, STEP_S) for speed in speeds]
    ends = np.array([[speeds[k][-1], heights[k][-1]] for k in range(3)])
    less = np.linalg.solve(ends[1:].T, ends[0])
    return heights[0] - less[0] * heights[1] - less[1] * heights[2]


def _legs(sketch: Sketch, series: Hops) -> None:
    """Heels rise before each take-off; the toes land first."""
    t, v = sketch.t_s, series.speed_m_s
    lift = 0.8 * 0.5 * v**2 / G
    first, last = series.takeoffs_s[0], series.landings_s[-1]
    toes = step(t, first - 0.25, first - 0.05) - step(t, last, last + 0.2)
    for side in SIDES:
        foot = sketch.feet[side]
        foot.cop_ahead_m += 0.42 * sketch.person.lengths_m[f"foot_{side}"] * toes
        for start, end in zip(series.takeoffs_s, series.landings_s, strict=True):
            half = 0.5 * (end - start)
            up = glide(t, start, start + 1.1 * half, 0.05)
            down = glide(t, end - 1.1 * half, end, 0.05)
            foot.raised_m[:, 1] += lift * (up - down)
            push = step(t, start - 0.17, start + 0.06)
            catch = step(t, end - 0.06, end + 0.12)
            foot.toe_roll_rad += np.deg2rad(42.0) * (push - catch)
            foot.share[(t > start) & (t < end)] = 0.0


def _arms(sketch: Sketch, rng: np.random.Generator, series: Hops) -> None:
    """Elbows bent, swinging a little with the hops."""
    t = sketch.t_s
    first, last = series.takeoffs_s[0], series.landings_s[-1]
    ready = step(t, series.start_s, series.bottom_s) - step(t, last + 0.2, last + 0.8)
    pace = 1.0 / (series.landings_s[0] - first + STANCE_S)
    wave = ready * np.sin(2.0 * np.pi * pace * (t - first))
    swing = np.deg2rad(rng.uniform(8.0, 14.0))
    lean = np.deg2rad(8.0) * ready
    for side in SIDES:
        sketch.angles[f"elbow_{side}"] += np.deg2rad(50.0) * ready
        sketch.angles[f"shoulder_{side}"][:, 0] += swing * wave
    sketch.pelvis_angles[:, 0] -= lean
    sketch.angles["waist"][:, 0] -= 0.5 * lean
    sketch.angles["neck"][:, 0] += lean
