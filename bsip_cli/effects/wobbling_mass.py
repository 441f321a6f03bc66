"""A part of a segment's mass that swings against the bone."""

from __future__ import annotations

import numpy as np
from scipy.signal import cont2discrete, lfilter

from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.scene import Scene

FREQUENCIES_HZ = (3.0, 4.0, 5.0, 6.5, 8.0, 10.0)
DAMPING = (0.1, 0.2, 0.4)


class WobblingMass(Effect):
    """A mass on a spring and a damper at the segment's centre of mass, free in all directions."""

    name = "wobbling_mass"
    of_the_lab = False
    remedy = "hop three times, or drop on the heels"

    def targets(self, scene: Scene) -> tuple[str, ...]:
        soft = ("lower_torso", "upper_torso", "thigh", "shank")
        return tuple(s for s in scene.person.skeleton.segments if s.startswith(soft))

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        i = scene.person.skeleton.index(target)
        most = max(0.8 * float(scene.phi[10 * i]), 0.1)
        return (
            Parameter("mass", "kg", 0.0, most, 1.0),
            Parameter("frequency", "Hz", 2.0, 20.0, 1.0, FREQUENCIES_HZ),
            Parameter("damping_ratio", "1", 0.02, 1.0, 0.1, DAMPING),
        )

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        mass, frequency, damping = values
        point = scene.point(target, scene.centre_of(target))
        swing = _relative_acceleration(
            point.acceleration_m_s2, scene.rate_hz, 2 * np.pi * frequency, damping
        )
        force = mass * swing
        return np.hstack([force, np.cross(point.position_m, force)])

    def sentence(self, target: str, values: np.ndarray) -> str:
        return (
            f"{values[0]:.1f} kg of the {target} swing against the bone at {values[1]:.1f} Hz "
            f"(damping ratio {values[2]:.2f})"
        )


def _relative_acceleration(
    ground: np.ndarray, rate_hz: float, pace_rad_s: float, damping: float
) -> np.ndarray:
    """(N, 3) acceleration of the mass against its segment, at rest when the trial begins.

    x'' = -2 damping pace x' - pace^2 x - ground, by the exact discretisation between samples.
    """
    system = (
        np.array([[0.0, 1.0], [-(pace_rad_s**2), -2 * damping * pace_rad_s]]),
        np.array([[0.0], [-1.0]]),
        np.array([[-(pace_rad_s**2), -2 * damping * pace_rad_s]]),
        np.array([[-1.0]]),
    )
    A, B, C, D, _ = cont2discrete(system, 1 / rate_hz, method="foh")
    trace, determinant = float(np.trace(A)), float(np.linalg.det(A))
    # The same as a difference equation: characteristic polynomial and the first three responses.
    response = [float(D[0, 0]), float((C @ B)[0, 0]), float((C @ A @ B)[0, 0])]
    recursion = np.array([1.0, -trace, determinant])
    numerator = np.convolve(recursion, response)[:3]
    return lfilter(numerator, recursion, ground - ground[0], axis=0)

