"""A clock that jumps within a trial."""

from __future__ import annotations

import numpy as np

from bsip_cli.diagnosis.pattern import Pattern
from bsip_cli.effects.clocks import Delay
from bsip_cli.effects.effect import Parameter
from bsip_cli.effects.scene import Scene

LEAST_S = 1.0
UNSEEN_S = 0.1  # as good as nothing
_APART_S, _MOST = 0.5, 40


class ClockJump(Delay, Pattern):
    """From a moment on the forces come later than before: frames or samples were lost."""

    of_the_lab = False  # the moment is another one in every trial

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        first, last = float(scene.times_s[0]), float(scene.times_s[-1])
        apart = max(_APART_S, (last - first) / _MOST)
        moments = tuple(float(t) for t in np.arange(first + _APART_S, last - _APART_S, apart))
        return (
            Parameter("jump", "s", -0.5, 0.5, 0.01),
            Parameter("from_time", "s", first, last, apart, moments or (0.5 * (first + last),)),
        )

    def late_s(self, scene: Scene, values: np.ndarray) -> np.ndarray:
        return values[0] * (scene.times_s >= values[1])

    def possible(self, scene: Scene, target: str, values: np.ndarray) -> bool:
        """Before and after it is seen what the forces are late by, else it is a delay; or nothing
        of the time before is seen, since the person was not yet on a plate."""
        later = scene.times_s >= values[1]
        least = LEAST_S * scene.rate_hz
        before, after = ((scene.valid & side).sum() for side in (~later, later))
        unseen = before <= UNSEEN_S * scene.rate_hz and (~later).sum() >= least
        seen = min(before, after) >= least or (unseen and after >= least)
        return super().possible(scene, target, values) and bool(seen)

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        return f"without a known cause, {self.goes_along_with(target, values)}"

    def goes_along_with(self, target: str, values: np.ndarray) -> str:
        order = "later" if values[0] > 0 else "earlier"
        size = f"{1000 * abs(values[0]):.0f} ms {order}"
        return f"from {values[1]:.2f} s on the forces come {size}, as if frames were lost"
