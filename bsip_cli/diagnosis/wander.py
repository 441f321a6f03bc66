"""Where the body is: slow wandering of the skin moves the whole model to and fro over the plates.

It goes along with no joint, and is too slow to be noise of which a trial has many cycles.
"""

from __future__ import annotations

import numpy as np

from bsip_cli.effects.scene import Scene

WANDER_M = 0.001  # standard deviation of the centre of mass, in each horizontal direction
SLOWER_HZ = 0.3


def wander(scene: Scene) -> np.ndarray:
    """(N, 6, 2 k) changes of the wrench if the body stood elsewhere, of unit variance together."""
    length_s = scene.times_s[-1] - scene.times_s[0]
    halves = np.arange(1, max(1, int(2 * length_s * SLOWER_HZ)) + 1)  # periods, two of them one
    course = np.cos(np.pi * np.outer(scene.times_s - scene.times_s[0], halves) / length_s)
    course *= WANDER_M * np.sqrt(2 / len(halves))
    force = np.nan_to_num(scene.predicted[:, :3])
    columns = np.zeros((len(course), 6, 2, len(halves)))
    for axis in range(2):
        columns[:, 3:, axis] = np.cross(np.eye(3)[axis], force)[..., None] * course[:, None]
    return columns.reshape(len(course), 6, -1)
