"""Force plates that are late, lie elsewhere, or read wrongly.

Channels are the six components in the plate's own axes, moments about its sensor.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from bsip_cli.errors import UsageError
from bsip_cli.instruments.readings import COMPONENTS, Instruments, SensingPlate
from bsip_cli.simulate.effects.base import Effect, Target
from bsip_cli.simulate.numerics import from_rotation_vector

AXES = ("x", "y", "z")
TURNS = {"yaw": 2, "tilt_x": 0, "tilt_y": 1}


# --- clocks ---------------------------------------------------------------------------------------


class SyncOffset(Effect, name="sync_offset"):
    """The force comes late by `size` (early if negative)."""

    def measured(self, instruments: Instruments) -> Instruments:
        return instruments.with_forces_from(instruments.sample_times_s() - self.size)


class ClockDrift(Effect, name="clock_drift"):
    """The force's delay grows by `size` seconds per second, from 0 at the start of a trial."""

    def measured(self, instruments: Instruments) -> Instruments:
        return instruments.with_forces_from(instruments.sample_times_s() * (1.0 - self.size))


class FrameRate(Effect, name="frame_rate"):
    """All was recorded at 1 + `size` times the rate that the file states."""

    def measured(self, instruments: Instruments) -> Instruments:
        return instruments.said_slower(1.0 + self.size)


# --- plates ---------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class TurnedAxes(Effect):
    """turn_rad : rotation vector, lab axes."""

    turn_rad: np.ndarray

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        return cls(size, size * _axis(target.name, rng))


class GravityTilt(TurnedAxes, name="gravity_tilt"):
    """The lab's axes are turned against the world by turn_rad.

    Markers and forces turn together about the first plate's centre, so that the physics
    stays whole; only gravity no longer points down the lab's vertical.
    """

    def measured(self, instruments: Instruments) -> Instruments:
        turn, pivot = from_rotation_vector(self.turn_rad), instruments.plates[0].centre_m
        points = (instruments.points_m - pivot) @ turn.T + pivot
        readings = []
        for reading, plate in zip(instruments.readings, instruments.plates, strict=True):
            force, moment = plate.lab_wrench(reading, pivot)
            readings.append(plate.reading(force @ turn.T, moment @ turn.T, pivot))
        return replace(instruments, points_m=points, readings=np.stack(readings))


class CameraFrame(TurnedAxes, name="camera_frame"):
    """All markers are turned by turn_rad about the lab's origin."""

    def measured(self, instruments: Instruments) -> Instruments:
        turn = from_rotation_vector(self.turn_rad)
        return replace(instruments, points_m=instruments.points_m @ turn.T)


class OfEveryPlate(Effect, ABC):
    """A plate reads otherwise, or each of them."""

    plate = 0  # its number; 0 for all

    def measured(self, instruments: Instruments) -> Instruments:
        number, count = self.plate, len(instruments.plates)
        if not 0 <= number <= count:
            raise UsageError(f"there is no plate {number}", expected=f"1 to {count}, or 0 for all")
        readings, times = instruments.readings.copy(), instruments.sample_times_s()
        for index, plate in enumerate(instruments.plates):
            if number in (0, index + 1):
                self.read(readings[index], plate, times)
        return replace(instruments, readings=readings)

    @abstractmethod
    def read(self, reading: np.ndarray, plate: SensingPlate, times_s: np.ndarray) -> None:
        """Change a plate's true reading (N, 6) into what it shows, at times (N,)."""

    def place(self) -> str:
        return f"plate {self.plate}" if self.plate else "all plates"


@dataclass(frozen=True, eq=False)
class PlateTranslation(OfEveryPlate, name="plate_translation"):
    """The plate truly lies at its stated place plus shift_m (lab axes).

    plate : its number, or 0 for all of them.
    """

    shift_m: np.ndarray
    plate: int

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        return cls(size, size * _axis(target.name, rng), int(target.get("plate", 0)))

    def read(self, reading: np.ndarray, plate: SensingPlate, times_s: np.ndarray) -> None:
        reading[:, 3:] -= np.cross(plate.axes.T @ self.shift_m, reading[:, :3])


