"""What plates truly carry, as far as the simulation knows.

A gain in proportion to the measured force, beside a body in proportion to which the simulated one
grows, makes the difference of both smaller, whatever its cause: plates that read too much and a
body as much too light would pass for the best explanation of any noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bsip_cli.effects.scene import Plate, Scene

_LEAST_N = 50.0  # a trial that weighs less has no shares


def with_simulated_load(scene: Scene, plates: Sequence[Plate]) -> list[Plate]:
    """Plates whose wrenches add up to the simulated one: each is given its share, in the vertical
    force, of what all lack; frames that are not valid stay."""
    wrenches = [np.nan_to_num(plate.wrench) for plate in plates]
    carried = np.sum(wrenches, axis=0)
    missing = np.where(scene.valid[:, None], scene.predicted - carried, 0.0)
    weight = np.maximum(carried[:, 2:3], _LEAST_N)
    return [
        replace(plate, wrench=wrench + wrench[:, 2:3] / weight * missing)
        for plate, wrench in zip(plates, wrenches, strict=True)
    ]
