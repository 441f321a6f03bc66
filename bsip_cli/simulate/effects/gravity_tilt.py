"""A lab whose Z is not the true vertical."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from bsip_cli.instruments.readings import Instruments
from bsip_cli.simulate.effects.base import Effect, Target
from bsip_cli.simulate.rotations import from_rotation_vector


@dataclass(frozen=True, eq=False)
class GravityTilt(Effect):
    """The lab's axes are turned against the world by turn_rad (rotation vector, lab axes).

    Markers and forces turn together about the first plate's centre, so that the physics
    stays whole; only gravity no longer points down the lab's vertical.
    """

    turn_rad: np.ndarray

    name = "gravity_tilt"
    unit = "rad"
    least, most = -0.2, 0.2
    targets = "the lab axis x or y that the vertical turns about (else a horizontal one is drawn)"
    injectable = True
    needs_plates = True
    personal = False

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        heading = rng.uniform(-np.pi, np.pi)
        axes = {
            "": np.array([np.cos(heading), np.sin(heading), 0.0]),
            "x": np.array([1.0, 0.0, 0.0]),
            "y": np.array([0.0, 1.0, 0.0]),
        }
        if target.name not in axes:
            raise cls.wrong_target(target.name)
        return cls(size, size * axes[target.name])

    def measured(self, instruments: Instruments) -> Instruments:
        turn = from_rotation_vector(self.turn_rad)
        pivot = instruments.plates[0].centre_m
        points = (instruments.points_m - pivot) @ turn.T + pivot
        readings = []
        for reading, plate in zip(instruments.readings, instruments.plates, strict=True):
            force, moment = plate.lab_wrench(reading, pivot)
            readings.append(plate.reading(force @ turn.T, moment @ turn.T, pivot))
        return instruments.with_points(points).with_readings(np.stack(readings))
