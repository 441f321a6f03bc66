"""Walking and running at constant speed; one stance is on the plate, the others beside it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bsip_cli.simulate.curves import glide, step
from bsip_cli.simulate.loads import GRAVITY
from bsip_cli.simulate.movements.standing import add_breath_of_motion
from bsip_cli.simulate.people import SIDE_SIGN, SIDES, Person
from bsip_cli.simulate.plan import STEP_S, Plan
from bsip_cli.simulate.sketch import Sketch

G = -GRAVITY[1]
LONGEST_REACH = 0.985  # the knee stays bent, about 20 degrees
STEPS_AROUND = 8  # steps planned before and after the one on the plate


@dataclass(frozen=True)
class Gait:
    """A steady gait. Step 0 starts at 0 s (its foot touches down) and lies on the plate.

    step_s : from one touch-down to the next. stance_s : contact of one foot.
    rise_s, fall_s : in which a swinging foot gains and loses its speed.
    toe_roll_rad, heel_roll_rad : largest heel rise, and toe rise at touch-down.
    toe_roll_share : part of the stance after which the heel rises.
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
        other = "l" if self.first_side == "r" else "r"
        return self.first_side if k % 2 == 0 else other

    def touch_s(self, k: int) -> float:
        return k * self.step_s

    def place_m(self, k: int) -> float:
        """Ankle ahead on the walkway, foot flat."""
        return self.speed_m_s * k * self.step_s


def walking(person: Person, rng: np.random.Generator, duration_s: float, _ball: float) -> Plan:
    """A stretch of walking around one stance on the plate."""
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
    sketch = _sketch(person, gait, duration_s, margin_steps=2.5)
    bob = 0.016 * size
    phase = 2.0 * np.pi * (sketch.t_s - 0.5 * (gait.stance_s - gait.step_s)) / step_s
    sketch.pelvis_m[:, 1] -= bob * np.cos(phase)
    for k in range(-STEPS_AROUND, STEPS_AROUND):
        _double_support_share(sketch, gait, k)
    return _finished(sketch, gait, rng, person)


def running(person: Person, rng: np.random.Generator, duration_s: float, _ball: float) -> Plan:
    """A stretch of running around one stance on the plate, with flight before and after."""
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
    sketch = _sketch(person, gait, duration_s, margin_steps=3.0)
    flights = _single_support_share(sketch, gait)
    sketch.angles["waist"][:, 0] -= np.deg2rad(8.0)
    return _finished(
        sketch, gait, rng, person, flights=flights, com_height_m=_bouncing_height(sketch, gait)
    )


def _sketch(person: Person, gait: Gait, duration_s: float, margin_steps: float) -> Sketch:
    """From mid-stance to mid-stance, recorded around the middle of the stance on the plate."""
    middle = 0.5 * gait.stance_s
    ends = np.round((middle - gait.step_s * (np.ceil(margin_steps) + 1.0)) / STEP_S)
    count = round(2 * gait.step_s * (np.ceil(margin_steps) + 1.0) / STEP_S)
    t = (ends + np.arange(count + 1)) * STEP_S
    start = np.round((middle - 0.5 * duration_s) / STEP_S) * STEP_S
    sketch = Sketch(person, t, (float(start), float(start) + duration_s))
    for side in SIDES:
        _feet(sketch, gait, side)
    _body(sketch, gait)
    return sketch


def _feet(sketch: Sketch, gait: Gait, side: str) -> None:
    """One foot's stances and swings."""
    t, foot = sketch.t_s, sketch.feet[side]
    length = sketch.person.lengths_m[f"foot_{side}"]
    own = [k for k in range(-STEPS_AROUND, STEPS_AROUND) if gait.side_of(k) == side]
    foot.aside_m[:] = SIDE_SIGN[side] * gait.half_width_m
    foot.ahead_m[:] = gait.place_m(own[0])
    foot.share[:] = 0.0
    foot.on_plate[:] = False
    foot.cop_ahead_m[:] = gait.cop_from * length
    for k in own:
        touch, lift = gait.touch_s(k), gait.touch_s(k) + gait.stance_s
        land = gait.touch_s(k + 2)
        swing = land - lift
        stride = 2.0 * gait.step_s * gait.speed_m_s
        foot.ahead_m += stride * glide(t, lift, land, gait.rise_s, gait.fall_s)
        up = step(t, lift, lift + 0.5 * swing) - step(t, lift + 0.5 * swing, land)
        foot.raised_m[:, 1] += gait.clearance_m * up
        rise = touch + gait.toe_roll_share * gait.stance_s
        roll = step(t, rise, lift + 0.12 * swing) - step(t, lift + 0.1 * swing, lift + 0.8 * swing)
        foot.toe_roll_rad += gait.toe_roll_rad * roll
        toes_up = step(t, land - 0.5 * swing, land - 0.02 * swing)
        toes_up -= step(t, land - 0.02 * swing, land + 0.2 * gait.stance_s)
        foot.heel_roll_rad += gait.heel_roll_rad * toes_up
        forward = step(t, touch, touch + 0.8 * gait.stance_s) - step(t, lift, land)
        foot.cop_ahead_m += (gait.cop_to - gait.cop_from) * length * forward
        if k == 0:
            foot.on_plate[(t > touch - 0.5 * swing) & (t < lift + 0.5 * swing)] = True


