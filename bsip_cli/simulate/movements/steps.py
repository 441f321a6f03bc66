"""Step off the plate with one foot and come back; on the floor that foot is not measured."""

from __future__ import annotations

import numpy as np

from bsip_cli.simulate.curves import glide, step, window
from bsip_cli.simulate.movements.standing import add_breath_of_motion, add_sway, plate_under
from bsip_cli.simulate.people import SIDES, Person
from bsip_cli.simulate.plan import Plan
from bsip_cli.simulate.sketch import Sketch, sketch_for

# Parts of the trial: stance on one leg begins, foot leaves, lands ahead, loaded, unloads,
# leaves the floor, lands on the plate, both feet loaded again.
MOMENTS = np.array([0.05, 0.24, 0.40, 0.52, 0.58, 0.70, 0.86, 0.97])
EDGE_CLOSER_M = 0.08  # the plate lies further back than in other trials


def steps(person: Person, rng: np.random.Generator, duration_s: float, _ball: float) -> Plan:
    """One step ahead off the plate and back, with single support on the plate between."""
    sketch = sketch_for(person, duration_s)
    side = str(rng.choice(SIDES))
    moments = MOMENTS * duration_s
    reach = 0.23 * person.stature_m * rng.uniform(0.95, 1.05)
    _stepping_foot(sketch, side, moments, reach)
    _load(sketch, side, moments, rng.uniform(0.35, 0.55))
    for name in SIDES:
        swing = -1.0 if name == side else 1.0
        ahead = _ahead(sketch.t_s, moments)
        sketch.angles[f"shoulder_{name}"][:, 0] += swing * np.deg2rad(15.0) * ahead
    add_breath_of_motion(sketch, rng, np.deg2rad(0.4))
    add_sway(sketch, rng, 0.3)
    plate_ahead, plate_aside = plate_under(sketch, rng)
    return sketch.plan(
        plate_centre_m=(plate_ahead - EDGE_CLOSER_M, plate_aside),
        sway_share=0.2,
        notes={"stepping_side": side},
    )


def _ahead(t: np.ndarray, moments: np.ndarray) -> np.ndarray:
    """0 on the plate, 1 on the floor ahead."""
    out = glide(t, moments[1], moments[2], 0.4 * (moments[2] - moments[1]))
    back = glide(t, moments[5], moments[6], 0.4 * (moments[6] - moments[5]))
    return out - back


def _stepping_foot(sketch: Sketch, side: str, moments: np.ndarray, reach_m: float) -> None:
    t, foot = sketch.t_s, sketch.feet[side]
    foot.ahead_m += reach_m * _ahead(t, moments)
    for a, b in ((moments[1], moments[2]), (moments[5], moments[6])):
        foot.raised_m[:, 1] += 0.07 * window(t, a, b, 0.5 * (b - a))
    foot.on_plate[:] = (t < moments[1]) | (t > moments[6])


def _load(sketch: Sketch, side: str, moments: np.ndarray, floor_share: float) -> None:
    """The stepping foot's part of the load: half, none, some on the floor, none, half."""
    t = sketch.t_s
    on_plate = 1.0 - step(t, moments[0], moments[1]) + step(t, moments[6], moments[7])
    on_floor = step(t, moments[2], moments[3]) - step(t, moments[4], moments[5])
    share = 0.5 * on_plate + floor_share * on_floor
    other = "l" if side == "r" else "r"
    sketch.feet[side].share[:] = share
    sketch.feet[other].share[:] = 1.0 - share
