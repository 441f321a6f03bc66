"""On the plate: quiet stance, squats, an overarm throw, and postures that are held."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from bsip_cli.simulate.numerics import glide, soft_polyline, step, window
from bsip_cli.simulate.people import SIDES, Person
from bsip_cli.simulate.plan import (
    FootSketch,
    Plan,
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


# --- steps off the plate and back, and onto it and off again --------------------------------------


# Parts of the trial `steps`: stance on one leg begins, foot leaves, lands ahead, loaded, unloads,
# leaves the floor, lands on the plate, both feet loaded again.
MOMENTS = np.array([0.05, 0.24, 0.40, 0.52, 0.58, 0.70, 0.86, 0.97])
EDGE_CLOSER_M = 0.08  # the plate lies further back than in other trials
# Parts of the trial `stepon`, stepping on and off again: the first foot begins to unload,
# leaves, lands, carries all; the second leaves (at that moment), lands, both carry alike.
ON = np.array([0.12, 0.20, 0.29, 0.37, 0.46, 0.53])
OFF = np.array([0.61, 0.68, 0.77, 0.85, 0.93, 0.98])
HALF_PLATE_M = 0.3  # in the walking direction
CLEARANCE_M = 0.04


def steps(person: Person, rng: np.random.Generator, duration_s: float, _ball: float) -> Plan:
    """One step ahead off the plate and back, with single support on the plate between."""
    sketch = sketch_for(person, duration_s)
    t, moments = sketch.t_s, MOMENTS * duration_s
    side = str(rng.choice(SIDES))
    other = "l" if side == "r" else "r"
    reach = 0.23 * person.stature_m * rng.uniform(0.95, 1.05)
    floor_share = rng.uniform(0.35, 0.55)
    foot = sketch.feet[side]
    ahead = _swing(foot, t, moments[1], moments[2]) - _swing(foot, t, moments[5], moments[6])
    foot.ahead_m += reach * ahead
    foot.on_plate[:] = (t < moments[1]) | (t > moments[6])
    on_plate = 1.0 - step(t, moments[0], moments[1]) + step(t, moments[6], moments[7])
    on_floor = step(t, moments[2], moments[3]) - step(t, moments[4], moments[5])
    foot.share[:] = 0.5 * on_plate + floor_share * on_floor
    sketch.feet[other].share[:] = 1.0 - foot.share
    _swing_arms(sketch, side, 15.0, ahead)
    add_breath_of_motion(sketch, rng, np.deg2rad(0.4))
    add_sway(sketch, rng, 0.3)
    plate_ahead, plate_aside = plate_under(sketch, rng)
    return sketch.plan(
        plate_centre_m=(plate_ahead - EDGE_CLOSER_M, plate_aside),
        sway_share=0.2,
        notes={"stepping_side": side},
    )


def stepon(person: Person, rng: np.random.Generator, duration_s: float, _ball: float) -> Plan:
    """Two steps ahead: from the floor onto the plate, and from it onto the floor."""
    sketch = sketch_for(person, duration_s)
    first = str(rng.choice(SIDES))
    second = "l" if first == "r" else "r"
    length = person.lengths_m[f"foot_{first}"]
    reach = HALF_PLATE_M + CLEARANCE_M + 0.73 * length - sketch.mid_foot_m()
    reach += rng.uniform(0.0, 0.03)
    for foot in sketch.feet.values():
        foot.ahead_m -= reach
    on, off = ON * duration_s, OFF * duration_s
    for moments in (on, off):
        _step(sketch, first, second, moments, reach)
    for side, leave, land in ((first, 1, 2), (second, 3, 4)):  # from mid-swing to mid-swing
        start, end = np.mean((on[leave], on[land])), np.mean((off[leave], off[land]))
        sketch.feet[side].on_plate[:] = (sketch.t_s > start) & (sketch.t_s < end)
    sketch.pelvis_m[:, 0] += 0.5 * (sketch.feet["l"].ahead_m + sketch.feet["r"].ahead_m)
    add_breath_of_motion(sketch, rng, np.deg2rad(0.4))
    add_sway(sketch, rng, 0.3)
    return sketch.plan(
        plate_centre_m=(sketch.mid_foot_m(), rng.normal(0.0, 0.03)),
        sway_share=0.2,
        notes={"first_side": first},
    )


def _step(sketch: Sketch, first: str, second: str, moments: np.ndarray, reach_m: float) -> None:
    """Bring first one foot, then the other, ahead by reach_m."""
    t = sketch.t_s
    unload, leave, land, loaded, close, even = moments
    for side, start, end in ((first, leave, land), (second, loaded, close)):
        foot = sketch.feet[side]
        foot.ahead_m += reach_m * _swing(foot, t, start, end)
    foot = sketch.feet[second]
    heel_up = step(t, land, loaded) - step(t, loaded + 0.4 * (close - loaded), close)
    foot.toe_roll_rad += np.deg2rad(30.0) * heel_up
    foot.cop_ahead_m += 0.25 * reach_m * heel_up
    # the second foot's part: half, all, none, half
    change = 0.5 * step(t, unload, leave) - step(t, land, loaded) + 0.5 * step(t, close, even)
    sketch.feet[second].share += change
    sketch.feet[first].share -= change
    _swing_arms(sketch, first, 14.0, step(t, leave, land) - step(t, loaded, close))


def _swing(foot: FootSketch, t: np.ndarray, start: float, end: float) -> np.ndarray:
    """Raise a foot from start to end; (T,) how far it has come ahead by then, 0 to 1."""
    foot.raised_m[:, 1] += 0.07 * window(t, start, end, 0.5 * (end - start))
    return glide(t, start, end, 0.4 * (end - start))


def _swing_arms(sketch: Sketch, side: str, degrees: float, ahead: np.ndarray) -> None:
    """Bring the other side's arm ahead with a foot, and the foot's own back."""
    for name in SIDES:
        swing = -1.0 if name == side else 1.0
        sketch.angles[f"shoulder_{name}"][:, 0] += swing * np.deg2rad(degrees) * ahead