@dataclass(frozen=True, eq=False)
class PlateRotation(OfEveryPlate, name="plate_rotation"):
    """The plate is truly turned by turn_rad (rotation vector, lab axes) about its centre."""

    turn_rad: np.ndarray
    plate: int

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        axis = np.eye(3)[TURNS[target.name or "yaw"]]
        return cls(size, size * axis, int(target.get("plate", 0)))

    def read(self, reading: np.ndarray, plate: SensingPlate, times_s: np.ndarray) -> None:
        force, moment = plate.lab_wrench(reading, plate.centre_m)
        turn = from_rotation_vector(self.turn_rad)
        reading[:] = plate.reading(force @ turn, moment @ turn, plate.centre_m)


def _axis(name: str, rng: np.random.Generator) -> np.ndarray:
    """(3,) a lab axis, or a drawn horizontal direction."""
    heading = rng.uniform(-np.pi, np.pi)
    drawn = np.array([np.cos(heading), np.sin(heading), 0.0])
    return np.eye(3)[AXES.index(name)] if name else drawn


# --- channels -------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class ChannelFault(OfEveryPlate):
    """An error of one channel. plate : its number, or 0 for all."""

    channel: str
    plate: int

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        return cls(size, target.name or "fz", int(target.get("plate", 0)))

    def read(self, reading: np.ndarray, plate: SensingPlate, times_s: np.ndarray) -> None:
        column = COMPONENTS.index(self.channel)
        reading[:, column] = self.shown(reading[:, column], times_s)

    @abstractmethod
    def shown(self, values: np.ndarray, times_s: np.ndarray) -> np.ndarray:
        """What the channel (N,) shows instead of its true values."""

    def place(self) -> str:
        return self.channel + (f" of plate {self.plate}" if self.plate else "")


class PlateGain(ChannelFault, name="plate_gain"):
    """The channel shows 1 + size times the truth."""

    def shown(self, values: np.ndarray, times_s: np.ndarray) -> np.ndarray:
        return (1.0 + self.size) * values


class OwnSignal(ChannelFault):
    """Something is added to the channel, whatever it measures."""

    def injected(self, instruments: Instruments) -> Instruments:
        """What the software that wrote the file has set to zero stays so."""
        changed = self.measured(instruments)
        silent = (instruments.readings == 0).all(axis=2, keepdims=True)
        return replace(changed, readings=np.where(silent, 0.0, changed.readings))


class PlateZero(OwnSignal, name="plate_zero"):
    """A constant is added to the channel."""

    def shown(self, values: np.ndarray, times_s: np.ndarray) -> np.ndarray:
        return values + self.size


class PlateDrift(OwnSignal, name="plate_drift"):
    """The channel's zero moves at a constant rate, from 0 at the start of each trial."""

    def shown(self, values: np.ndarray, times_s: np.ndarray) -> np.ndarray:
        return values + self.size * times_s


@dataclass(frozen=True, eq=False)
class PlateCrosstalk(OfEveryPlate, name="plate_crosstalk"):
    """Channel `to` shows size times channel `source` plus its own."""

    source: str
    to: str
    plate: int

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        source, _, to = (target.name or "fz:fx").partition(":")
        if source not in COMPONENTS or to not in COMPONENTS or source == to:
            raise cls.wrong_target(target.name)
        return cls(size, source, to, int(target.get("plate", 0)))

    def read(self, reading: np.ndarray, plate: SensingPlate, times_s: np.ndarray) -> None:
        source, to = COMPONENTS.index(self.source), COMPONENTS.index(self.to)
        reading[:, to] += self.size * reading[:, source]

    def place(self) -> str:
        return f"{self.source}:{self.to}" + (f" of plate {self.plate}" if self.plate else "")
