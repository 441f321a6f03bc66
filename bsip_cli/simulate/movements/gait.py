"""Walking and running at constant speed; one stance is on the plate, the others beside it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bsip_cli.simulate.numerics import glide, step
from bsip_cli.simulate.people import SIDE_SIGN, SIDES, Person
from bsip_cli.simulate.plan import STEP_S, G, Plan, Sketch, add_breath_of_motion, other_side

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
    first_side: str

    def side_of(self, k: int) -> str:
        """The foot of step k."""
        return self.first_side if k % 2 == 0 else other_side(self.first_side)


def walking(person: Person, rng: np.random.Generator, duration_s: float, _ball: float) -> Plan:
    """A part of walking around one stance on the plate."""
    size = person.stature_m / 1.7
    step_s = rng.uniform(0.50, 0.53)
    gait = Gait(
        speed_m_s=rng.uniform(1.18, 1.28) * size,
        step_s=step_s,
        stance_s=1.14 * step_s,
        half_width_m=0.05,
        rise_s=0.24,
        fall_s=0.10,
        clearance_m=0.04,
        toe_roll_rad=np.deg2rad(58.0),
        heel_roll_rad=np.deg2rad(24.0),
        toe_roll_share=0.50,
        cop_from=-0.20,
        cop_to=0.68,
        arm_swing_rad=np.deg2rad(22.0),
        elbow_rad=np.deg2rad(10.0),
        first_side=str(rng.choice(SIDES)),
    )
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
    gait = Gait(
        speed_m_s=rng.uniform(2.7, 2.9) * size,
        step_s=step_s,
        stance_s=round(0.70 * step_s, 3),
        half_width_m=0.035,
        rise_s=0.13,
        fall_s=0.05,
        clearance_m=0.14,
        toe_roll_rad=np.deg2rad(75.0),
        heel_roll_rad=np.deg2rad(20.0),
        toe_roll_share=0.45,
        cop_from=0.10,
        cop_to=0.68,
        arm_swing_rad=np.deg2rad(28.0),
        elbow_rad=np.deg2rad(75.0),
        first_side=str(rng.choice(SIDES)),
    )
    sketch = _sketch(person, gait, duration_s)
    t, flights = sketch.t_s, []
    for k in STEPS:
        touch, lift = k * step_s, k * step_s + gait.stance_s
        stance = (t > touch - 0.5 * STEP_S) & (t < lift + 0.5 * STEP_S)
        sketch.feet[gait.side_of(k)].share[stance] = 1.0
        first, last = sketch.sample_of(lift), sketch.sample_of((k + 1) * step_s)
        if first > 0 and last < len(t) - 1:
            flights.append((first, last))
    sketch.angles["waist"][:, 0] -= np.deg2rad(8.0)
    height = _bouncing_height(sketch, gait)
    return _finished(sketch, gait, rng, flights=tuple(flights), com_height_m=height)


def _sketch(person: Person, gait: Gait, duration_s: float) -> Sketch:
    """From mid-stance to mid-stance, recorded around the middle of the stance on the plate."""
    middle = 0.5 * gait.stance_s
    count = round(8 * gait.step_s / STEP_S)  # four steps before the middle and four after it
    t = (np.round((middle - gait.step_s * 4.0) / STEP_S) + np.arange(count + 1)) * STEP_S
    start = float(np.round((middle - 0.5 * duration_s) / STEP_S) * STEP_S)
    sketch = Sketch(person, t, (start, start + duration_s))
    for side in SIDES:
        _move_foot(sketch, gait, side)
    _swing_body(sketch, gait)
    return sketch


def _move_foot(sketch: Sketch, gait: Gait, side: str) -> None:
    """One foot's stances and swings."""
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


def _swing_body(sketch: Sketch, gait: Gait) -> None:
    """Pelvis and arms swing with the stride."""
    phase = np.pi * sketch.t_s / gait.step_s  # 0 when the first side touches down
    sign = SIDE_SIGN[gait.first_side]
    turn = sign * np.deg2rad(5.0) * np.cos(phase)
    drop = sign * np.deg2rad(3.0) * np.sin(phase)
    sketch.pelvis_m[:, 0] = gait.speed_m_s * sketch.t_s
    sketch.pelvis_angles[:, 2] += turn
    sketch.pelvis_angles[:, 1] += drop
    sketch.pelvis_angles[:, 0] -= np.deg2rad(4.0)
    sketch.angles["waist"][:, 2] -= 2.0 * turn
    sketch.angles["waist"][:, 1] -= drop
    for side in SIDES:
        swing = -SIDE_SIGN[side] * sign * np.cos(phase)
        sketch.angles[f"shoulder_{side}"][:, 0] += gait.arm_swing_rad * swing
        sketch.angles[f"elbow_{side}"] += gait.elbow_rad + 0.4 * gait.arm_swing_rad * swing


def _bouncing_height(sketch: Sketch, gait: Gait) -> np.ndarray:
    """(T,) height of the centre of mass for ground forces 30 s^2 (1-s)^2 over each stance."""
    step_s, stance_s = gait.step_s, gait.stance_s
    time = np.mod(sketch.t_s + 1e-9, step_s) - 1e-9
    s = np.clip(time / stance_s, 0.0, 1.0)
    twice = 2.5 * s**4 - 3.0 * s**5 + s**6
    after = time - np.minimum(time, stance_s)
    height = G * step_s * stance_s * twice + G * step_s * after
    height += -0.5 * G * (step_s - stance_s) * time - 0.5 * G * time**2
    return 0.56 * sketch.person.stature_m + height


def _finished(sketch: Sketch, gait: Gait, rng: np.random.Generator, **options: Any) -> Plan:
    add_breath_of_motion(sketch, rng, np.deg2rad(0.5))
    middle = 0.25 * sketch.person.lengths_m[f"foot_{gait.first_side}"]
    aside = SIDE_SIGN[gait.first_side] * gait.half_width_m
    centre = (middle + rng.normal(0.0, 0.02), aside + rng.normal(0.0, 0.05))
    return sketch.plan(
        speed_m_s=gait.speed_m_s, longest_reach=LONGEST_REACH, plate_centre_m=centre, **options
    )
