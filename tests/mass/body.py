"""A body of points that moves up and down, and the force that its motion needs."""

from __future__ import annotations

import numpy as np

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.recordings.momentum_mass import Interval, intervals_of

RATE_HZ = 100.0
HEIGHTS_M = {
    "lower_torso": 1.0,
    "upper_torso": 1.35,
    "head": 1.65,
    "thigh_l": 0.7,
    "thigh_r": 0.7,
    "shank_l": 0.35,
    "shank_r": 0.35,
}


def markers(rise_m: np.ndarray, ahead_of_shanks_m: float = 0.0) -> dict[str, np.ndarray]:
    """Two markers on each segment, all raised alike, (n, 2, 3)."""
    found = {}
    for name, height in HEIGHTS_M.items():
        points = np.zeros((len(rise_m), 2, 3))
        points[..., 0] = 0.0 if name.startswith("shank") else ahead_of_shanks_m
        points[:, 1, 1] = 0.1
        points[..., 2] = height + rise_m[:, None]
        found[name] = points
    return found


def rise(seconds: float, size_m: float, period_s: float = 1.1) -> tuple[np.ndarray, np.ndarray]:
    """A bounce (n,) and its acceleration [m/s2] (n,)."""
    t = np.arange(round(seconds * RATE_HZ)) / RATE_HZ
    w = 2 * np.pi / period_s
    return size_m * np.cos(w * t), -size_m * w**2 * np.cos(w * t)


def told(
    mass_kg: float,
    seconds: float = 4.0,
    size_m: float = 0.0,
    borne_N: np.ndarray | float = 0.0,
    ahead_m: float = 0.0,
) -> tuple[Interval, ...]:
    """Stretches of a trial in which something else bears ``borne_N``."""
    path, acceleration = rise(seconds, size_m)
    force = mass_kg * (GRAVITY_M_S2 + acceleration) - borne_N
    noise = np.random.default_rng(1).normal(0.0, 1.0, len(force))
    everywhere = np.ones(len(force), bool)
    return intervals_of(markers(path, ahead_m), force + noise, everywhere, RATE_HZ)
