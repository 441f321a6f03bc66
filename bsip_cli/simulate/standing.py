"""On the plate: quiet stance, squats, a throw, held postures, steps, and the sequence."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import groupby, pairwise
from operator import itemgetter

import numpy as np

from bsip_cli.simulate.numerics import glide, slow_drift, soft_polyline, step, window
from bsip_cli.simulate.people import SIDE_SIGN, SIDES, Person, table
from bsip_cli.simulate.plan import (
    FootSketch,
    Plan,
    Sketch,
    add_squat,
    held_ball,
    moved_a_little,
    other_side,
    plate_under,
    sketch_for,
)

RIGHT_HANDED_SHARE = 0.9
SOFTNESS_S = 0.032
STAGGER_M = 0.11  # each foot from the middle
# Of a throw, in degrees at: start, cocked, release, followed through, back; and how early [s].
THROW = (
    ("shoulder_own 0", (0, 115, 45, 5, 0), 0.0),
    ("shoulder_own 1", (0, 75, 78, 35, 0), 0.0),
    ("elbow_own", (0, 95, 12, 10, 0), 0.01),
    ("wrist_own 0", (0, -30, 10, 30, 0), 0.0),
    ("shoulder_free 0", (0, 50, 20, 0, 0), 0.0),  # the free arm points ahead, then comes in
    ("elbow_free", (0, 15, 60, 50, 0), 0.0),
    ("turn", (0, -38, 16, 34, 0), 0.04),
    ("waist 0", (0, 8, -14, -28, 0), 0.0),
)
TURNED = {"waist 2": 0.7, "pelvis 2": 0.3, "neck 2": -0.7}  # parts of its turn


def static(person: Person, rng: np.random.Generator, duration_s: float, _ball: float) -> Plan:
    """Upright and nearly still, arms slightly away from the body."""
    sketch = sketch_for(person, duration_s)
    sketch.bend_both("shoulder_* 1", np.deg2rad(13.0))
    moved_a_little(sketch, rng, 0.15, 0.4)
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
        sketch.bend(f"shoulder_{side} 0", np.deg2rad(rng.uniform(55.0, 75.0)) * down)
    moved_a_little(sketch, rng, 0.4)
    return sketch.plan(plate_centre_m=plate_under(sketch, rng), sway_share=0.3)


def throwing(
    person: Person, rng: np.random.Generator, duration_s: float, ball_mass_kg: float
) -> Plan:
    """Stand with one foot ahead, cock the arm, throw, follow through, stand."""
    sketch = sketch_for(person, duration_s)
    t = sketch.t_s
    side, other = ("r", "l") if rng.random() < RIGHT_HANDED_SHARE else ("l", "r")
    sketch.feet[side].ahead_m -= STAGGER_M
    sketch.feet[other].ahead_m += STAGGER_M
    throw_s, release = rng.uniform(0.20, 0.26), 0.5 * duration_s
    frames = np.array([0.15, release - throw_s, release, release + 0.22, duration_s - 0.15])
    for name, degrees, early_s in THROW:
        size = np.deg2rad(np.array(degrees)) * rng.uniform(0.85, 1.1)
        curve = soft_polyline(t, frames - early_s, size, SOFTNESS_S)
        if name != "turn":
            sketch.bend(name.replace("own", side).replace("free", other), curve)
        for turned, part in TURNED.items() if name == "turn" else ():
            sketch.bend(turned, part * (SIDE_SIGN[side] * curve))
    dip = step(t, frames[0], frames[1]) - step(t, frames[3], frames[4])
    add_squat(sketch, dip, 0.04 * person.stature_m)
    sketch.bend_both("wrist_* 2", -np.deg2rad(20.0) * dip)
    ahead = soft_polyline(t, frames, np.array([0, -1.0, 0.6, 1.0, 0]), 0.08)
    sketch.shift_load(side, 0.25 * ahead)
    moved_a_little(sketch, rng, 0.4, 0.6)
    ball, notes = held_ball(sketch, rng, side, release, ball_mass_kg), {"throwing_side": side}
    centre = plate_under(sketch, rng)
    return sketch.plan(plate_centre_m=centre, sway_share=0.3, ball=ball, notes=notes)


def postures(person: Person, rng: np.random.Generator, duration_s: float, _ball: float) -> Plan:
    """A bow, arms ahead and aside, each leg raised with a bent and a straight knee: all held."""
    sketch = sketch_for(person, duration_s)
    for number, (start, end) in enumerate(pairwise(np.linspace(0.0, duration_s, 8))):
        shift = 0.3 * (end - start)
        held = window(sketch.t_s, start, end, shift) * rng.uniform(0.85, 1.0)
        if number == 0:
            sketch.bend("waist 0", -np.deg2rad(35.0) * held)
        elif number < 3:
            sketch.bend_both(f"shoulder_* {number - 1}", np.deg2rad(80.0) * held)
        else:  # stand on the other leg for the middle, and hold the foot ahead and up
            side, half = SIDES[number % 2], 0.5 * shift
            sketch.shift_load(side, 0.5 * window(sketch.t_s, start, end, half))
            lifted = held * window(sketch.t_s, start + half, end - half, 0.8 * shift)
            ahead, up, tilt_deg = (0.14, 0.22, 0.0) if number < 5 else (0.30, 0.16, 35.0)
            foot = sketch.feet[side]
            foot.raised_m[:, 0] += ahead * person.stature_m * lifted
            foot.raised_m[:, 1] += up * person.stature_m * lifted
            foot.tilt_rad[:, 0] += np.deg2rad(tilt_deg) * lifted
    moved_a_little(sketch, rng, 0.2)
    return sketch.plan(plate_centre_m=plate_under(sketch, rng), sway_share=0.3)


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
    reach = 0.23 * person.stature_m * rng.uniform(0.95, 1.05)
    floor_share = rng.uniform(0.35, 0.55)
    foot = sketch.feet[side]
    ahead = _swing(foot, t, moments[1], moments[2]) - _swing(foot, t, moments[5], moments[6])
    foot.ahead_m += reach * ahead
    foot.on_plate[:] = (t < moments[1]) | (t > moments[6])
    on_plate = 1.0 - step(t, moments[0], moments[1]) + step(t, moments[6], moments[7])
    on_floor = step(t, moments[2], moments[3]) - step(t, moments[4], moments[5])
    foot.share[:] = 0.5 * on_plate + floor_share * on_floor
    sketch.feet[other_side(side)].share[:] = 1.0 - foot.share
    _swing_arms(sketch, side, 15.0, ahead)
    moved_a_little(sketch, rng, 0.4, 0.3)
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
    length = person.lengths_m[f"foot_{first}"]
    reach = HALF_PLATE_M + CLEARANCE_M + 0.73 * length - sketch.mid_foot_m()
    reach += rng.uniform(0.0, 0.03)
    for foot in sketch.feet.values():
        foot.ahead_m -= reach
    on, off = ON * duration_s, OFF * duration_s
    for moments in (on, off):
        _step(sketch, first, moments, reach)
    for side, swing in ((first, slice(1, 3)), (other_side(first), slice(3, 5))):
        start, end = np.mean(on[swing]), np.mean(off[swing])  # from mid-swing to mid-swing
        sketch.feet[side].on_plate[:] = (sketch.t_s > start) & (sketch.t_s < end)
    sketch.pelvis_m[:, 0] += 0.5 * (sketch.feet["l"].ahead_m + sketch.feet["r"].ahead_m)
    moved_a_little(sketch, rng, 0.4, 0.3)
    centre, notes = (sketch.mid_foot_m(), rng.normal(0.0, 0.03)), {"first_side": first}
    return sketch.plan(plate_centre_m=centre, sway_share=0.2, notes=notes)


def _step(sketch: Sketch, first: str, moments: np.ndarray, reach_m: float) -> None:
    """Bring first one foot, then the other, ahead by reach_m."""
    t, second = sketch.t_s, other_side(first)
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
    sketch.shift_load(first, change)
    _swing_arms(sketch, first, 14.0, step(t, leave, land) - step(t, loaded, close))


def _swing(foot: FootSketch, t: np.ndarray, start: float, end: float) -> np.ndarray:
    """Raise a foot from start to end; (T,) how far it has come ahead by then, 0 to 1."""
    foot.raised_m[:, 1] += 0.07 * window(t, start, end, 0.5 * (end - start))
    return glide(t, start, end, 0.4 * (end - start))


def _swing_arms(sketch: Sketch, side: str, degrees: float, ahead: np.ndarray) -> None:
    """Bring the other side's arm ahead with a foot, and the foot's own back."""
    swing = np.deg2rad(degrees) * ahead
    sketch.bend(f"shoulder_{side} 0", -swing)
    sketch.bend(f"shoulder_{other_side(side)} 0", swing)


# --- the identification sequence: blocks of movement in every joint, on two tracks at once --------

# One track moves the trunk and the legs, the other the head and the arms; amplitudes, paces
# and order are drawn, so that people differ.

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
            column += calm * slow_drift(sketch.t_s, rng, np.deg2rad(2.0), 0.2, 1.0)
    moved_a_little(sketch, rng, 0.2)
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

    def size(self, least_deg: float, most_deg: float) -> float:
        """A drawn amplitude [rad]; nothing is drawn where it is fixed."""
        fixed = least_deg == most_deg
        return np.deg2rad(least_deg if fixed else self.rng.uniform(least_deg, most_deg))

    def swing(self, name: str, side: str = "", *pace_hz: float) -> None:
        """Angles of `swings.csv` about their middle, each at a pace of its own.

        Amplitudes of one joint are drawn before its paces. pace_hz : of rows that have none.
        """
        rows = [row for row in table("swings.csv") if row["swing"] == name]
        for angle, group in groupby(rows, itemgetter("angle")):
            drawn = [(row, self.size(*numbers(row, "least_deg", "most_deg"))) for row in group]
            for row, size in drawn:
                (wave, middle), shape = numbers(row, "wave", "middle"), np.zeros(1)
                if middle:
                    shape = middle * self.window(*numbers(row, "ramp_s"))
                if wave:
                    pace = numbers(row, "slow_hz", "fast_hz") if row["slow_hz"] else pace_hz
                    shape = shape + wave * self.wave(*pace)
                place = angle.replace("*", side)
                self.sketch.bend(f"{place} {row['axis']}", size * shape)
                if row["also"]:
                    (part,) = numbers(row, "part")
                    self.sketch.bend(f"{row['also']} {row['axis']}", part * size * shape)

    def both(self, name: str, *pace_hz: float) -> None:
        """The swings of the left side, then those of the right one."""
        for side in SIDES:
            self.swing(name, side, *pace_hz)

    def squats(self) -> None:
        count = max(1, round((self.end - self.start) / self.rng.uniform(1.15, 1.9)))
        for a, b in pairwise(np.linspace(self.start, self.end, count + 1)):
            down = window(self.sketch.t_s, a, b, 0.5 * (b - a))
            depth = self.rng.uniform(0.08, 0.16) * self.sketch.person.stature_m
            add_squat(self.sketch, down, min(depth, DEEPEST_M_PER_S2 * (0.5 * (b - a)) ** 2))

    def lift_leg(self, side: str, out: float) -> None:
        """Stand on one leg and move hip, knee and ankle of the other."""
        t, foot = self.sketch.t_s, self.sketch.feet[side]
        shift = min(0.9, 0.22 * (self.end - self.start))
        self.sketch.shift_load(side, 0.5 * self.window(shift))
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

    def shift_weight(self) -> None:
        """Rock from foot to foot and from heel to toe, and turn the pelvis."""
        self.sketch.shift_load("l", 0.38 * self.wave(0.35, 0.7))
        ahead = self.wave(0.35, 0.7)
        for side in SIDES:
            self.sketch.feet[side].cop_ahead_m += 0.045 * ahead
        self.swing("hips")

    def elbows(self) -> None:
        for side in SIDES:
            size = self.size(30, 50)
            bend = 1.05 * self.window(0.7) + self.wave(0.7, 1.8)
            self.sketch.bend(f"elbow_{side}", size * bend)
            wave = self.wave(0.5, 1.0)
            self.sketch.bend(f"shoulder_{side} 2", self.size(15, 40) * wave)

    def free(self) -> None:
        """Arms, hands and head at once."""
        self.swing("head")
        for side in SIDES:
            self.swing("arm", side, 0.5, 1.2)
            self.swing("hand", side)


def numbers(row: dict[str, str], *columns: str) -> list[float]:
    """Some columns of a row of the table."""
    return [float(row[column]) for column in columns]


Track = tuple[tuple[Callable[[Block], None], float], ...]
"""Blocks, and their parts of a cycle."""
LOWER_TRACK: Track = (
    (lambda block: block.swing("trunk"), 3.6),
    (Block.squats, 3.6),
    (lambda block: block.lift_leg("r", 1.0), 4.8),
    (lambda block: block.swing("twist"), 3.0),
    (lambda block: block.lift_leg("l", -1.0), 4.8),
    (Block.shift_weight, 3.0),
)
UPPER_TRACK: Track = (
    (lambda block: block.both("arm", 0.35, 0.8), 3.6),
    (lambda block: block.swing("arm", "r", *FAST_HZ), 3.0),
    (lambda block: block.swing("arm", "l", *FAST_HZ), 3.0),
    (Block.elbows, 3.2),
    (lambda block: block.both("wrist"), 3.2),
    (lambda block: block.swing("head"), 3.0),
    (Block.free, 3.6),
)
WITH_GIRDLE: Track = (*UPPER_TRACK, (lambda block: block.both("shrug"), 3.2))
