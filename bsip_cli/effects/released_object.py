"""An object that the person holds at first and lets go."""

from __future__ import annotations

import numpy as np

from bsip_cli.body.names import in_words
from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.scene import Scene

STEP_S = 0.5
# On either side of the release it is seen for a second, or for a part of what is measured, if less.
SEEN_S, SEEN_PART = 1.0, 0.25
KNOWN_TO_KG = 0.03  # the arm that is relieved springs back, faster than smoothed markers follow


class ReleasedObject(Effect):
    """A point mass at the hand's centre until the moment of release."""

    name = "released_object"
    of_the_lab = False
    on_its_segment = True
    looks = "the weight falls at one moment, and until then forces go with a hand that speeds up"
    remedy = "stand still with the object and again without"

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return hands(scene)

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        start, end = scene.times_s[0], scene.times_s[-1]
        first, last = seen_between(scene)
        number = int(np.ceil((last - first) / STEP_S)) + 1
        moments = tuple(np.linspace(first, last, number).tolist())
        return (
            Parameter("mass", "kg", 0.0, 20.0, 0.5, known_to=KNOWN_TO_KG),
            Parameter("release_time", "s", float(start), float(end), STEP_S, moments),
        )

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        mass, release = values
        # A ramp over one frame keeps the derivative with respect to the moment alive.
        held = np.clip((release - scene.times_s) * scene.rate_hz + 0.5, 0.0, 1.0)
        return mass * held[:, None] * carried(scene, target)

    def possible(self, scene: Scene, target: str, values: np.ndarray) -> bool:
        """Seen with the object and without it."""
        first, last = seen_between(scene)
        return super().possible(scene, target, values) and first <= values[1] <= last

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        return f"the {in_words(target)} holds {values[0]:.2f} kg and lets go at {values[1]:.2f} s"


def hands(scene: Scene) -> tuple[str, ...]:
    """What may hold something."""
    return tuple(s for s in scene.person.skeleton.segments if s.startswith("hand"))


def seen_between(scene: Scene) -> tuple[float, float]:
    """First and last moment of a release that is seen from both sides [s]."""
    return scene.once("seen from both sides", lambda: _seen_between(scene))


def _seen_between(scene: Scene) -> tuple[float, float]:
    times = scene.times_s[scene.valid]
    if not len(times):
        return float(scene.times_s[0]), float(scene.times_s[-1])
    seen = max(1, round(min(SEEN_S * scene.rate_hz, SEEN_PART * len(times))))
    return float(times[seen - 1]), float(times[-seen])


def carried(scene: Scene, target: str) -> np.ndarray:
    """(N, 6) ground wrench of 1 kg at the segment's centre of mass."""
    point = scene.centre_of(target)
    return scene.once(("carried", target), lambda: scene.point(target, point).carrying_wrench())
