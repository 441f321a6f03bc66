"""Effects outside the catalogue: the right verdict on them is `unexplained`.

The simulator that ships does not know them. ``python -m tests.blind.outside_effects simulate ...``
is ``bsip`` with them.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.signal import bilinear, butter, lfilter, sosfiltfilt

from bsip_cli.cli import main
from bsip_cli.instruments.readings import Instruments, SensingPlate
from bsip_cli.simulate.effects.base import TABLE, Effect, by, uniform
from bsip_cli.simulate.effects.instruments import OfEveryPlate, OfOneChannel, number_below
from bsip_cli.simulate.numerics import from_rotation_vector
from bsip_cli.simulate.people import Person
from bsip_cli.simulate.plan import Load, Plan

OUTSIDE = {
    row["name"]: row
    for row in csv.DictReader(Path(__file__).with_suffix(".csv").read_text("utf-8").splitlines())
}
TABLE.update(OUTSIDE)
LOADED_N = 40.0
BELT_HZ = 5.0
WANDERS_S = 1.5
SLACK_M = 0.1
FASTENED_M = (-1.2, 0.1, 0.3)  # a tether's far end from the first place of the pelvis
BURST_FRAMES = (4, 12)
BURST_S = (0.02, 0.1)
CREEPS_S = 3.0
RINGS_HZ, RINGS_DAMPED = (7.0, 12.0), 0.05


class BeltVibration(OfEveryPlate, name="outside_belt_vibration"):
    """Plates shake vertically by `size` N at about 5 Hz while somebody stands on them."""

    frequency_hz: float = by(lambda size, target, rng: BELT_HZ * float(rng.uniform(0.8, 1.2)))
    phase_rad: float = uniform(-np.pi, np.pi)

    def read(self, reading: np.ndarray, plate: SensingPlate, times_s: np.ndarray) -> None:
        wave = np.sin(2.0 * np.pi * self.frequency_hz * times_s + self.phase_rad)
        reading[:, 2] += self.size * wave * (np.abs(reading[:, 2]) > LOADED_N)


class PlateHysteresis(OfEveryPlate, name="outside_plate_hysteresis"):
    """Horizontal channels follow with a play of `size` N: they stick until moved by that much."""

    def read(self, reading: np.ndarray, plate: SensingPlate, times_s: np.ndarray) -> None:
        for column in (0, 1):
            reading[:, column] = play(reading[:, column], self.size)


def play(values: np.ndarray, width: float) -> np.ndarray:
    """(N,) output of a backlash of this full width; lost samples leave it where it is."""
    result, at = np.empty_like(values), values[0]
    for k, value in enumerate(values):
        if value - at > 0.5 * width:
            at = value - 0.5 * width
        elif at - value > 0.5 * width:
            at = value + 0.5 * width
        result[k] = at
    return result


class PlateSaturation(OfEveryPlate, name="outside_plate_saturation"):
    """The vertical channel flattens: at 1000 N it shows the part `size` too little.

    The error grows with the square of the load.
    """

    def read(self, reading: np.ndarray, plate: SensingPlate, times_s: np.ndarray) -> None:
        reading[:, 2] *= 1.0 - np.minimum(self.size * (reading[:, 2] / 1000.0) ** 2, 0.5)


class RepeatedFrames(Effect, name="outside_repeated_frames"):
    """The cameras stall: bursts of frames repeat the last one; `size` is their part."""

    seed: int = number_below(1 << 31)

    def measured(self, instruments: Instruments) -> Instruments:
        frames = len(instruments.points_m)
        rng = np.random.default_rng([self.seed, frames])
        source = np.arange(frames)
        longest = BURST_FRAMES[1]
        while np.mean(source != np.arange(frames)) < self.size and frames > 2 * longest:
            first = int(rng.integers(1, frames - longest))
            length = int(rng.integers(BURST_FRAMES[0], longest + 1))
            source[first : first + length] = source[first - 1]
        return replace(instruments, points_m=instruments.points_m[source])


class ElasticTether(Effect, name="outside_elastic_tether"):
    """A rubber band of `size` N/m pulls the pelvis back towards a fixed point."""

    def plan(self, person: Person, plan: Plan) -> Plan:
        fastened = plan.pelvis_m[plan.keep.start] + np.array(FASTENED_M)
        return plan.with_load(Band("lower_torso", np.zeros(3), self.size, fastened))


@dataclass(frozen=True, eq=False)
class Band(Load):
    """An elastic band from a fixed point (3,), taut from the start."""

    stiffness_n_m: float
    fastened_m: np.ndarray

    def force(self, path_m: np.ndarray, step_s: float) -> np.ndarray:
        away = path_m - self.fastened_m
        length = np.linalg.norm(away, axis=1, keepdims=True)
        rest = float(np.linalg.norm(FASTENED_M)) - SLACK_M
        return self.stiffness_n_m * np.maximum(length - rest, 0.0) * away / length


class LateChannel(OfOneChannel, name="outside_late_channel"):
    """The channel comes `size` seconds late: its amplifier's filter is slower than the others'."""

    def read(self, reading: np.ndarray, plate: SensingPlate, times_s: np.ndarray) -> None:
        now = reading[:, self.column]
        reading[:, self.column] = np.interp(times_s - self.size, times_s, now)


class LooseConnector(OfEveryPlate, name="outside_loose_connector"):
    """The vertical channel's gain wanders: a contact that opens and closes within seconds.

    `size` is the standard deviation of the gain.
    """

    seed: int = number_below(1 << 31)

    def read(self, reading: np.ndarray, plate: SensingPlate, times_s: np.ndarray) -> None:
        knots = np.arange(times_s[0], times_s[-1] + WANDERS_S, WANDERS_S)
        drawn = np.random.default_rng([self.seed, len(times_s)]).standard_normal(len(knots))
        reading[:, 2] *= 1.0 + self.size * np.interp(times_s, knots, drawn)


class ClockJump(Effect, name="outside_clock_jump"):
    """From a moment on the force comes `size` seconds later: a buffer of the plates was lost."""

    from_share: float = uniform(0.35, 0.65)

    def measured(self, instruments: Instruments) -> Instruments:
        times = instruments.sample_times_s()
        return instruments.with_forces_from(
            times - self.size * (times > self.from_share * times[-1])
        )


class PlateCreep(OfEveryPlate, name="outside_plate_creep"):
    """The part `size` of every channel follows with a time constant of 3 s: a soft mount."""

    def read(self, reading: np.ndarray, plate: SensingPlate, times_s: np.ndarray) -> None:
        follows = 1.0 - np.exp(-(times_s[1] - times_s[0]) / CREEPS_S)
        known = np.nan_to_num(reading)
        start = (1.0 - follows) * known[:1]
        slow, _ = lfilter([follows], [1.0, follows - 1.0], known, axis=0, zi=start)
        reading += self.size * (slow - reading)


class PlateRinging(OfEveryPlate, name="outside_plate_ringing"):
    """The part `size` of every channel goes through a resonance: a plate on a floor that swings."""

    frequency_hz: float = uniform(*RINGS_HZ)

    def read(self, reading: np.ndarray, plate: SensingPlate, times_s: np.ndarray) -> None:
        pace = 2.0 * np.pi * self.frequency_hz
        rate = 1.0 / (times_s[1] - times_s[0])
        over, under = bilinear([pace**2], [1.0, 2.0 * RINGS_DAMPED * pace, pace**2], rate)
        from_start = np.nan_to_num(reading) - np.nan_to_num(reading[:1])
        reading += self.size * (lfilter(over, under, from_start, axis=0) + reading[:1] - reading)


class SlowForces(OfEveryPlate, name="outside_slow_forces"):
    """All channels were smoothed too much, by a filter without delay that cuts off at `size` Hz."""

    def read(self, reading: np.ndarray, plate: SensingPlate, times_s: np.ndarray) -> None:
        rate = 1.0 / (times_s[1] - times_s[0])
        cut = butter(2, self.size, fs=rate, output="sos")
        reading[:] = sosfiltfilt(cut, np.nan_to_num(reading), axis=0)


class UnevenPlate(OfEveryPlate, name="outside_uneven_plate"):
    """The vertical channel's gain grows by `size` per metre that the load lies along the plate."""

    def read(self, reading: np.ndarray, plate: SensingPlate, times_s: np.ndarray) -> None:
        reading[:, 2] -= self.size * reading[:, 4]


