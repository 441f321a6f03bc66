"""Do the plates carry the person whose mass is stated?

The wrench alone cannot tell: free parameters follow the plates.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import norm

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.effects.scene import Scene

NOTICED = 0.02  # part of the mass from which on it is told, if a scale errs less
SURE = 2.5  # standard deviations of a stated mass beyond which it is


def weight_share(scene: Scene) -> float:
    """Mean vertical force beyond the simulated one, part of body weight."""
    apart = (scene.measured - scene.predicted)[scene.valid, 2]
    return float(apart.mean()) / (scene.mass_kg * GRAVITY_M_S2)


def is_noticed(share: float, mass_sd: float) -> bool:
    """Whether the plates read so much more or less (part of the stated mass) than a scale errs by.

    mass_sd : standard deviation of the stated mass, part of it.
    """
    return abs(share) >= max(NOTICED, SURE * mass_sd)


def p_of(share: float, mass_sd: float) -> float:
    """How likely a scale errs by that much."""
    return float(2 * norm.sf(abs(share) / mass_sd))


def agreed_share(scenes: Sequence[Scene], mass_sd: float) -> float | None:
    """What moving trials say of the stated mass, like ``weight_share``; nothing if plates and scale
    agree, or the trials do not agree with each other."""
    apart = np.array([weight_share(one) for one in scenes])
    share = float(np.median(apart))
    agree = np.abs(apart - share).max() <= 0.5 * abs(share)
    return share if agree and is_noticed(share, mass_sd) else None
