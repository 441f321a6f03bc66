"""A mass that the person wears or carries and the model does not know."""

from __future__ import annotations

from types import MappingProxyType

import numpy as np

from bsip_cli.body.names import in_words
from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.scene import Scene

REACH_M = 0.6
MOMENT_KG_M = 0.05  # a few centimetres: the segment's own frame is known to no less


class AddedMass(Effect):
    """A point mass fixed to a segment.

    Its position enters as first moment about the segment's centre of mass, segment axes, in which
    the wrench is linear but for the small inertia of the mass about that centre, left out here. A
    first moment without a mass within reach of the segment is no explanation.
    """

    name = "added_mass"
    of_the_lab = False
    on_its_segment = True
    looks = "more weight than stated, and forces that go with the acceleration of one segment"
    remedy = "weigh the person as recorded, and record once without the load"
    least_named = MappingProxyType({"mass": 0.2})  # less is what the segment may differ by

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return scene.bodies

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        most = 20.0
        moments = (
            Parameter(
                f"moment_{axis}", "kg m", -REACH_M * most, REACH_M * most, 0.1, known_to=MOMENT_KG_M
            )
            for axis in "xyz"
        )
        return (Parameter("mass", "kg", 0.0, most, 0.5), *moments)

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        return scene.once((self.name, target), lambda: _wrenches(scene, target)) @ values

    def reported(
        self, scene: Scene, target: str, values: np.ndarray
    ) -> tuple[tuple[str, str, float], ...]:
        """Mass and its position in the segment's axes, from the segment's origin.

        No mass counts as one at the segment's centre.
        """
        offset = values[1:] / values[0] if values[0] else np.zeros(3)
        place = scene.centre_of(target) + offset
        positions = (
            (f"position_{axis}", "m", float(x)) for axis, x in zip("xyz", place, strict=True)
        )
        return (("mass", "kg", float(values[0])), *positions)

    def possible(self, scene: Scene, target: str, values: np.ndarray) -> bool:
        within = super().possible(scene, target, values)
        return bool(within and np.linalg.norm(values[1:]) <= REACH_M * values[0])

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        return f"{values[0]:.2f} kg that the model does not know move with the {in_words(target)}"


def _wrenches(scene: Scene, target: str) -> np.ndarray:
    """(N, 6, 4) wrench for 1 kg at the segment's centre of mass, and for a unit of each moment."""
    centre = scene.centre_of(target)
    columns = [scene.point(target, centre).carrying_wrench()]
    for axis in np.eye(3):  # the wrench is quadratic in the place: this is its exact derivative
        ahead, behind = (scene.point(target, centre + x).carrying_wrench() for x in (axis, -axis))
        columns.append(0.5 * (ahead - behind))
    return np.stack(columns, axis=2)
