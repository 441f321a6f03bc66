"""The forces come late against the markers."""

from __future__ import annotations

import numpy as np

from bsip_cli.effects.delayed import Delay
from bsip_cli.effects.effect import Parameter
from bsip_cli.effects.scene import Scene

KNOWN_TO_S = 0.0002  # filters of plates and cameras delay a little too


class SyncOffset(Delay):
    name = "sync_offset"
    of_the_lab = True
    looks = (
        "every rise of the simulated force leads or follows the measured one by the same "
        "time; the error is largest where the force changes fastest"
    )
    remedy = "hop three times in view of cameras and plates"

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        return (Parameter("delay", "s", -0.5, 0.5, 0.01, known_to=KNOWN_TO_S),)

    def late_s(self, scene: Scene, values: np.ndarray) -> np.ndarray:
        return np.full(len(scene.times_s), values[0])

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        order = "after" if values[0] > 0 else "before"
        return f"the forces were recorded {1000 * abs(values[0]):.1f} ms {order} the markers"
