"""A person heavier or lighter than is stated, every segment alike."""

from __future__ import annotations

import numpy as np

from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.scene import Scene

_TYPICAL = 0.01  # part of the mass that scales, clothes and a week make


class StatedMass(Effect):
    """What a laboratory's plates must not be blamed for. No part of the catalogue: within one
    person it cannot be told from a gain of all plates."""

    name = "stated_mass"
    of_the_lab = False
    of_the_person = True
    remedy = "weigh the person as recorded"
    parameter = Parameter("share", "1", -0.5, 1.0, _TYPICAL)

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return ("",)

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        return (self.parameter,)

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        return values[0] * scene.predicted

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        order = "more" if values[0] > 0 else "less"
        return f"the person weighs {100 * abs(values[0]):.1f} % {order} than is stated"
