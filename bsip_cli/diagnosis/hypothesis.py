"""Hypotheses: a fault of the catalogue at a place, in some trials of a person."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from bsip_cli.effects.effect import Effect, Parameter, Words
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


class _Trial(Protocol):
    @property
    def scene(self) -> Scene: ...


class Trials(Protocol):
    """Whatever holds the scenes of a person's trials."""

    @property
    def trials(self) -> Sequence[_Trial]: ...


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """An effect at a target, in some trials, with all of its parameters in the effect's order."""

    effect: Effect
    target: str
    trials: tuple[int, ...]
    values: np.ndarray

    @property
    def key(self) -> tuple[str, str]:
        """What and where, whatever the size and the trials."""
        return self.effect.name, self.target

    def scene(self, session: Trials) -> Scene:
        """The longest of its trials: a number that hangs on the movement is that of this one."""
        scenes = (session.trials[t].scene for t in self.trials)
        return max(scenes, key=lambda scene: scene.times_s[-1] - scene.times_s[0])

    def parameters(self, session: Trials) -> tuple[Parameter, ...]:
        return self.effect.parameters(self.scene(session), self.target)

    def is_free(self, session: Trials) -> np.ndarray:
        """(K,) True for the parameters without a scan."""
        return self.effect.is_free(self.scene(session), self.target)

    def typical(self, session: Trials) -> np.ndarray:
        """(K,) sizes that laboratories meet, of all parameters."""
        return np.array([p.typical for p in self.parameters(session)])

    def with_values(self, session: Trials, values: np.ndarray) -> Hypothesis:
        """With other values (K,), cut to the bounds."""
        bounds = np.array([(p.least, p.most) for p in self.parameters(session)])
        return replace(self, values=np.clip(values, *bounds.T))

    def moved(self, session: Trials, step: np.ndarray) -> Hypothesis:
        """With the free parameters changed by ``step`` (k,) typical sizes, within the bounds."""
        values, free = self.values.copy(), self.is_free(session)
        values[free] += step * self.typical(session)[free]
        return self.with_values(session, values)

    def is_possible(self, session: Trials) -> bool:
        """Whether it can be true of a body or a lab, and the markers allow it, in all trials."""
        scenes = [session.trials[t].scene for t in self.trials]
        return all(
            self.effect.possible(scene, self.target, self.values)
            and self.effect.agrees(scene, self.target, self.values)
            for scene in scenes
        )

    def reported(self, session: Trials) -> tuple[tuple[str, str, float], ...]:
        """Name, unit and value of what the diagnosis prints."""
        return self.effect.reported(self.scene(session), self.target, self.values)

    def words(self, session: Trials) -> Words:
        """What a person should read, without interval."""
        return self.effect.words(self.scene(session), self.target, self.values)

    def alike(self, session: Trials) -> list[Hypothesis]:
        """Those that these recordings cannot distinguish from it, the plainest first."""
        values = self.effect.alike(self.scene(session), self.target, self.values)
        return [replace(self, values=one) for one in values]
