"""Masses that truly move elsewhere than the model has them, turned as the model has them."""

from __future__ import annotations

import numpy as np

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.dynamics.segment_motion import UP, Point


def displaced(mass_kg: float, centre: Point, shift_m: np.ndarray, rate_hz: float) -> np.ndarray:
    """(N, 6, k) what the wrench about the world's origin gains when a mass is shifted.

    centre : the mass' own, as the model moves it. shift_m : (N, 3, k) small, world axes.
    """
    speed = np.gradient(shift_m, 1 / rate_hz, axis=0)
    force = mass_kg * np.gradient(speed, 1 / rate_hz, axis=0)
    carried = mass_kg * (centre.acceleration_m_s2 + GRAVITY_M_S2 * UP)
    moment = np.cross(centre.position_m[..., None], force, axis=1)
    moment += np.cross(shift_m, carried[..., None], axis=1)
    return np.concatenate([force, moment], axis=1)
