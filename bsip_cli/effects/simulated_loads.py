"""Plates that carry what the simulation puts on them.

A gain in proportion to the measured force, beside a body in proportion to which the simulated one
grows, makes the difference of both smaller, whatever its cause: plates that read too much and a
body as much too light would pass for the best explanation of any noise.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bsip_cli.effects.scene import Plate, Scene

_LEAST_N = 50.0  # a trial that weighs less has no shares


def with_simulated_loads(scene: Scene) -> Scene:
    """Plates that share the simulated wrench as they share the measured vertical force; frames that
    are not valid stay."""
    return scene.once("simulated loads", lambda: _computed(scene))


def _computed(scene: Scene) -> Scene:
    wrenches = [np.nan_to_num(plate.wrench) for plate in scene.plates]
    carried = np.sum(wrenches, axis=0)
    missing = np.where(scene.valid[:, None], scene.predicted - carried, 0.0)
    weight = np.maximum(carried[:, 2:3], _LEAST_N)
    plates: list[Plate] = [
        replace(plate, wrench=wrench + wrench[:, 2:3] / weight * missing)
        for plate, wrench in zip(scene.plates, wrenches, strict=True)
    ]
    return replace(scene, plates=tuple(plates), wrench=scene.measured)
