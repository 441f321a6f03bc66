"""A force on the body that no plate measures, the same throughout: a harness, a rail, a support."""

from __future__ import annotations

import numpy as np

from bsip_cli.body.names import in_words
from bsip_cli.dynamics.regressor import skew
from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.scene import Scene


class ExternalForce(Effect):
    """A constant force on a segment's centre of mass, world axes; the plates carry as much less."""

    name = "external_force"
    of_the_lab = False
    of_the_person = True
    while_moving = True
    on_its_segment = True
    looks = "the plates lack, or have too much of, one constant force through the whole trial"
    remedy = "record once without anything that holds or touches the person"

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return scene.bodies

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        return tuple(Parameter(f"force_{axis}", "N", -800.0, 800.0, 40.0) for axis in "xyz")

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        return self.tangent(scene, target, values) @ values

    def tangent(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """The change is linear in the force."""
        return missing_wrenches(scene, target)

    def reported(
        self, scene: Scene, target: str, values: np.ndarray
    ) -> tuple[tuple[str, str, float], ...]:
        """The force, and its parts along the lab's axes."""
        parts = super().reported(scene, target, values)
        return (("force", "N", float(np.linalg.norm(values))), *parts)

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        return (
            f"something beside the plates pushes on the {in_words(target)} throughout with "
            f"{np.linalg.norm(values):.0f} N, {values[2]:+.0f} N of it upwards"
        )


def missing_wrenches(scene: Scene, target: str) -> np.ndarray:
    """(N, 6, 3) what the plates lack for a unit force on a segment's centre of mass."""
    return scene.once(("missing wrenches", target), lambda: _missing_wrenches(scene, target))


def _missing_wrenches(scene: Scene, target: str) -> np.ndarray:
    point = scene.point(target, scene.centre_of(target)).position_m
    forces = np.broadcast_to(np.eye(3), (len(point), 3, 3))
    return -np.concatenate([forces, skew(point)], axis=1)
