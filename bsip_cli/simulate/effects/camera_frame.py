"""Cameras that were calibrated with a frame that did not lie level."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from bsip_cli.simulate.effects.base import Effect, Target
from bsip_cli.simulate.instruments import Instruments
from bsip_cli.simulate.rotations import from_rotation_vector


@dataclass(frozen=True, eq=False)
class CameraFrame(Effect):
    """All markers are turned by turn_rad (rotation vector, lab axes) about the lab's origin."""

    turn_rad: np.ndarray

    name = "camera_frame"
    unit = "rad"
    least, most = -0.2, 0.2
    targets = "the lab axis x or y that the markers turn about (else a horizontal one is drawn)"
    injectable = True
    personal = False

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        heading = rng.uniform(-np.pi, np.pi)
        axes = {"": [np.cos(heading), np.sin(heading), 0.0], "x": [1.0, 0, 0], "y": [0, 1.0, 0]}
        if target.name not in axes:
            raise cls.wrong_target(target.name)
        return cls(size, size * np.array(axes[target.name]))

    def measured(self, instruments: Instruments) -> Instruments:
        turn = from_rotation_vector(self.turn_rad)
        return instruments.with_points(instruments.points_m @ turn.T)
