"""The ground wrench as plates without error, on the cameras' clock, would have measured it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from bsip_cli.diagnosis.cause import Cause, change_by, delay_by
from bsip_cli.effects.clocks import Delay
from bsip_cli.effects.effect import Effect
from bsip_cli.effects.plates import ALL, PlateRotation, loaded_plates, plate_of
from bsip_cli.effects.scene import Plate, Scene

_ROUNDS = 2  # a clock's rate is wrong by 0.3 % at most: each round leaves as much of the error


def is_of_the_forces(cause: Cause) -> bool:
    """Whether the measured forces are wrong, and can be corrected."""
    return is_fault_of_forces(cause.effect)


def is_fault_of_forces(effect: Effect) -> bool:
    """Of the plates, or of the clock that they have."""
    return effect.of_the_plates or isinstance(effect, Delay)


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
                wrench = wrench - change_by([cause], _alone(scene, plate, cause, loaded))
        if late_s.any():
            wrench, _ = _earlier(wrench, scene.valid, scene.times_s, late_s)
        found[plate.name] = np.where(np.isfinite(plate.wrench).all(axis=1)[:, None], wrench, np.nan)
    return found


def _alone(scene: Scene, plate: Plate, cause: Cause, loaded: Sequence[str]) -> Scene:
    """The scene with one plate; where all turn together, about the middle that they turn about."""
    if isinstance(cause.effect, PlateRotation) and cause.target == ALL:
        middle = np.mean([plate_of(scene, name).centre_m() for name in loaded], axis=0)
        plate = replace(plate, corners_m=plate.corners_m + middle - plate.centre_m())
    return replace(scene, plates=(plate,), wrench=plate.wrench)


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
