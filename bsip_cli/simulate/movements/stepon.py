"""Step onto the plate, stand, and step off again ahead; the plate is unloaded at both ends."""

from __future__ import annotations

import numpy as np

from bsip_cli.simulate.curves import glide, step, window
from bsip_cli.simulate.movements.standing import add_breath_of_motion, add_sway
from bsip_cli.simulate.people import SIDES, Person
from bsip_cli.simulate.plan import Plan
from bsip_cli.simulate.sketch import Sketch, sketch_for

HALF_PLATE_M = 0.3  # in the walking direction
CLEARANCE_M = 0.04
# Parts of the trial at which, stepping on and off again: the first foot begins to unload,
# leaves, lands, carries all; the second leaves (at that moment), lands, both carry alike.
ON = np.array([0.12, 0.20, 0.29, 0.37, 0.46, 0.53])
OFF = np.array([0.61, 0.68, 0.77, 0.85, 0.93, 0.98])


def stepon(person: Person, rng: np.random.Generator, duration_s: float, _ball: float) -> Plan:
    """Two steps ahead: from the floor onto the plate, and from it onto the floor."""
    sketch = sketch_for(person, duration_s)
    first = str(rng.choice(SIDES))
    length = person.lengths_m[f"foot_{first}"]
    reach = HALF_PLATE_M + CLEARANCE_M + 0.73 * length - sketch.mid_foot_m()
    reach += rng.uniform(0.0, 0.03)
    for foot in sketch.feet.values():
        foot.ahead_m -= reach
        foot.on_plate[:] = False
    for moments in (ON * duration_s, OFF * duration_s):
        _step(sketch, first, moments, reach)
    on, off = ON * duration_s, OFF * duration_s
    _mark_plate(sketch, first, (on[1], on[2]), (off[1], off[2]))
    second = "l" if first == "r" else "r"
    _mark_plate(sketch, second, (on[3], on[4]), (off[3], off[4]))
    sketch.pelvis_m[:, 0] += 0.5 * (sketch.feet["l"].ahead_m + sketch.feet["r"].ahead_m)
    add_breath_of_motion(sketch, rng, np.deg2rad(0.4))
    add_sway(sketch, rng, 0.3)
    return sketch.plan(
        plate_centre_m=(sketch.mid_foot_m(), rng.normal(0.0, 0.03)),
        sway_share=0.2,
        notes={"first_side": first},
    )


def _step(sketch: Sketch, first: str, moments: np.ndarray, reach_m: float) -> None:
    """Bring first one foot, then the other, ahead by reach_m."""
    t = sketch.t_s
    second = "l" if first == "r" else "r"
    unload, leave, land, loaded, close, even = moments
    for side, start, end, roll in ((first, leave, land, 0.0), (second, loaded, close, 30.0)):
        foot = sketch.feet[side]
        ramp = 0.4 * (end - start)
        foot.ahead_m += reach_m * glide(t, start, end, ramp)
        foot.raised_m[:, 1] += 0.07 * window(t, start, end, 0.5 * (end - start))
        heel_up = step(t, land, start) - step(t, start + ramp, end) if roll else 0.0
        foot.toe_roll_rad += np.deg2rad(roll) * heel_up
        foot.cop_ahead_m += 0.25 * reach_m * heel_up
    # the second foot's part: half, all, none, half
    change = 0.5 * step(t, unload, leave) - step(t, land, loaded) + 0.5 * step(t, close, even)
    sketch.feet[second].share += change
    sketch.feet[first].share -= change
    for name in SIDES:
        swing = -1.0 if name == first else 1.0
        moving = step(t, leave, land) - step(t, loaded, close)
        sketch.angles[f"shoulder_{name}"][:, 0] += swing * np.deg2rad(14.0) * moving


def _mark_plate(
    sketch: Sketch, side: str, on_s: tuple[float, float], off_s: tuple[float, float]
) -> None:
    """A foot is on the plate from the middle of one swing to the middle of another."""
    t = sketch.t_s
    sketch.feet[side].on_plate[:] = (t > np.mean(on_s)) & (t < np.mean(off_s))
