"""The chest that moves with every breath while the trunk's markers stand still."""

from __future__ import annotations

import numpy as np

from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.scene import Scene

FREQUENCIES_HZ = tuple(float(f) for f in np.arange(0.12, 0.62, 0.02))


class Breathing(Effect):
    """A moment of mass, kg times m, that swings along the trunk's anterior axis."""

    name = "breathing"
    of_the_lab = False
    remedy = "hold the breath for ten seconds"

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return ("upper_torso",)

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        return (
            Parameter("cosine", "kg m", -1.0, 1.0, 0.05),
            Parameter("sine", "kg m", -1.0, 1.0, 0.05),
            Parameter("frequency", "Hz", 0.1, 0.7, 0.02, FREQUENCIES_HZ),
        )

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        cosine, sine, frequency = values
        pace = 2 * np.pi * frequency
        phase = pace * (scene.times_s - scene.times_s[0])
        moved = cosine * np.cos(phase) + sine * np.sin(phase)
        i = scene.person.skeleton.index(target)
        anterior = scene.motion.rotation[:, i, :, 0]
        displaced = moved[:, None] * anterior
        force = -(pace**2) * displaced
        centre = scene.point(target, scene.centre_of(target)).position_m
        moment = np.cross(centre, force) - np.cross(displaced, scene.model.gravity.linear)
        return np.hstack([force, moment])

    def sentence(self, target: str, values: np.ndarray) -> str:
        return (
            f"{np.hypot(values[0], values[1]):.3f} kg m of the trunk move with the breath, "
            f"{values[2]:.2f} times per second"
        )
