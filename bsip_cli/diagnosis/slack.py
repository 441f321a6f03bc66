"""What every lab and every smoothing does a little wrong: too small to name, and not to be taken
for something else."""

from __future__ import annotations

import numpy as np

from bsip_cli.diagnosis.candidates import Candidate, candidates_of
from bsip_cli.effects.catalogue import CATALOGUE, EFFECTS
from bsip_cli.effects.delayed import Delay
from bsip_cli.effects.effect import Effect
from bsip_cli.effects.gravity_tilt import GravityTilt
from bsip_cli.effects.scene import Scene

SHARE = 0.02  # of the size that labs meet
HORIZONTAL = 0.7  # the same for the gain of horizontal forces
# The spline of `ik` takes as much as a low-pass at this cut-off, with a softer edge.
SPLINE_HZ, EDGE = 11.0, 3


def slack(scene: Scene) -> np.ndarray:
    """(N, 6, k) change of the wrench for one standard deviation of each small imperfection."""
    instruments = [effect for effect in CATALOGUE if _is_of_instruments(effect)]
    columns = [
        _share(c) * c.signature(scene)
        for effect in (*instruments, EFFECTS["over_smoothing"])
        for c in candidates_of(effect, scene)
    ]
    return np.concatenate(columns, axis=2)


def _is_of_instruments(effect: Effect) -> bool:
    return effect.of_the_plates or isinstance(effect, (Delay, GravityTilt))


def _share(candidate: Candidate) -> float:
    """Horizontal forces are all motion, so what the motion's amplitude errs by is their gain."""
    if candidate.effect.name == "over_smoothing":
        return (candidate.scanned[0] / SPLINE_HZ) ** EDGE
    horizontal = candidate.target.endswith((" fx", " fy"))
    return HORIZONTAL if candidate.effect.name == "plate_gain" and horizontal else SHARE
