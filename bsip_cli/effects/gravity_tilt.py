"""A lab whose Z axis is not the vertical."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.scene import Scene


class Turned(Effect):
    """Something of the lab is turned against the rest by the angles about x and y (rotation
    vector)."""

    of_the_lab = True

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return ("",)

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        return tuple(Parameter(f"angle_{axis}", "rad", -0.2, 0.2, 0.01) for axis in "xy")

    def reported(
        self, scene: Scene, target: str, values: np.ndarray
    ) -> tuple[tuple[str, str, float], ...]:
        """The angle, and its parts about the lab's axes."""
        parts = super().reported(scene, target, values)
        return (("angle", "rad", float(np.hypot(*values))), *parts)


class GravityTilt(Turned):
    """The lab's axes are turned against the world by the angles about x and y (rotation vector).

    Markers and plates are turned together, so only gravity does not point down the lab's Z.
    """

    name = "gravity_tilt"
    looks = (
        "a constant horizontal force in stance, in proportion to the weight and the same "
        "on all plates; in flight the body falls aside"
    )
    remedy = "hang a plumb line into the lab and measure it with two markers"

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        down = scene.model.gravity.linear
        turned = Rotation.from_rotvec([values[0], values[1], 0.0]).apply(down)
        weight = scene.mass_kg * (down - turned)
        force = np.broadcast_to(weight, (len(scene.times_s), 3))
        return np.hstack([force, np.cross(scene.centre_of_mass_m, force)])

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        return f"the lab's Z axis is {np.degrees(np.hypot(*values)):.2f} degrees off the vertical"
