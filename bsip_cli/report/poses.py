"""Poses of the model with the measured ground force, in the person's axes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Poses:
    """n poses; positions and forces in the person's axes (anterior, right, up).

    Attributes
    ----------
    time_s : (n,).
    bones_m : (n, b, 2, 3) end points of the bones.
    sides : (b,) ``l``, ``r`` or empty.
    head_m : (n, 3) centre of the head; head_radius_m : its radius.
    markers_m : (n, m, 3) the markers as the model carries them.
    force_m : (n, 3) where the ground force acts; forces_N : (n, 3), NaN where it is not measured.
    ground_m : height of the ground.
    body_weight_N : what an arrow of half a body height stands for.
    """

    time_s: np.ndarray
    bones_m: np.ndarray
    sides: tuple[str, ...]
    head_m: np.ndarray
    head_radius_m: float
    markers_m: np.ndarray
    force_m: np.ndarray
    forces_N: np.ndarray
    ground_m: float
    body_weight_N: float

    def arrow_m_per_newton(self) -> float:
        """One body weight is as long as half the tallest pose."""
        top = float(np.nanmax(self.head_m[:, 2])) + self.head_radius_m - self.ground_m
        return 0.5 * top / self.body_weight_N

    def arrow_tips_m(self) -> np.ndarray:
        """(n, 3) tips of the force arrows."""
        return self.force_m + self.forces_N * self.arrow_m_per_newton()
