"""Effects outside the catalogue: what a diagnosis must not take for anything it knows.

Their names begin with ``outside_``; the right verdict on them is `unexplained`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from bsip_cli.instruments.readings import Instruments, SensingPlate
from bsip_cli.simulate.effects.base import Effect, Target
from bsip_cli.simulate.effects.plate_channels import ChannelFault, on_plates
from bsip_cli.simulate.people import Person
from bsip_cli.simulate.plan import Plan
from bsip_cli.simulate.poses import Poses

LOADED_N = 40.0
BELT_HZ = 5.0
BURST_FRAMES = (4, 12)
WANDERS_S = 1.5
SLACK_M = 0.1
FASTENED_M = (-1.2, 0.1, 0.3)  # the tether's far end from the first place of the pelvis


@dataclass(frozen=True)
class BeltVibration(Effect):
    """Plates shake vertically by `size` N at about 5 Hz while somebody stands on them."""

    frequency_hz: float
    phase_rad: float

    name = "outside_belt_vibration"
    unit = "N"
    least, most = 0.0, 300.0
    injectable = True
    needs_plates = True
    personal = False

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        frequency = BELT_HZ * float(rng.uniform(0.8, 1.2))
        return cls(size, frequency, float(rng.uniform(-np.pi, np.pi)))

    def measured(self, instruments: Instruments) -> Instruments:
        return on_plates(instruments, 0, self._shaken)

    def _shaken(self, reading: np.ndarray, _: SensingPlate, times_s: np.ndarray) -> np.ndarray:
        wave = np.sin(2.0 * np.pi * self.frequency_hz * times_s + self.phase_rad)
        changed = reading.copy()
        changed[:, 2] += self.size * wave * (np.abs(reading[:, 2]) > LOADED_N)
        return changed


@dataclass(frozen=True)
class PlateHysteresis(Effect):
    """Horizontal channels follow with a play of `size` N: they stick until moved by that much."""

    name = "outside_plate_hysteresis"
    unit = "N"
    least, most = 0.0, 100.0
    injectable = True
    needs_plates = True
    personal = False

    def measured(self, instruments: Instruments) -> Instruments:
        return on_plates(instruments, 0, self._sticking)

    def _sticking(self, reading: np.ndarray, *_: object) -> np.ndarray:
        changed = reading.copy()
        for column in (0, 1):
            changed[:, column] = play(reading[:, column], self.size)
        return changed


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


@dataclass(frozen=True)
class PlateSaturation(Effect):
    """The vertical channel flattens: at 1000 N it shows the part `size` too little.

    The error grows with the square of the load.
    """

    name = "outside_plate_saturation"
    unit = "1"
    least, most = 0.0, 0.3
    injectable = True
    needs_plates = True
    personal = False

    def measured(self, instruments: Instruments) -> Instruments:
        return on_plates(instruments, 0, self._flattened)

    def _flattened(self, reading: np.ndarray, *_: object) -> np.ndarray:
        changed = reading.copy()
        changed[:, 2] *= 1.0 - np.minimum(self.size * (reading[:, 2] / 1000.0) ** 2, 0.5)
        return changed


@dataclass(frozen=True)
class LateChannel(ChannelFault):
    """The channel comes `size` seconds late: its amplifier's filter is slower than the others'."""

    name = "outside_late_channel"
    unit = "s"
    least, most = 0.0, 0.2

    def read(self, values: np.ndarray, times_s: np.ndarray) -> np.ndarray:
        return np.interp(times_s - self.size, times_s, values)


@dataclass(frozen=True)
class LooseConnector(Effect):
    """The vertical channel's gain wanders: a contact that opens and closes within seconds.

    `size` is the standard deviation of the gain.
    """

    seed: int

    name = "outside_loose_connector"
    unit = "1"
    least, most = 0.0, 0.2
    injectable = True
    needs_plates = True
    personal = False

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        return cls(size, int(rng.integers(1 << 31)))

    def measured(self, instruments: Instruments) -> Instruments:
        return on_plates(instruments, 0, self._wandering)

    def _wandering(self, reading: np.ndarray, _: SensingPlate, times_s: np.ndarray) -> np.ndarray:
        knots = np.arange(times_s[0], times_s[-1] + WANDERS_S, WANDERS_S)
        drawn = np.random.default_rng([self.seed, len(times_s)]).standard_normal(len(knots))
        changed = reading.copy()
        changed[:, 2] *= 1.0 + self.size * np.interp(times_s, knots, drawn)
        return changed


@dataclass(frozen=True)
class ClockJump(Effect):
    """From a moment on the force comes `size` seconds later: a buffer of the plates was lost."""

    from_share: float

    name = "outside_clock_jump"
    unit = "s"
    least, most = -0.3, 0.3
    injectable = True
    needs_plates = True
    personal = False

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        return cls(size, float(rng.uniform(0.35, 0.65)))

    def measured(self, instruments: Instruments) -> Instruments:
        times = instruments.sample_times_s()
        later = times > self.from_share * times[-1]
        return instruments.with_forces_from(times - self.size * later)


@dataclass(frozen=True)
class RepeatedFrames(Effect):
    """The cameras stall: bursts of frames repeat the last one; `size` is their part."""

    seed: int

    name = "outside_repeated_frames"
    unit = "1"
    least, most = 0.0, 0.6
    injectable = True
    spares_static = True

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        return cls(size, int(rng.integers(1 << 31)))

    def measured(self, instruments: Instruments) -> Instruments:
        frames = len(instruments.points_m)
        rng = np.random.default_rng([self.seed, frames])
        source = np.arange(frames)
        longest = BURST_FRAMES[1]
        while np.mean(source != np.arange(frames)) < self.size and frames > 2 * longest:
            first = int(rng.integers(1, frames - longest))
            length = int(rng.integers(BURST_FRAMES[0], longest + 1))
            source[first : first + length] = source[first - 1]
        return instruments.with_points(instruments.points_m[source])


@dataclass(frozen=True)
class ElasticTether(Effect):
    """A rubber band of `size` N/m pulls the pelvis back towards a fixed point."""

    name = "outside_elastic_tether"
    unit = "N/m"
    least, most = 0.0, 600.0
    spares_static = True
    hint = "a person who is pulled moves otherwise"

    def plan(self, person: Person, plan: Plan) -> Plan:
        band = Band(self.size, plan.pelvis_m[plan.keep.start] + np.array(FASTENED_M))
        return replace(plan, loads=(*plan.loads, band))


@dataclass(frozen=True, eq=False)
class Band:
    """An elastic band from a fixed point (3,) to the pelvis, taut from the start."""

    stiffness_n_m: float
    fastened_m: np.ndarray

    def wrench(self, poses: Poses, step_s: float) -> tuple[np.ndarray, np.ndarray]:
        """What the body exerts on the band."""
        r = poses.origin_m["lower_torso"]
        away = r - self.fastened_m
        length = np.linalg.norm(away, axis=1, keepdims=True)
        rest = float(np.linalg.norm(FASTENED_M)) - SLACK_M
        force = self.stiffness_n_m * np.maximum(length - rest, 0.0) * away / length
        return force, np.cross(r, force)

    def thinned(self, samples: slice) -> Band:
        """Follows the poses it is given."""
        return self