class HeldSamples(OfEveryPlate, name="outside_held_samples"):
    """The converter stalls: all channels hold their value for moments; `size` is their part."""

    seed: int = number_below(1 << 31)

    def read(self, reading: np.ndarray, plate: SensingPlate, times_s: np.ndarray) -> None:
        count, rate = len(times_s), 1.0 / (times_s[1] - times_s[0])
        rng = np.random.default_rng([self.seed, count])
        source = np.arange(count)
        while np.mean(source != np.arange(count)) < self.size:
            length = int(rate * rng.uniform(*BURST_S))
            first = int(rng.integers(1, count - length))
            source[first : first + length] = source[first - 1]
        reading[:] = reading[source]


class CoarseSteps(OfEveryPlate, name="outside_coarse_steps"):
    """Forces come in steps of `size` N, moments in steps of a tenth of that in N m."""

    def read(self, reading: np.ndarray, plate: SensingPlate, times_s: np.ndarray) -> None:
        step = self.size * np.repeat([1.0, 0.1], 3)
        reading[:] = step * np.round(reading / step)


class Water(Effect, name="outside_water"):
    """Something brakes the pelvis by `size` N at 1 m/s, with the square of its velocity."""

    def plan(self, person: Person, plan: Plan) -> Plan:
        return plan.with_load(Brake("lower_torso", np.zeros(3), self.size))


@dataclass(frozen=True, eq=False)
class Brake(Load):
    """A force against the velocity."""

    drag_n_s2_m2: float

    def force(self, path_m: np.ndarray, step_s: float) -> np.ndarray:
        velocity = np.gradient(path_m, step_s, axis=0)
        return self.drag_n_s2_m2 * np.linalg.norm(velocity, axis=1, keepdims=True) * velocity


class CameraBump(Effect, name="outside_camera_bump"):
    """From a moment on all markers are turned by `size` about a level axis through the lab's
    origin: somebody ran into a camera."""

    heading_rad: float = uniform(-np.pi, np.pi)
    from_share: float = uniform(0.35, 0.65)

    def measured(self, instruments: Instruments) -> Instruments:
        axis = np.array([np.cos(self.heading_rad), np.sin(self.heading_rad), 0.0])
        turn = from_rotation_vector(self.size * axis)
        points = instruments.points_m.copy()
        first = int(self.from_share * len(points))
        points[first:] = points[first:] @ turn.T
        return replace(instruments, points_m=points)


if __name__ == "__main__":
    main()
