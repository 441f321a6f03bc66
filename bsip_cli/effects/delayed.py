"""Clocks of cameras and plates that do not agree."""

from __future__ import annotations

from abc import abstractmethod

import numpy as np

from bsip_cli.effects.effect import Effect
from bsip_cli.effects.scene import Scene


class Delay(Effect):
    """The forces come late against the markers."""

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return ("",)

    @abstractmethod
    def late_s(self, scene: Scene, values: np.ndarray) -> np.ndarray:
        """(N,) how late the forces of each frame were recorded [s]."""

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        return put_right(scene, self.late_s(scene, values))


def put_right(scene: Scene, late_s: np.ndarray) -> np.ndarray:
    """(N, 6) the measured wrench less the same corrected by (N,) seconds; the trial's ends stay.

    From the measured course: the simulated one holds the noise of the motion, whose derivative
    would make every delay seem smaller than it is.
    """
    return scene.measured - scene.measured_course(right_times_s(scene, late_s))


def right_times_s(scene: Scene, late_s: np.ndarray) -> np.ndarray:
    """(N,) when the forces that belong to each frame were recorded, inside the trial."""
    return np.clip(scene.times_s + late_s, scene.times_s[0], scene.times_s[-1])
