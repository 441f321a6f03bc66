"""The identification sequence: blocks of movement in every joint, on two tracks at once.

One track moves the trunk and the legs, the other the head and the arms; amplitudes, paces
and order are drawn, so that people differ.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from bsip_cli.simulate.curves import wander, window
from bsip_cli.simulate.movements.standing import (
    add_breath_of_motion,
    add_squat,
    add_sway,
    plate_under,
)
from bsip_cli.simulate.people import SIDES, Person
from bsip_cli.simulate.plan import Plan
from bsip_cli.simulate.sketch import Sketch, sketch_for

Block = Callable[[Sketch, np.random.Generator, float, float], None]
CYCLE_S = 27.0
QUIET_S = 0.4
DEEPEST_M_PER_S2 = 0.5  # depth of a squat per square of its half period


def sequence(person: Person, rng: np.random.Generator, duration_s: float, _ball: float) -> Plan:
    """Movements of all joints, slow and fast, small and large, for duration_s."""
    sketch = sketch_for(person, duration_s)
    cycles = max(1, round(duration_s / CYCLE_S))
    _fill(sketch, rng, LOWER_TRACK, cycles, duration_s)
    upper = UPPER_TRACK
    if "sternoclavicular_r" in person.joints_m:
        sketch.angles |= {f"girdle_{side}": np.zeros((len(sketch.t_s), 2)) for side in SIDES}
        upper = (*UPPER_TRACK, (_shrugs, 3.2))
    _fill(sketch, rng, upper, cycles, duration_s)
    calm = window(sketch.t_s, 0.0, duration_s, 0.8)
    for angle in sketch.angles.values():
        for column in np.atleast_2d(angle.T):
            column += calm * wander(sketch.t_s, rng, np.deg2rad(2.0), 0.2, 1.0)
    add_breath_of_motion(sketch, rng, np.deg2rad(0.2))
    add_sway(sketch, rng)
    return sketch.plan(plate_centre_m=plate_under(sketch, rng), sway_share=0.35)


def _fill(
    sketch: Sketch,
    rng: np.random.Generator,
    track: tuple[tuple[Block, float], ...],
    cycles: int,
    duration_s: float,
) -> None:
    """Lay the track's blocks one after the other, in drawn order within each cycle."""
    weight = sum(share for _, share in track)
    scale = (duration_s - 2.0 * QUIET_S) / (cycles * weight)
    start = QUIET_S
    for _ in range(cycles):
        for index in rng.permutation(len(track)):
            block, share = track[index]
            block(sketch, rng, start, start + share * scale)
            start += share * scale


def _wave(
    sketch: Sketch,
    rng: np.random.Generator,
    start: float,
    end: float,
    pace_hz: tuple[float, float],
    ramp: float = 0.6,
) -> np.ndarray:
    """A windowed oscillation (T,) of amplitude 1 at a drawn pace and phase."""
    frequency = np.exp(rng.uniform(*np.log(pace_hz)))
    phase = rng.uniform(0.0, 2.0 * np.pi)
    carrier = np.sin(2.0 * np.pi * frequency * (sketch.t_s - start) + phase)
    return window(sketch.t_s, start, end, ramp) * carrier


def _trunk(sketch: Sketch, rng: np.random.Generator, start: float, end: float) -> None:
    size = np.deg2rad(rng.uniform([22, 12, 18], [38, 22, 35]))
    pace = (0.35, 1.1)
    bend = _wave(sketch, rng, start, end, pace)
    middle = window(sketch.t_s, start, end, 0.8)
    sketch.angles["waist"][:, 0] -= size[0] * (0.6 * middle + 0.6 * bend)
    sketch.angles["waist"][:, 1] += size[1] * _wave(sketch, rng, start, end, pace)
    sketch.angles["waist"][:, 2] += size[2] * _wave(sketch, rng, start, end, pace)
    sketch.pelvis_angles[:, 0] -= 0.3 * size[0] * (0.6 * middle + 0.6 * bend)


