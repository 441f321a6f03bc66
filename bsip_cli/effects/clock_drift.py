"""The plates' clock runs at another rate than the cameras'."""

from __future__ import annotations

import numpy as np

from bsip_cli.effects.delayed import Delay
from bsip_cli.effects.effect import Parameter
from bsip_cli.effects.scene import Scene

# Quartz keeps 100 ppm and 59.94 for 60 Hz is 1,000: clocks further apart are not two clocks.
MOST = 0.003


class ClockDrift(Delay):
    """The delay is zero where the trial begins and grows evenly."""

    name = "clock_drift"
    of_the_lab = True
    looks = "a delay that grows through the trial: in step at its beginning, late at its end"
    remedy = "hop at the beginning and at the end of a long recording"

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        return (Parameter("rate_error", "1", -MOST, MOST, 3e-4),)

    def late_s(self, scene: Scene, values: np.ndarray) -> np.ndarray:
        return values[0] * (scene.times_s - scene.times_s[0])

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        order = "slower" if values[0] > 0 else "faster"
        return f"the plates' clock runs {1e6 * abs(values[0]):.0f} ppm {order} than the cameras'"
