"""An object that the person picks up and puts down again."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bsip_cli.body.names import in_words
from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.released_object import KNOWN_TO_KG, carried, hands, seen_between
from bsip_cli.effects.scene import Scene
from bsip_cli.effects.unmeasured_contact import MOST_WINDOWS, WINDOWS_S

STEP_S = 0.5


class ObjectHandled(Effect):
    """A point mass at the hand's centre from picking up to putting down."""

    name = "object_handled"
    of_the_lab = False
    on_its_segment = True
    looks = "the weight rises at one moment and falls at another"
    remedy = "stand still with the object and again without"

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return hands(scene)

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        start, end = float(scene.times_s[0]), float(scene.times_s[-1])
        between = tuple(np.linspace(start, end, 5)[1:4].tolist())
        return (
            Parameter("mass", "kg", 0.0, 20.0, 0.5, known_to=KNOWN_TO_KG),
            Parameter("start", "s", start, end, STEP_S, between[:2]),
            Parameter("end", "s", start, end, STEP_S, between[1:]),
        )

    def scans(self, scene: Scene, target: str) -> Iterator[tuple[float, ...]]:
        """Windows that overlap by half, in the part that is seen."""
        first, last = seen_between(scene)
        for length in WINDOWS_S:
            if length <= last - first and (last - first) / length <= MOST_WINDOWS:
                for at in np.arange(first, last - length + 1e-9, length / 2):
                    yield float(at), float(at) + length

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        mass, start, end = values
        since, until = ((scene.times_s - t) * scene.rate_hz + 0.5 for t in (start, end))
        # Ramps over one frame keep the derivatives with respect to the moments alive.
        held = np.clip(since, 0.0, 1.0) - np.clip(until, 0.0, 1.0)
        return mass * held[:, None] * carried(scene, target)

    def possible(self, scene: Scene, target: str, values: np.ndarray) -> bool:
        """Seen before, with the object, and after it."""
        first, last = seen_between(scene)
        _, start, end = values
        seen = first <= start and start + WINDOWS_S[0] <= end <= last
        return seen and super().possible(scene, target, values)

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        mass, start, end = values
        return (
            f"the {in_words(target)} picks up {mass:.2f} kg at {start:.2f} s and puts it down at "
            f"{end:.2f} s"
        )
