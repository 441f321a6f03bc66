"""The chest that moves with every breath while the model's trunk stands still."""

from __future__ import annotations

import numpy as np

from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.scene import Scene

SLOWEST_HZ, FASTEST_HZ = 0.12, 0.6
# The breastbone moves ahead and up; torso axes.
OUTWARD = np.array([0.8, 0.6, 0.0])
LEAST_BREATHS = 3
# A quarter of it is not told: as much is where the markers of the chest breathe and no mass does.
TYPICAL_KG_M = 0.3
PACE_HZ = 3e-4  # to which a pace is known: nobody breathes like a clock


class Breathing(Effect):
    """Moved mass times amplitude, a sine ahead and up in the upper torso."""

    name = "breathing"
    of_the_lab = False
    on_its_segment = True
    looks = "a slow swing of the vertical force in quiet parts, at the pace of breathing"
    remedy = "hold the breath for ten seconds"

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return ("upper_torso",) if _slowest_hz(scene) < FASTEST_HZ else ()

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        apart = 0.5 / max(float(np.ptp(scene.times_s)), 1.0)
        paces = tuple(float(f) for f in np.arange(_slowest_hz(scene), FASTEST_HZ, apart))
        return (
            Parameter("cosine", "kg m", -1.0, 1.0, TYPICAL_KG_M),
            Parameter("sine", "kg m", -1.0, 1.0, TYPICAL_KG_M),
            Parameter("frequency", "Hz", _slowest_hz(scene), 0.7, apart, paces, known_to=PACE_HZ),
        )

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        cosine, sine, frequency = values
        pace = 2 * np.pi * frequency
        phase = pace * (scene.times_s - scene.times_s[0])
        moved = cosine * np.cos(phase) + sine * np.sin(phase)
        speed = pace * (sine * np.cos(phase) - cosine * np.sin(phase))
        i, motion = scene.person.skeleton.index(target), scene.motion
        out = motion.rotation[:, i] @ OUTWARD
        w, dw = motion.turning_rad_s[:, i], motion.turning_acceleration_rad_s2[:, i]
        force = (
            -(pace**2) * moved[:, None] * out
            + 2 * speed[:, None] * np.cross(w, out)
            + moved[:, None] * (np.cross(dw, out) + np.cross(w, np.cross(w, out)))
        )
        centre = scene.point(target, scene.centre_of(target))
        carried = centre.acceleration_m_s2 - scene.model.gravity.linear
        moment = np.cross(centre.position_m, force) + np.cross(moved[:, None] * out, carried)
        return np.hstack([force, moment])

    def reported(
        self, scene: Scene, target: str, values: np.ndarray
    ) -> tuple[tuple[str, str, float], ...]:
        return (
            ("amplitude", "kg m", float(np.hypot(values[0], values[1]))),
            ("frequency", "Hz", float(values[2])),
        )

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        return (
            f"breathing moves the trunk {values[2]:.2f} times per second (mass times amplitude "
            f"{np.hypot(values[0], values[1]):.3f} kg m)"
        )


def _slowest_hz(scene: Scene) -> float:
    """A few breaths are needed to tell them from any other slow course."""
    return max(SLOWEST_HZ, LEAST_BREATHS / max(float(np.ptp(scene.times_s)), 1.0))
