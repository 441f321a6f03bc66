"""What errors of some markers over a stretch of time do to wrench and residuals."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import ndtr

from bsip_cli.effects.scene import Scene

RISE_S = 0.04  # standard deviation of the ramp that smoothing leaves of a sudden change


def step(times_s: np.ndarray, at_s: float, rise_s: float = RISE_S) -> np.ndarray:
    """(3, N) a smooth step from 0 to 1 and its first two derivatives [1/s, 1/s2]."""
    x = (times_s - at_s) / rise_s
    slope = np.exp(-0.5 * x**2) / np.sqrt(2 * np.pi) / rise_s
    return np.stack([ndtr(x), slope, -x * slope / rise_s])


def wrench_parts(scene: Scene, errors_m: np.ndarray, markers: Sequence[int]) -> np.ndarray:
    """(3, N, 6, k) what s, s' and s'' change of the simulated wrench for marker errors s(t) e(t).

    The pose follows the markers (N, len(markers), 3, k), so the simulation of the pose goes wrong
    by the response to it, and lacks the opposite.
    """
    return -scene.response.parts(scene.pose_response.of(errors_m, markers))


def during(course: np.ndarray, parts: np.ndarray) -> np.ndarray:
    """(N, 6, k) change of the wrench for a course s, s', s'' (3, N)."""
    return np.einsum("dn,dnck->nck", course, parts)
