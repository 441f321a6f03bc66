"""Clocks of cameras and plates that do not agree; and what several effects change together."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable

import numpy as np
from scipy.interpolate import CubicSpline

from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.scene import Scene

Sized = tuple[Effect, str, np.ndarray]  # effect, target, values
KNOWN_TO_S = 0.0002  # filters of plates and cameras delay a little too
# Quartz keeps 100 ppm and 59.94 for 60 Hz is 1,000: clocks further apart are not two clocks.
MOST_DRIFT = 0.003


class Delay(Effect):
    """The forces come late against the markers."""

    is_of_laboratory = True

    @abstractmethod
    def late_s(self, scene: Scene, values: np.ndarray) -> np.ndarray:
        """(N,) how late the forces of each frame were recorded [s]."""

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        return corrected(scene, self.late_s(scene, values))


class SyncOffset(Delay):
    """The forces come late against the markers."""

    name = "sync_offset"
    numbers = (Parameter("delay", "s", -0.5, 0.5, 0.01, known_to=KNOWN_TO_S),)
    looks = (
        "every rise of the simulated force leads or follows the measured one by the same "
        "time; the error is largest where the force changes fastest"
    )
    remedy = "hop three times in view of cameras and plates"

    def late_s(self, scene: Scene, values: np.ndarray) -> np.ndarray:
        return np.full(len(scene.times_s), values[0])

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        order = "after" if values[0] > 0 else "before"
        return f"the forces were recorded {1000 * abs(values[0]):.1f} ms {order} the markers"


class ClockDrift(Delay):
    """The plates' clock runs at another rate than the cameras'.

    The delay is zero where the trial begins and grows evenly.
    """

    name = "clock_drift"
    numbers = (Parameter("rate_error", "1", -MOST_DRIFT, MOST_DRIFT, 3e-4),)
    looks = "a delay that grows through the trial: in step at its beginning, late at its end"
    remedy = "hop at the beginning and at the end of a long recording"

    def late_s(self, scene: Scene, values: np.ndarray) -> np.ndarray:
        return values[0] * (scene.times_s - scene.times_s[0])

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        order = "slower" if values[0] > 0 else "faster"
        return f"the plates' clock runs {1e6 * abs(values[0]):.0f} ppm {order} than the cameras'"


def corrected(scene: Scene, late_s: np.ndarray) -> np.ndarray:
    """(N, 6) the measured wrench less the same corrected by (N,) seconds; the trial's ends stay.

    From the measured signal: the simulated one holds the noise of the motion, whose derivative
    would make every delay seem smaller than it is.
    """
    return scene.measured - scene.measured_signal(right_times_s(scene, late_s))


def right_times_s(scene: Scene, late_s: np.ndarray) -> np.ndarray:
    """(N,) when the forces that belong to each frame were recorded, inside the trial."""
    return np.clip(scene.times_s + late_s, scene.times_s[0], scene.times_s[-1])


def joint_change(scene: Scene, effects: Iterable[Sized]) -> np.ndarray:
    """(N, 6) what they add to the simulated wrench, about the world's origin [N, N m].

    Their changes add up, but for delays. Several are one delay: two opposite ones that were added
    would sharpen the forces, and so make up for what a smoothed motion lacks. And what the plates
    do wrong comes as late as their forces do.
    """
    effects = tuple(effects)
    late_s = joint_delay_s(scene, effects)
    of_the_plates, others = np.zeros((2, len(scene.times_s), 6))
    for effect, target, values in effects:
        if not isinstance(effect, Delay):
            mine = of_the_plates if effect.of_the_plates else others
            mine += effect.change(scene, target, values)
    if not late_s.any():
        return of_the_plates + others
    if of_the_plates.any():
        of_the_plates = CubicSpline(scene.times_s, of_the_plates)(right_times_s(scene, late_s))
    return of_the_plates + others + corrected(scene, late_s)


def joint_delay_s(scene: Scene, effects: Iterable[Sized]) -> np.ndarray:
    """(N,) how late the forces of each frame were recorded, by all delays among the effects [s]."""
    delays = (one.late_s(scene, values) for one, _, values in effects if isinstance(one, Delay))
    return sum(delays, np.zeros(len(scene.times_s)))