def _body(sketch: Sketch, gait: Gait) -> None:
    """Pelvis and arms swing with the stride."""
    t = sketch.t_s
    phase = np.pi * t / gait.step_s  # 0 when the first side touches down
    sign = SIDE_SIGN[gait.first_side]
    sketch.pelvis_m[:, 0] = gait.speed_m_s * t
    turn = sign * np.deg2rad(5.0) * np.cos(phase)
    sketch.pelvis_angles[:, 2] += turn
    sketch.pelvis_angles[:, 1] += sign * np.deg2rad(3.0) * np.sin(phase)
    sketch.pelvis_angles[:, 0] -= np.deg2rad(4.0)
    sketch.angles["waist"][:, 2] -= 2.0 * turn
    sketch.angles["waist"][:, 1] -= sign * np.deg2rad(3.0) * np.sin(phase)
    for side in SIDES:
        swing = -SIDE_SIGN[side] * sign * np.cos(phase)
        sketch.angles[f"shoulder_{side}"][:, 0] += gait.arm_swing_rad * swing
        sketch.angles[f"elbow_{side}"] += gait.elbow_rad + 0.4 * gait.arm_swing_rad * swing


def _double_support_share(sketch: Sketch, gait: Gait, k: int) -> None:
    """Load comes from the other foot after touch-down and goes to it at the end."""
    double = gait.stance_s - gait.step_s
    on = step(sketch.t_s, gait.touch_s(k), gait.touch_s(k) + double)
    off = step(sketch.t_s, gait.touch_s(k + 1), gait.touch_s(k + 1) + double)
    sketch.feet[gait.side_of(k)].share += on - off


def _single_support_share(sketch: Sketch, gait: Gait) -> tuple[tuple[int, int], ...]:
    """All the load on the foot in stance; returns the flights in samples."""
    t, flights = sketch.t_s, []
    for k in range(-STEPS_AROUND, STEPS_AROUND):
        touch, lift = gait.touch_s(k), gait.touch_s(k) + gait.stance_s
        stance = (t > touch - 0.5 * STEP_S) & (t < lift + 0.5 * STEP_S)
        sketch.feet[gait.side_of(k)].share[stance] = 1.0
        first, last = (round((s - t[0]) / STEP_S) for s in (lift, gait.touch_s(k + 1)))
        if first > 0 and last < len(t) - 1:
            flights.append((first, last))
    return tuple(flights)


def _bouncing_height(sketch: Sketch, gait: Gait) -> np.ndarray:
    """(T,) height of the centre of mass for ground forces 30 s^2 (1-s)^2 over each stance."""
    time = np.mod(sketch.t_s + 1e-9, gait.step_s) - 1e-9
    s = np.clip(time / gait.stance_s, 0.0, 1.0)
    stance = np.minimum(time, gait.stance_s)
    twice = 2.5 * s**4 - 3.0 * s**5 + s**6
    flight = gait.step_s - gait.stance_s
    after = time - stance
    height = G * gait.step_s * gait.stance_s * twice + G * gait.step_s * after
    height += -0.5 * G * flight * time - 0.5 * G * time**2
    return 0.56 * sketch.person.stature_m + height


def _finished(
    sketch: Sketch, gait: Gait, rng: np.random.Generator, person: Person, **options: Any
) -> Plan:
    add_breath_of_motion(sketch, rng, np.deg2rad(0.5))
    middle = 0.25 * person.lengths_m[f"foot_{gait.first_side}"]
    aside = SIDE_SIGN[gait.first_side] * gait.half_width_m
    centre = (middle + rng.normal(0.0, 0.02), aside + rng.normal(0.0, 0.05))
    return sketch.plan(
        speed_m_s=gait.speed_m_s, longest_reach=LONGEST_REACH, plate_centre_m=centre, **options
    )
