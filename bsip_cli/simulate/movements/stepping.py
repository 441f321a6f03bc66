"""Step off the plate and back, and step onto the plate and off again ahead."""

from __future__ import annotations

import numpy as np

from bsip_cli.simulate.numerics import glide, step, window
from bsip_cli.simulate.people import SIDES, Person
from bsip_cli.simulate.plan import Plan
from bsip_cli.simulate.sketch import (
    FootSketch,
    Sketch,
    add_breath_of_motion,
    add_sway,
    plate_under,
    sketch_for,
)

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
