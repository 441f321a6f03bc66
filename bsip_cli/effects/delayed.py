"""What a clock that runs otherwise adds to the simulated wrench."""

from __future__ import annotations

import numpy as np

from bsip_cli.effects.scene import Scene


def delay_change(scene: Scene, late_s: np.ndarray) -> np.ndarray:
    """(N, 6) measured wrench less the same put right, where it comes ``late_s`` (N,) [s] late.

    From the measured course: the simulated one holds the noise of the motion, whose derivative
    would make every delay seem smaller than it is. The ends stay as they are.
    """
    times = scene.times_s
    at = np.clip(times + late_s, times[0], times[-1])
    return scene.measured_course(times) - scene.measured_course(at)
