"""Every explanation that a diagnosis considers: an effect, where it sits, and in which trials."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.scene import Scene


@dataclass(frozen=True)
class Candidate:
    """An effect at one place; ``scanned`` are the values of its parameters that have a scan."""

    effect: Effect
    target: str
    scanned: tuple[float, ...]

    def values(self, scene: Scene, free: np.ndarray) -> np.ndarray:
        """All parameters in the effect's order, from those without a scan."""
        scanned, rest = iter(self.scanned), iter(free)
        parameters = self.effect.parameters(scene, self.target)
        return np.array([next(scanned) if p.scan else next(rest) for p in parameters])

    def free(self, scene: Scene) -> tuple[Parameter, ...]:
        """The parameters that the data decide linearly."""
        return tuple(p for p in self.effect.parameters(scene, self.target) if not p.scan)

    def signature(self, scene: Scene) -> np.ndarray:
        """(N, 6, k) change of the wrench for the typical size of each free parameter."""
        free = self.free(scene)
        null = self.values(scene, np.zeros(len(free)))
        sizes = np.array([p.typical for p in free])
        return self.effect.tangent(scene, self.target, null) * sizes


def candidates_of(effect: Effect, scene: Scene) -> Iterator[Candidate]:
    """All places and scanned values of an effect in one trial."""
    for target in effect.targets(scene):
        for scanned in effect.scans(scene, target):
            yield Candidate(effect, target, scanned)
