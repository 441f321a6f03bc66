"""A trial of the moving person whose plates are noisy and may err."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from bsip_cli.effects.effect import Effect
from bsip_cli.effects.scene import Scene
from tests.effects.moving_scene import moving, scene_of

NOISE = np.array([2.0, 2.0, 4.0, 1.0, 1.0, 0.5])  # [N, N m] of the whole wrench, per frame


def part_of_moving(first_s: float, duration_s: float, amplitude: float = 0.4) -> Scene:
    """A stretch of one long movement, as a trial of its own."""
    whole = moving(first_s + duration_s, amplitude)
    part = slice(round(first_s * whole.rate_hz), None)
    return scene_of(whole.q[part], whole.v[part], whole.a[part])


def shown(scene: Scene, change: np.ndarray | float) -> Scene:
    """The scene whose first plate shows so much more (N, 6)."""
    first, *others = scene.plates
    return replace(scene, plates=(replace(first, wrench=first.wrench + change), *others))


def noisy(scene: Scene, seed: int, times: float = 1.0) -> Scene:
    """White noise in the plates, so many times as large as usual."""
    drawn = np.random.default_rng(seed).normal(size=scene.predicted.shape)
    return shown(scene, times * NOISE * drawn)


def late(scene: Scene, delay_s: float) -> Scene:
    """All plates show their course a moment later."""
    at = np.clip(scene.times_s - delay_s, scene.times_s[0], None)
    plates = tuple(
        replace(plate, wrench=CubicSpline(scene.times_s, plate.wrench)(at))
        for plate in scene.plates
    )
    return replace(scene, plates=plates)


def with_effect(scene: Scene, effect: Effect, target: str, *values: float) -> Scene:
    """The scene in which an effect, one that does not hang on what is measured, is true."""
    return shown(scene, effect.change(scene, target, np.array(values)))
