"""The identification sequence: blocks of movement in every joint, on two tracks at once.

One track moves the trunk and the legs, the other the head and the arms; amplitudes, paces
and order are drawn, so that people differ.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from bsip_cli.simulate.numerics import wander, window
from bsip_cli.simulate.people import SIDES, Person
from bsip_cli.simulate.plan import (
    Plan,
    Sketch,
    add_breath_of_motion,
    add_squat,
    add_sway,
    plate_under,
    sketch_for,
)

CYCLE_S = 27.0
QUIET_S = 0.4
DEEPEST_M_PER_S2 = 0.5  # depth of a squat per square of its half period
FAST_HZ = (1.0, 2.0)


def sequence(person: Person, rng: np.random.Generator, duration_s: float, _ball: float) -> Plan:
    """Movements of all joints, slow and fast, small and large, for duration_s."""
    sketch = sketch_for(person, duration_s)
    upper = UPPER_TRACK
    if "sternoclavicular_r" in person.joints_m:
        sketch.angles |= {f"girdle_{side}": np.zeros((len(sketch.t_s), 2)) for side in SIDES}
        upper = WITH_GIRDLE
    cycles = max(1, round(duration_s / CYCLE_S))
    for track in (LOWER_TRACK, upper):  # blocks one after the other, in drawn order in each cycle
        weight = sum(share for _, share in track)
        scale = (duration_s - 2.0 * QUIET_S) / (cycles * weight)
        start = QUIET_S
        for _ in range(cycles):
            for index in rng.permutation(len(track)):
                block, share = track[index]
                block(Block(sketch, rng, start, start + share * scale))
                start += share * scale
    calm = window(sketch.t_s, 0.0, duration_s, 0.8)
    for angle in sketch.angles.values():
        for column in np.atleast_2d(angle.T):
            column += calm * wander(sketch.t_s, rng, np.deg2rad(2.0), 0.2, 1.0)
    add_breath_of_motion(sketch, rng, np.deg2rad(0.2))
    add_sway(sketch, rng)
    return sketch.plan(plate_centre_m=plate_under(sketch, rng), sway_share=0.35)


@dataclass(frozen=True, eq=False)
class Block:
    """A part of the sequence from start to end [s]; each method is a kind of movement."""

    sketch: Sketch
    rng: np.random.Generator
    start: float
    end: float

    def wave(self, *pace_hz: float, ramp: float = 0.6) -> np.ndarray:
        """A windowed oscillation (T,) of amplitude 1 at a drawn pace and phase."""
        frequency = np.exp(self.rng.uniform(*np.log(pace_hz)))
        phase = self.rng.uniform(0.0, 2.0 * np.pi)
        carrier = np.sin(2.0 * np.pi * frequency * (self.sketch.t_s - self.start) + phase)
        return self.window(ramp) * carrier

    def window(self, ramp: float) -> np.ndarray:
        """(T,) 1 inside the block."""
        return window(self.sketch.t_s, self.start, self.end, ramp)

    def size(self, low: Sequence[float], high: Sequence[float]) -> np.ndarray:
        """Drawn amplitudes [rad] between bounds in degrees."""
        return np.deg2rad(self.rng.uniform(low, high))

    def trunk(self) -> None:
        size, pace = self.size([22, 12, 18], [38, 22, 35]), (0.35, 1.1)
        waist, bend = self.sketch.angles["waist"], self.wave(*pace)
        bent = 0.6 * self.window(0.8) + 0.6 * bend
        waist[:, 0] -= size[0] * bent
        waist[:, 1] += size[1] * self.wave(*pace)
        waist[:, 2] += size[2] * self.wave(*pace)
        self.sketch.pelvis_angles[:, 0] -= 0.3 * size[0] * bent

    def twist(self) -> None:
        size = self.size([10, 8, 25], [18, 14, 40])
        for axis in range(3):
            wave = self.wave(0.7, 1.6)
            self.sketch.angles["waist"][:, axis] += size[axis] * wave
            self.sketch.pelvis_angles[:, axis] += 0.25 * size[axis] * wave

    def squats(self) -> None:
        count = max(1, round((self.end - self.start) / self.rng.uniform(1.15, 1.9)))
        for a, b in pairwise(np.linspace(self.start, self.end, count + 1)):
            down = window(self.sketch.t_s, a, b, 0.5 * (b - a))
            depth = self.rng.uniform(0.08, 0.16) * self.sketch.person.stature_m
            add_squat(self.sketch, down, min(depth, DEEPEST_M_PER_S2 * (0.5 * (b - a)) ** 2))

    def lift_leg(self, side: str, other: str, out: float) -> None:
        """Stand on one leg and move hip, knee and ankle of the other."""
        t, foot = self.sketch.t_s, self.sketch.feet[side]
        shift = min(0.9, 0.22 * (self.end - self.start))
        self._shift_load(side, other, 0.5 * self.window(shift))
        up, down = self.start + shift, self.end - shift
        lifted = window(t, up, down, min(0.6, 0.4 * (down - up)))
        stature = self.sketch.person.stature_m
        inner = Block(self.sketch, self.rng, up, down)
        waves = [inner.wave(0.7, 1.7, ramp=0.5) for _ in range(6)]
        foot.raised_m[:, 0] += stature * (0.08 * lifted + 0.09 * waves[0]) * lifted
        foot.raised_m[:, 1] += stature * (0.13 * lifted + 0.035 * waves[1] * lifted)
        foot.raised_m[:, 2] += out * stature * (0.06 * lifted + 0.05 * waves[2]) * lifted
        size = np.deg2rad([22.0, 10.0, 15.0])
        foot.tilt_rad += size * np.stack(waves[3:], axis=1) * lifted[:, None]
        foot.tilt_rad[:, 0] -= np.deg2rad(12.0) * lifted

    def _shift_load(self, side: str, other: str, part: np.ndarray) -> None:
        """Move a part (T,) of the body's weight from one foot to the other."""
        self.sketch.feet[side].share -= part
        self.sketch.feet[other].share += part

    def shift_weight(self) -> None:
        """Rock from foot to foot and from heel to toe, and turn the pelvis."""
        self._shift_load("l", "r", 0.38 * self.wave(0.35, 0.7))
        ahead = self.wave(0.35, 0.7)
        for side in SIDES:
            self.sketch.feet[side].cop_ahead_m += 0.045 * ahead
        size = self.size([6, 4, 8], [12, 8, 15])
        for axis in range(3):
            wave = self.wave(0.5, 1.2)
            self.sketch.pelvis_angles[:, axis] += size[axis] * wave
            self.sketch.angles["waist"][:, axis] -= 0.7 * size[axis] * wave

    def both_arms(self) -> None:
        for side in SIDES:
            self.arm_circle(side, 0.35, 0.8)

    def arm_circle(self, side: str, *pace: float) -> None:
        size, middle = self.size([35, 22, 20], [60, 38, 45]), self.window(0.8)
        shoulder = self.sketch.angles[f"shoulder_{side}"]
        shoulder[:, 0] += size[0] * (0.8 * middle + self.wave(*pace))
        shoulder[:, 1] += size[1] * (1.2 * middle + self.wave(*pace))
        shoulder[:, 2] += size[2] * self.wave(*pace)
        bend = np.deg2rad(self.rng.uniform(10, 30))
        self.sketch.angles[f"elbow_{side}"] += bend * (middle + self.wave(*pace))

    def elbows(self) -> None:
        middle = self.window(0.7)
        for side in SIDES:
            size = np.deg2rad(self.rng.uniform(30, 50))
            self.sketch.angles[f"elbow_{side}"] += size * (1.05 * middle + self.wave(0.7, 1.8))
            turn = self.wave(0.5, 1.0)
            turn = np.deg2rad(self.rng.uniform(15, 40)) * turn
            self.sketch.angles[f"shoulder_{side}"][:, 2] += turn

    def wrists(self) -> None:
        middle = self.window(0.7)
        for side in SIDES:
            bend = np.deg2rad(self.rng.uniform(50, 75))
            self.sketch.angles[f"elbow_{side}"] += bend * middle
            size = self.size([30, 10, 40], [50, 18, 65])
            for axis in range(3):
                self.sketch.angles[f"wrist_{side}"][:, axis] += size[axis] * self.wave(0.8, 2.2)

    def head(self) -> None:
        size = self.size([22, 15, 30], [38, 28, 55])
        for axis in range(3):
            self.sketch.angles["neck"][:, axis] += size[axis] * self.wave(0.5, 1.3)

    def shrugs(self) -> None:
        """Raise the shoulders, and bring them forward and back."""
        for side in SIDES:
            size = self.size([10, 10], [20, 20])
            for axis in range(2):
                self.sketch.angles[f"girdle_{side}"][:, axis] += size[axis] * self.wave(0.5, 1.4)

    def free(self) -> None:
        """Arms, hands and head at once."""
        self.head()
        for side in SIDES:
            self.arm_circle(side, 0.5, 1.2)
            self.sketch.angles[f"wrist_{side}"][:, 2] += np.deg2rad(40.0) * self.wave(0.8, 1.6)


Track = tuple[tuple[Callable[[Block], None], float], ...]
"""Blocks, and their parts of a cycle."""
LOWER_TRACK: Track = (
    (Block.trunk, 3.6),
    (Block.squats, 3.6),
    (lambda block: block.lift_leg("r", "l", 1.0), 4.8),
    (Block.twist, 3.0),
    (lambda block: block.lift_leg("l", "r", -1.0), 4.8),
    (Block.shift_weight, 3.0),
)
UPPER_TRACK: Track = (
    (Block.both_arms, 3.6),
    (lambda block: block.arm_circle("r", *FAST_HZ), 3.0),
    (lambda block: block.arm_circle("l", *FAST_HZ), 3.0),
    (Block.elbows, 3.2),
    (Block.wrists, 3.2),
    (Block.head, 3.0),
    (Block.free, 3.6),
)
WITH_GIRDLE = (*UPPER_TRACK, (Block.shrugs, 3.2))
