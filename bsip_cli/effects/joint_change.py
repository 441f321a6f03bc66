"""What several effects change together."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from scipy.interpolate import CubicSpline

from bsip_cli.effects.delayed import Delay, put_right, right_times_s
from bsip_cli.effects.effect import Effect
from bsip_cli.effects.scene import Scene

Sized = tuple[Effect, str, np.ndarray]  # effect, target, values


def joint_change(scene: Scene, effects: Iterable[Sized]) -> np.ndarray:
    """(N, 6) what they add to the simulated wrench, about the world's origin [N, N m].

    Their changes add up, but for delays. Several are one delay: two opposite ones that were added
    would sharpen the forces, and so make up for what a smoothed motion lacks. And what the plates
    do wrong comes as late as their forces do.
    """
    effects = tuple(effects)
    late_s = joint_delay_s(scene, effects)
    of_the_plates = np.zeros((len(scene.times_s), 6))
    others = of_the_plates.copy()
    for effect, target, values in effects:
        if isinstance(effect, Delay):
            continue
        if effect.of_the_plates:
            of_the_plates += effect.change(scene, target, values)
        else:
            others += effect.change(scene, target, values)
    if not late_s.any():
        return of_the_plates + others
    if of_the_plates.any():
        of_the_plates = CubicSpline(scene.times_s, of_the_plates)(right_times_s(scene, late_s))
    return of_the_plates + others + put_right(scene, late_s)


def joint_delay_s(scene: Scene, effects: Iterable[Sized]) -> np.ndarray:
    """(N,) how late the forces of each frame were recorded, by all delays among the effects [s]."""
    late_s = np.zeros(len(scene.times_s))
    for effect, _, values in effects:
        if isinstance(effect, Delay):
            late_s += effect.late_s(scene, values)
    return late_s