def _twist(sketch: Sketch, rng: np.random.Generator, start: float, end: float) -> None:
    size = np.deg2rad(rng.uniform([10, 8, 25], [18, 14, 40]))
    for axis in range(3):
        wave = _wave(sketch, rng, start, end, (0.7, 1.6))
        sketch.angles["waist"][:, axis] += size[axis] * wave
        sketch.pelvis_angles[:, axis] += 0.25 * size[axis] * wave


def _squats(sketch: Sketch, rng: np.random.Generator, start: float, end: float) -> None:
    count = max(1, round((end - start) / rng.uniform(1.15, 1.9)))
    times = np.linspace(start, end, count + 1)
    for a, b in pairwise(times):
        down = window(sketch.t_s, a, b, 0.5 * (b - a))
        depth = rng.uniform(0.08, 0.16) * sketch.person.stature_m
        add_squat(sketch, down, min(depth, DEEPEST_M_PER_S2 * (0.5 * (b - a)) ** 2))


def _lift(side: str) -> Block:
    def block(sketch: Sketch, rng: np.random.Generator, start: float, end: float) -> None:
        _lift_leg(sketch, rng, side, start, end)

    return block


def _lift_leg(
    sketch: Sketch, rng: np.random.Generator, side: str, start: float, end: float
) -> None:
    """Stand on one leg and move hip, knee and ankle of the other."""
    t = sketch.t_s
    shift = min(0.9, 0.22 * (end - start))
    _shift_load(sketch, side, 0.5 * window(t, start, end, shift))
    up, down = start + shift, end - shift
    lifted = window(t, up, down, min(0.6, 0.4 * (down - up)))
    foot = sketch.feet[side]
    out = 1.0 if side == "r" else -1.0
    stature = sketch.person.stature_m
    pace = (0.7, 1.7)
    waves = [_wave(sketch, rng, up, down, pace, 0.5) for _ in range(6)]
    foot.raised_m[:, 0] += stature * (0.08 * lifted + 0.09 * waves[0]) * lifted
    foot.raised_m[:, 1] += stature * (0.13 * lifted + 0.035 * waves[1] * lifted)
    foot.raised_m[:, 2] += out * stature * (0.06 * lifted + 0.05 * waves[2]) * lifted
    size = np.deg2rad([22.0, 10.0, 15.0])
    foot.tilt_rad += size * np.stack(waves[3:], axis=1) * lifted[:, None]
    foot.tilt_rad[:, 0] -= np.deg2rad(12.0) * lifted


def _shift_load(sketch: Sketch, side: str, part: np.ndarray) -> None:
    """Move a part (T,) of the body's weight from one foot to the other."""
    other = "l" if side == "r" else "r"
    sketch.feet[side].share -= part
    sketch.feet[other].share += part


def _shift_weight(sketch: Sketch, rng: np.random.Generator, start: float, end: float) -> None:
    """Rock from foot to foot and from heel to toe, and turn the pelvis."""
    _shift_load(sketch, "l", 0.38 * _wave(sketch, rng, start, end, (0.35, 0.7)))
    ahead = _wave(sketch, rng, start, end, (0.35, 0.7))
    for side in SIDES:
        sketch.feet[side].cop_ahead_m += 0.045 * ahead
    size = np.deg2rad(rng.uniform([6, 4, 8], [12, 8, 15]))
    for axis in range(3):
        wave = _wave(sketch, rng, start, end, (0.5, 1.2))
        sketch.pelvis_angles[:, axis] += size[axis] * wave
        sketch.angles["waist"][:, axis] -= 0.7 * size[axis] * wave


def _arm_circles(sides: tuple[str, ...], pace: tuple[float, float]) -> Block:
    def block(sketch: Sketch, rng: np.random.Generator, start: float, end: float) -> None:
        for side in sides:
            _arm_circle(sketch, rng, side, start, end, pace)

    return block


