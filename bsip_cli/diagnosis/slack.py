"""What every lab does a little wrong: too small to name, and not to be taken for something else."""

from __future__ import annotations

import numpy as np

from bsip_cli.diagnosis.candidates import Candidate, candidates_of
from bsip_cli.effects.catalogue import CATALOGUE
from bsip_cli.effects.scene import Scene

SHARE = 0.02  # of the size that labs meet
HORIZONTAL = 0.7  # the same for the gain of horizontal forces
INSTRUMENTS = (
    "sync_offset",
    "clock_drift",
    "plate_translation",
    "plate_rotation",
    "plate_gain",
    "plate_crosstalk",
    "plate_zero",
    "plate_drift",
    "gravity_tilt",
)


def slack(scene: Scene) -> np.ndarray:
    """(N, 6, k) change of the wrench for one standard deviation of each small imperfection."""
    instruments = [effect for effect in CATALOGUE if effect.name in INSTRUMENTS]
    columns = [
        _share(c) * c.signature(scene)
        for effect in instruments
        for c in candidates_of(effect, scene)
    ]
    return np.concatenate(columns, axis=2)


def _share(candidate: Candidate) -> float:
    """Horizontal forces are all motion, so what the motion's amplitude errs by is their gain."""
    horizontal = candidate.target.endswith((" fx", " fy"))
    return HORIZONTAL if candidate.effect.name == "plate_gain" and horizontal else SHARE
