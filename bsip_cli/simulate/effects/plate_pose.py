"""A force plate that does not lie where the file says."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from bsip_cli.instruments.readings import Instruments, SensingPlate
from bsip_cli.simulate.effects.base import Effect, Target
from bsip_cli.simulate.effects.plate_channels import on_plates
from bsip_cli.simulate.rotations import from_rotation_vector

AXES = ("x", "y", "z")


@dataclass(frozen=True, eq=False)
class PlateTranslation(Effect):
    """The plate truly lies at its stated place plus shift_m (lab axes).

    plate : its number, or 0 for all of them.
    """

    shift_m: np.ndarray
    plate: int

    name = "plate_translation"
    unit = "m"
    least, most = -0.3, 0.3
    targets = "a lab axis x, y or z (else a horizontal direction is drawn), plate=NUMBER"
    settings = ("plate",)
    injectable = True
    needs_plates = True
    personal = False

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        if target.name and target.name not in AXES:
            raise cls.wrong_target(target.name)
        heading = rng.uniform(-np.pi, np.pi)
        drawn = np.array([np.cos(heading), np.sin(heading), 0.0])
        along = np.eye(3)[AXES.index(target.name)] if target.name else drawn
        return cls(size, size * along, int(target.get("plate", 0)))

    def measured(self, instruments: Instruments) -> Instruments:
        return on_plates(instruments, self.plate, self._shifted)

    def _shifted(self, reading: np.ndarray, plate: SensingPlate, _: np.ndarray) -> np.ndarray:
        lever = plate.axes.T @ self.shift_m
        moment = reading[:, 3:] - np.cross(lever, reading[:, :3])
        return np.hstack([reading[:, :3], moment])

    def place(self) -> str:
        return f"plate {self.plate}" if self.plate else "all plates"


@dataclass(frozen=True, eq=False)
class PlateRotation(Effect):
    """The plate is truly turned by turn_rad (rotation vector, lab axes) about its centre."""

    turn_rad: np.ndarray
    plate: int

    name = "plate_rotation"
    unit = "rad"
    least, most = -0.5, 0.5
    needs_surface = True
    targets = "yaw (if none), tilt_x or tilt_y (about lab axes), plate=NUMBER"
    settings = ("plate",)
    injectable = True
    needs_plates = True
    personal = False

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        axes = {"yaw": 2, "tilt_x": 0, "tilt_y": 1}
        name = target.name or "yaw"
        if name not in axes:
            raise cls.wrong_target(name)
        return cls(size, size * np.eye(3)[axes[name]], int(target.get("plate", 0)))

    def measured(self, instruments: Instruments) -> Instruments:
        return on_plates(instruments, self.plate, self._turned)

    def _turned(self, reading: np.ndarray, plate: SensingPlate, _: np.ndarray) -> np.ndarray:
        force, moment = plate.lab_wrench(reading, plate.centre_m)
        turn = from_rotation_vector(self.turn_rad)
        return plate.reading(force @ turn, moment @ turn, plate.centre_m)

    def place(self) -> str:
        return f"plate {self.plate}" if self.plate else "all plates"
