"""The feet of one who stands push against each other: what plates under each foot feel of it."""

from __future__ import annotations

import numpy as np

from bsip_cli.simulate.people import SIDES
from bsip_cli.simulate.trial import Trial

PUSH = 0.06  # of the less loaded foot's vertical force
LOADED_N = 1.0

Wrenches = dict[str, tuple[np.ndarray, np.ndarray]]


def feet_wrenches(trial: Trial, apart: bool) -> Wrenches:
    """Force and moment (T, 3) of each foot, walkway frame; ``apart``: with the push between them.

    The push acts along the line between the feet's centres of pressure, so that nobody but the
    plates feels it.
    """
    feet = {side: (trial.feet_force_n[side], trial.feet_moment_nm[side]) for side in SIDES}
    if not apart:
        return feet
    centres = {side: _centre_of_pressure(*feet[side]) for side in SIDES}
    one, other = SIDES
    line = centres[other] - centres[one]
    line /= np.maximum(np.linalg.norm(line, axis=1), 1e-9)[:, None]
    load = np.minimum(feet[one][0][:, 1], feet[other][0][:, 1])
    push = PUSH * np.where(load > LOADED_N, load, 0.0)[:, None] * line
    return {
        side: (feet[side][0] + sign * push, feet[side][1] + np.cross(centres[side], sign * push))
        for side, sign in ((one, 1.0), (other, -1.0))
    }


def _centre_of_pressure(force: np.ndarray, moment: np.ndarray) -> np.ndarray:
    """(T, 3) on the floor; Y is up."""
    load = np.where(force[:, 1] > LOADED_N, force[:, 1], np.inf)
    return np.stack([moment[:, 2] / load, np.zeros(len(load)), -moment[:, 0] / load], axis=1)
