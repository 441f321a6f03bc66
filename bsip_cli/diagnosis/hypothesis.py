"""Hypotheses: a fault of the catalogue at a place, in some trials of a person."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bsip_cli.diagnosis.error_model import Session, TrialErrors
from bsip_cli.effects.effect import Effect, Parameter, Reported, Words
from bsip_cli.effects.nameless import UNEXPLAINED
from bsip_cli.effects.scene import Scene


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """An effect at a target, in some trials, with all of its parameters in the effect's order.

    scene : of the longest of its trials; a number that hangs on the movement is that of this one.
    is_even : of the same size throughout; else it only acts like the effect, and has no name.
    """

    effect: Effect
    target: str
    trials: tuple[int, ...]
    values: np.ndarray
    session: Session
    is_even: bool = True

    @cached_property
    def scene(self) -> Scene:
        scenes = (one.scene for one in self.in_trials)
        return max(scenes, key=lambda scene: scene.times_s[-1] - scene.times_s[0])

    @property
    def in_trials(self) -> list[TrialErrors]:
        return [self.session.trials[t] for t in self.trials]

    @property
    def name(self) -> str:
        """Of what is printed."""
        return self.effect.name if self.is_even else UNEXPLAINED

    @property
    def key(self) -> tuple[str, str]:
        """What and where, whatever the size and the trials."""
        return self.name, self.target

    @property
    def scope(self) -> str:
        return self.effect.scope if self.is_even else "trial"

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        return self.effect.parameters(self.scene, self.target)

    @cached_property
    def is_free(self) -> np.ndarray:
        """(K,) True for the parameters without a scan."""
        return np.array([not p.scan for p in self.parameters])

    @cached_property
    def typical(self) -> np.ndarray:
        """(K,) sizes that laboratories meet, of all parameters."""
        return np.array([p.typical for p in self.parameters])

    def with_values(self, values: np.ndarray) -> Hypothesis:
        """With other values (K,), cut to the bounds."""
        bounds = np.array([(p.least, p.most) for p in self.parameters])
        return replace(self, values=np.clip(values, *bounds.T))

    def moved(self, step: np.ndarray) -> Hypothesis:
        """With the free parameters changed by ``step`` (k,) typical sizes, within the bounds."""
        values = self.values.copy()
        values[self.is_free] += step * self.typical[self.is_free]
        return self.with_values(values)

    def is_possible(self) -> bool:
        """Whether it can be true of a body or a lab, and the markers allow it, in all trials."""
        return all(
            self.effect.possible(one.scene, self.target, self.values)
            and self.effect.agrees(one.scene, self.target, self.values)
            for one in self.in_trials
        )

    def change(self, scene: Scene) -> np.ndarray:
        """(N, 6) what it adds to the simulated wrench of a trial."""
        return self.effect.change(scene, self.target, self.values)

    def filtered_change(self, trial: TrialErrors) -> np.ndarray:
        """(n, 6) of what is filtered of a trial."""
        return trial.filter.one(self.change(trial.simulated))

    def reported(self) -> Reported:
        """Name, unit and value of what the diagnosis prints."""
        return self.effect.reported(self.scene, self.target, self.values)

    def words(self) -> Words:
        """What a person should read, without interval."""
        words = self.effect.words(self.scene, self.target, self.values)
        if self.is_even:
            return words
        return replace(words, what=f"of unknown cause: {words.what}, but not evenly", short="")

    def alike(self) -> list[Hypothesis]:
        """Those that these recordings cannot distinguish from it, the plainest first."""
        if not self.is_even:
            return [self]
        values = self.effect.alike(self.scene, self.target, self.values)
        return [replace(self, values=one) for one in values]
