"""The simulated wrench as a clock that runs otherwise would have recorded it."""

from __future__ import annotations

import numpy as np

from bsip_cli.effects.scene import Scene


def delayed(scene: Scene, late_s: np.ndarray) -> np.ndarray:
    """(N, 6) simulated wrench that comes ``late_s`` (N,) [s] late; its ends stay as they are."""
    times = scene.times_s
    at = np.clip(times - late_s, times[0], times[-1])
    return scene.predicted_course(at)
