"""A mass that the person wears or carries and the model does not know."""

from __future__ import annotations

import numpy as np

from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.scene import Scene

REACH_M = 0.6


class AddedMass(Effect):
    """A point mass fixed to a segment.

    Its position enters as first moment, in which the wrench is linear; a first moment without a
    mass within reach of the segment is no explanation.
    """

    name = "added_mass"
    of_the_lab = False
    remedy = "weigh the person as recorded, and record once without the load"

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return scene.person.skeleton.segments

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        most = 20.0
        moments = (
            Parameter(f"moment_{axis}", "kg m", -REACH_M * most, REACH_M * most, 0.1)
            for axis in "xyz"
        )
        return (Parameter("mass", "kg", 0.0, most, 0.5), *moments)

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        centre = scene.centre_of(target)
        here = scene.point(target, centre).carrying_wrench()
        total = values[0] * here
        for axis, moment in zip(np.eye(3), values[1:], strict=True):
            total += moment * (scene.point(target, centre + axis).carrying_wrench() - here)
        return total

    def possible(self, scene: Scene, target: str, values: np.ndarray) -> bool:
        return values[0] > 0 and bool(np.linalg.norm(values[1:]) <= REACH_M * values[0])

    def sentence(self, target: str, values: np.ndarray) -> str:
        return f"{values[0]:.2f} kg more than the model knows move with the {words(target)}"
