"""Regularities of no known cause: if one of them explains more than the catalogue does, then
something is wrong that has no name here.

Each is an effect like any other, so that they compete; what they go along with is said.
"""

from __future__ import annotations

from abc import abstractmethod

import numpy as np

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.plate_frame import CHANNELS
from bsip_cli.effects.scene import Scene

UNEXPLAINED = "unexplained"
_SIZE_N, _SIZE_NM = 40.0, 20.0


class Pattern(Effect):
    """A course that the residual may follow, linear in its size."""

    name = UNEXPLAINED
    of_the_lab = True
    remedy = "look at plates, cables and everything that touches the person, and record again"

    @abstractmethod
    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        """With what, for a sentence."""

    def sentence(self, target: str, values: np.ndarray) -> str:
        along = self.goes_along_with(target, values)
        return f"something is wrong that has no name here; it goes along with {along}"


class Tone(Pattern):
    """One component that swings at one frequency."""

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return CHANNELS

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        size, unit = (_SIZE_N, "N") if target.startswith("f") else (_SIZE_NM, "N m")
        duration = max(float(np.ptp(scene.times_s)), 2.0)
        slowest, fastest = 2.0 / duration, 0.16 * scene.rate_hz
        count = min(60, int((fastest - slowest) * duration))
        paces = tuple(float(f) for f in np.linspace(slowest, fastest, count))
        return (
            Parameter("cosine", unit, -1e3, 1e3, size),
            Parameter("sine", unit, -1e3, 1e3, size),
            Parameter("frequency", "Hz", 0.5 * slowest, fastest, 0.3 / duration, paces),
        )

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        phase = 2 * np.pi * values[2] * (scene.times_s - scene.times_s[0])
        wave = values[0] * np.cos(phase) + values[1] * np.sin(phase)
        return _in_channel(scene, target, wave)

    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        return f"a swing of {target} at {values[2]:.2f} Hz"


class Curve(Pattern):
    """Forces that are not in proportion: a part that grows with the square of the vertical one, as
    far as that moves; what stays is an offset."""

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return CHANNELS

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        size, unit = (_SIZE_N, "N") if target.startswith("f") else (_SIZE_NM, "N m")
        return (Parameter("curvature", unit, -1e3, 1e3, size),)

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        load = scene.predicted[:, 2] / (scene.mass_kg * GRAVITY_M_S2)
        apart = load - load[scene.valid].mean()
        bend = apart**2 - (apart[scene.valid] ** 2).mean()
        return _in_channel(scene, target, values[0] * bend)

    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        return f"the square of the vertical force, in {target}"


class Play(Pattern):
    """A component that lags behind itself: it errs by its own direction of change."""

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return CHANNELS

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        size, unit = (_SIZE_N, "N") if target.startswith("f") else (_SIZE_NM, "N m")
        return (Parameter("play", unit, -1e3, 1e3, size),)

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        course = scene.predicted[:, CHANNELS.index(target)]
        speed = np.gradient(course) * scene.rate_hz
        typical = np.sqrt(np.mean(speed[scene.valid] ** 2)) if scene.valid.any() else 1.0
        return _in_channel(scene, target, values[0] * np.tanh(2 * speed / max(typical, 1e-9)))

    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        return f"the direction in which {target} changes"


class Spring(Pattern):
    """A force on the pelvis that depends on where the pelvis is: a rope, a rail, an elastic."""

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return tuple(f"{force} by {place}" for force in "xyz" for place in "xyz")

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        return (Parameter("stiffness", "N/m", -1e4, 1e4, 50.0),)

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        force, place = ("xyz".index(letter) for letter in target.split(" by "))
        pelvis = scene.q[:, :3]
        push = np.zeros_like(pelvis)
        push[:, force] = values[0] * (pelvis[:, place] - pelvis[:, place].mean())
        return np.hstack([push, np.cross(pelvis, push)])

    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        force, place = target.split(" by ")
        return f"the pelvis' place along {place}, as a force along {force} that acts there"


PATTERNS: tuple[Pattern, ...] = (Tone(), Curve(), Play(), Spring())


def _in_channel(scene: Scene, channel: str, course: np.ndarray) -> np.ndarray:
    """(N, 6) a course (N,) in one component of the whole wrench, about where the person stands."""
    wrench = np.zeros((len(course), 6))
    wrench[:, CHANNELS.index(channel)] = course
    place = np.append(scene.q[:, :2].mean(axis=0), 0.0)
    wrench[:, 3:] += np.cross(place, wrench[:, :3])
    return wrench
