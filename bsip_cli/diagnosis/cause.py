"""A cause that the diagnosis keeps, with its sizes from all data and from each fold's others."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from bsip_cli.effects.clocks import Sized, joint_change, joint_delay_s
from bsip_cli.effects.effect import Effect
from bsip_cli.effects.scene import Scene
from bsip_cli.statistics.methods import OM


@dataclass(frozen=True, eq=False)
class Cause:
    """An effect at a place, in some trials.

    Attributes
    ----------
    trials : stems of the trials that it concerns.
    values : (k,) all parameters, in the effect's order, from all data.
    folds : (f, k) the same; the free parameters estimated without the blocks of each fold, moments,
        windows and frequencies from all data.
    """

    effect: Effect
    target: str
    trials: tuple[str, ...]
    values: np.ndarray
    folds: np.ndarray


def change_by(causes: Sequence[Cause], scene: Scene) -> np.ndarray:
    """(N, 6) what causes add to the simulated wrench, about the world's origin [N, N m]."""
    return joint_change(scene, _sized(causes))


def delay_by(causes: Sequence[Cause], scene: Scene) -> np.ndarray:
    """(N,) how late causes make the forces of each frame [s]."""
    return joint_delay_s(scene, _sized(causes))


def _sized(causes: Sequence[Cause]) -> list[Sized]:
    return [(c.effect, c.target, c.values) for c in causes]


def unseen_change_by(causes: Sequence[Cause], scene: Scene, fold: np.ndarray) -> np.ndarray:
    """(N, 6) the same, every frame with the sizes that its fold (N,) did not help to find."""
    change = np.empty((len(fold), 6))
    for number in np.unique(fold):
        frames = fold == number
        sized = [(c.effect, c.target, c.folds[number]) for c in causes]
        change[frames] = joint_change(scene, sized)[frames]
    return change


def method_of(causes: Iterable[Cause]) -> str:
    """``OM+sync_offset+breathing``: the identified model, extended by these."""
    return "+".join([OM, *(cause.effect.name for cause in causes)])


@dataclass(frozen=True)
class Blocks:
    """The stretches of a trial that the diagnosis held out together.

    first : number of the first, counted through all trials. start_s : where it begins.
    """

    first: int
    start_s: float
    block_s: float
    folds: int

    def of(self, times_s: np.ndarray) -> np.ndarray:
        """(N,) number of the block of each time; what lies before the first belongs to it."""
        later = np.maximum(times_s - self.start_s, 0.0)
        return self.first + (later / self.block_s).astype(int)

    def fold_of(self, times_s: np.ndarray) -> np.ndarray:
        """(N,) fold of each time."""
        return self.of(times_s) % self.folds
