"""Errors of a plate's channels: gain, crosstalk, zero and drift.

Channels are the six components in the plate's own axes, moments about its sensor.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Self

import numpy as np

from bsip_cli.errors import UsageError
from bsip_cli.instruments.readings import COMPONENTS, Instruments, SensingPlate
from bsip_cli.simulate.effects.base import Effect, Target

Change = Callable[[np.ndarray, SensingPlate, np.ndarray], np.ndarray]


def on_plates(instruments: Instruments, number: int, change: Change) -> Instruments:
    """Apply change(reading (N, 6), plate, times_s (N,)) to one plate, or to all for 0."""
    count = len(instruments.plates)
    if not 0 <= number <= count:
        raise UsageError(f"there is no plate {number}", expected=f"1 to {count}, or 0 for all")
    times = instruments.sample_times_s()
    readings = instruments.readings.copy()
    for index, plate in enumerate(instruments.plates):
        if number in (0, index + 1):
            readings[index] = change(readings[index], plate, times)
    return instruments.with_readings(readings)


@dataclass(frozen=True)
class ChannelFault(Effect, ABC):
    """An error of one channel. plate : its number, or 0 for all."""

    channel: str
    plate: int

    targets = "fx, fy, fz (if none), mx, my or mz, plate=NUMBER"
    settings = ("plate",)
    injectable = True
    needs_plates = True
    personal = False

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        channel = target.name or "fz"
        if channel not in COMPONENTS:
            raise cls.wrong_target(channel)
        return cls(size, channel, int(target.get("plate", 0)))

    def measured(self, instruments: Instruments) -> Instruments:
        return on_plates(instruments, self.plate, self._changed)

    def _changed(self, reading: np.ndarray, _: SensingPlate, times_s: np.ndarray) -> np.ndarray:
        changed = reading.copy()
        column = COMPONENTS.index(self.channel)
        changed[:, column] = self.read(reading[:, column], times_s)
        return changed

    @abstractmethod
    def read(self, values: np.ndarray, times_s: np.ndarray) -> np.ndarray:
        """What the channel (N,) shows instead of its true values."""

    def place(self) -> str:
        return self.channel + (f" of plate {self.plate}" if self.plate else "")


@dataclass(frozen=True)
class PlateGain(ChannelFault):
    """The channel shows 1 + size times the truth."""

    name = "plate_gain"
    unit = "1"
    least, most = -0.5, 0.5

    def read(self, values: np.ndarray, times_s: np.ndarray) -> np.ndarray:
        return (1.0 + self.size) * values


@dataclass(frozen=True)
class PlateZero(ChannelFault):
    """A constant is added to the channel."""

    name = "plate_zero"
    unit = "N or N m"
    least, most = -300.0, 300.0

    def read(self, values: np.ndarray, times_s: np.ndarray) -> np.ndarray:
        return values + self.size


@dataclass(frozen=True)
class PlateDrift(ChannelFault):
    """The channel's zero moves at a constant rate, from 0 at the start of each trial."""

    name = "plate_drift"
    unit = "N/s or N m/s"
    least, most = -50.0, 50.0

    def read(self, values: np.ndarray, times_s: np.ndarray) -> np.ndarray:
        return values + self.size * times_s


@dataclass(frozen=True)
class PlateCrosstalk(Effect):
    """Channel `to` shows size times channel `source` besides its own."""

    source: str
    to: str
    plate: int

    name = "plate_crosstalk"
    unit = "1 (m from force to moment)"
    least, most = -0.5, 0.5
    targets = "FROM:TO, two of fx, fy, fz, mx, my, mz (fz:fx if none), plate=NUMBER"
    settings = ("plate",)
    injectable = True
    needs_plates = True
    personal = False

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        source, _, to = (target.name or "fz:fx").partition(":")
        if source not in COMPONENTS or to not in COMPONENTS or source == to:
            raise cls.wrong_target(target.name)
        return cls(size, source, to, int(target.get("plate", 0)))

    def measured(self, instruments: Instruments) -> Instruments:
        return on_plates(instruments, self.plate, self._mixed)

    def _mixed(self, reading: np.ndarray, _: SensingPlate, times_s: np.ndarray) -> np.ndarray:
        changed = reading.copy()
        source, to = COMPONENTS.index(self.source), COMPONENTS.index(self.to)
        changed[:, to] += self.size * reading[:, source]
        return changed

    def place(self) -> str:
        return f"{self.source}:{self.to}" + (f" of plate {self.plate}" if self.plate else "")
