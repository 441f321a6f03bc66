"""A cause that the diagnosis keeps, with its sizes from all data and from each fold's others."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from bsip_cli.effects.effect import Effect
from bsip_cli.effects.plates import (
    ALL,
    Delay,
    PlateRotation,
    corrected,
    loaded_plates,
    plates_of,
    right_times_s,
)
from bsip_cli.effects.scene import Scene
from bsip_cli.statistics.methods import OM


@dataclass(frozen=True, eq=False)
class Cause:
    """An effect at a place, in some trials.

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


def change_by(causes: Iterable[Cause], scene: Scene) -> np.ndarray:
    """(N, 6) what causes add to the simulated wrench, about the world's origin [N, N m].

    Their changes add up, but for delays. Several are one delay: two opposite ones that were added
    would sharpen the forces, and so make up for what a smoothed motion lacks. And what the plates
    do wrong comes as late as their forces do.
    """
    causes = tuple(causes)
    late_s = delay_by(causes, scene)
    of_the_plates, others = np.zeros((2, len(scene.times_s), 6))
    for one in causes:
        if not isinstance(one.effect, Delay):
            mine = of_the_plates if one.effect.of_the_plates else others
            mine += one.effect.change(scene, one.target, one.values)
    if not late_s.any():
        return of_the_plates + others
    if of_the_plates.any():
        of_the_plates = CubicSpline(scene.times_s, of_the_plates)(right_times_s(scene, late_s))
    return of_the_plates + others + corrected(scene, late_s)


def delay_by(causes: Iterable[Cause], scene: Scene) -> np.ndarray:
    """(N,) how late causes make the forces of each frame, all delays together [s]."""
    late_s = np.zeros(len(scene.times_s))
    for one in causes:
        if isinstance(one.effect, Delay):
            late_s = late_s + one.effect.late_s(scene, one.values)
    return late_s


def unseen_change_by(causes: Sequence[Cause], scene: Scene, fold: np.ndarray) -> np.ndarray:
    """(N, 6) the same, every frame with the sizes that its fold (N,) did not help to find."""
    change = np.empty((len(fold), 6))
    for number in np.unique(fold):
        unseen = [replace(one, values=one.folds[number]) for one in causes]
        frames = fold == number
        change[frames] = change_by(unseen, scene)[frames]
    return change


def method_of(causes: Iterable[Cause]) -> str:
    """``OM+sync_offset+breathing``: the identified model, extended by these."""
    return "+".join([OM, *(cause.effect.name for cause in causes)])


@dataclass(frozen=True)
class Blocks:
    """The intervals of a trial that the diagnosis held out together.

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


# --- the ground wrench as plates without error, on the cameras' clock, would have measured it -----

_ROUNDS = 2  # a clock's rate is wrong by 0.3 % at most: each round leaves as much of the error


def corrected_wrench(
    scene: Scene, measured: np.ndarray, causes: Sequence[Cause]
) -> tuple[np.ndarray, np.ndarray]:
    """(N, 6) wrench about the world's origin, and (N,) frames in which it is valid.

    What the plates add is taken off first, as they recorded it; then the forces are moved to the
    frames to which they belong.
    """
    wrench, valid = measured.copy(), scene.valid.copy()
    wrench -= change_by([cause for cause in causes if cause.effect.of_the_plates], scene)
    late_s = delay_by(causes, scene)
    if late_s.any():
        wrench, valid = _earlier(wrench, valid, scene.times_s, late_s)
    return wrench, valid


def corrected_plates(scene: Scene, causes: Sequence[Cause]) -> dict[str, np.ndarray]:
    """By plate, (N, 6) its wrench about the world's origin without the causes that concern it; NaN
    where it has none."""
    late_s, loaded = delay_by(causes, scene), loaded_plates(scene)
    found = {}
    for plate in scene.plates:
        names = {plate.name, ALL} if plate.name in loaded else {plate.name}
        wrench = np.nan_to_num(plate.wrench)
        for cause in causes:
            if cause.effect.of_the_plates and cause.target.split(" ")[0] in names:
                one = plate
                if isinstance(cause.effect, PlateRotation) and cause.target == ALL:
                    middle = np.mean([p.centre_m() for p in plates_of(scene, ALL)], axis=0)
                    one = replace(plate, corners_m=plate.corners_m + middle - plate.centre_m())
                alone = replace(scene, plates=(one,), wrench=plate.wrench)
                wrench = wrench - change_by([cause], alone)
        if late_s.any():
            wrench, _ = _earlier(wrench, scene.valid, scene.times_s, late_s)
        found[plate.name] = np.where(np.isfinite(plate.wrench).all(axis=1)[:, None], wrench, np.nan)
    return found


def _earlier(
    wrench: np.ndarray, valid: np.ndarray, times_s: np.ndarray, late_s: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """What belongs to each frame but was recorded late; valid where its four neighbours are.

    late_s : (N,) how late each frame was recorded, so a frame's forces are where t - late = frame.
    """
    at = times_s + late_s
    for _ in range(_ROUNDS):
        at = times_s + np.interp(at, times_s, late_s)
    inside = np.clip(at, times_s[0], times_s[-1])
    moved = CubicSpline(times_s, np.nan_to_num(wrench))(inside)
    next_ = np.clip(np.searchsorted(times_s, inside), 1, len(times_s) - 1)
    around = np.clip(next_[:, None] + np.arange(-2, 2), 0, len(times_s) - 1)
    return moved, valid[around].all(axis=1) & (at == inside)
