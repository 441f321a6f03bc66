"""What several effects change together."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from bsip_cli.effects.delayed import Delay, put_right
from bsip_cli.effects.effect import Effect
from bsip_cli.effects.scene import Scene

Sized = tuple[Effect, str, np.ndarray]  # effect, target, values


def joint_change(scene: Scene, effects: Iterable[Sized]) -> np.ndarray:
    """(N, 6) what they add to the simulated wrench, about the world's origin [N, N m].

    Their changes add up, but for delays: these are one delay. Two opposite ones that were added
    would sharpen the forces, and so make up for what a smoothed motion lacks.
    """
    change = np.zeros((len(scene.times_s), 6))
    late_s = np.zeros(len(scene.times_s))
    for effect, target, values in effects:
        if isinstance(effect, Delay):
            late_s += effect.late_s(scene, values)
        else:
            change += effect.change(scene, target, values)
    return change + put_right(scene, late_s) if late_s.any() else change