def _arm_circle(
    sketch: Sketch,
    rng: np.random.Generator,
    side: str,
    start: float,
    end: float,
    pace: tuple[float, float],
) -> None:
    size = np.deg2rad(rng.uniform([35, 22, 20], [60, 38, 45]))
    middle = window(sketch.t_s, start, end, 0.8)
    shoulder = sketch.angles[f"shoulder_{side}"]
    shoulder[:, 0] += size[0] * (0.8 * middle + _wave(sketch, rng, start, end, pace))
    shoulder[:, 1] += size[1] * (1.2 * middle + _wave(sketch, rng, start, end, pace))
    shoulder[:, 2] += size[2] * _wave(sketch, rng, start, end, pace)
    bend = np.deg2rad(rng.uniform(10, 30))
    sketch.angles[f"elbow_{side}"] += bend * (middle + _wave(sketch, rng, start, end, pace))


def _elbows(sketch: Sketch, rng: np.random.Generator, start: float, end: float) -> None:
    middle = window(sketch.t_s, start, end, 0.7)
    for side in SIDES:
        size = np.deg2rad(rng.uniform(30, 50))
        wave = _wave(sketch, rng, start, end, (0.7, 1.8))
        sketch.angles[f"elbow_{side}"] += size * (1.05 * middle + wave)
        turn = _wave(sketch, rng, start, end, (0.5, 1.0))
        sketch.angles[f"shoulder_{side}"][:, 2] += np.deg2rad(rng.uniform(15, 40)) * turn


def _wrists(sketch: Sketch, rng: np.random.Generator, start: float, end: float) -> None:
    middle = window(sketch.t_s, start, end, 0.7)
    for side in SIDES:
        sketch.angles[f"elbow_{side}"] += np.deg2rad(rng.uniform(50, 75)) * middle
        size = np.deg2rad(rng.uniform([30, 10, 40], [50, 18, 65]))
        for axis in range(3):
            wave = _wave(sketch, rng, start, end, (0.8, 2.2))
            sketch.angles[f"wrist_{side}"][:, axis] += size[axis] * wave


def _head(sketch: Sketch, rng: np.random.Generator, start: float, end: float) -> None:
    size = np.deg2rad(rng.uniform([22, 15, 30], [38, 28, 55]))
    for axis in range(3):
        wave = _wave(sketch, rng, start, end, (0.5, 1.3))
        sketch.angles["neck"][:, axis] += size[axis] * wave


def _shrugs(sketch: Sketch, rng: np.random.Generator, start: float, end: float) -> None:
    """Raise the shoulders, and bring them forward and back."""
    for side in SIDES:
        size = np.deg2rad(rng.uniform([10, 10], [20, 20]))
        for axis in range(2):
            wave = _wave(sketch, rng, start, end, (0.5, 1.4))
            sketch.angles[f"girdle_{side}"][:, axis] += size[axis] * wave


def _free(sketch: Sketch, rng: np.random.Generator, start: float, end: float) -> None:
    """Arms, hands and head at once."""
    _head(sketch, rng, start, end)
    for side in SIDES:
        _arm_circle(sketch, rng, side, start, end, (0.5, 1.2))
        wave = _wave(sketch, rng, start, end, (0.8, 1.6))
        sketch.angles[f"wrist_{side}"][:, 2] += np.deg2rad(40.0) * wave


LOWER_TRACK: tuple[tuple[Block, float], ...] = (
    (_trunk, 3.6),
    (_squats, 3.6),
    (_lift("r"), 4.8),
    (_twist, 3.0),
    (_lift("l"), 4.8),
    (_shift_weight, 3.0),
)
UPPER_TRACK: tuple[tuple[Block, float], ...] = (
    (_arm_circles(("l", "r"), (0.35, 0.8)), 3.6),
    (_arm_circles(("r",), (1.0, 2.0)), 3.0),
    (_arm_circles(("l",), (1.0, 2.0)), 3.0),
    (_elbows, 3.2),
    (_wrists, 3.2),
    (_head, 3.0),
    (_free, 3.6),
)
