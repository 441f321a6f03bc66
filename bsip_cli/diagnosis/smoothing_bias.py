"""What the spline's own smoothing can do to the simulated wrench.

A smoothed motion lacks a part of its fast changes. To first order the lack looks like what a
second smoothing would take away: pose minus low-passed pose, for legs, trunk and arms apart and for
several cut-offs.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from scipy.signal import butter, sosfiltfilt

from bsip_cli.effects.scene import Scene

CUTOFFS_HZ = (3.0, 6.0, 10.0)
GROUPS = (
    ("root", "hip", "knee", "ankle"),
    ("waist", "neck"),
    ("sternoclavicular", "shoulder", "elbow", "wrist"),
)


def smoothing_bias(scene: Scene) -> np.ndarray:
    """(N, 6, 9) change of the wrench if each group had lost its motion above each cut-off."""
    lost = [_lost(scene, cutoff) for cutoff in CUTOFFS_HZ]
    parts = [one * _of_group(scene, group) for one in lost for group in GROUPS]
    return scene.response.of(np.stack(parts, axis=-1))


def _lost(scene: Scene, cutoff_hz: float) -> np.ndarray:
    """(N, nv) pose minus its low-passed self, in the tangent space."""
    corner = min(cutoff_hz, 0.45 * scene.rate_hz)
    sections = butter(2, corner, fs=scene.rate_hz, output="sos")
    slow = sosfiltfilt(sections, scene.q, axis=0)
    return np.array(
        [
            pin.difference(scene.model, pin.normalize(scene.model, s), q)
            for s, q in zip(slow, scene.q, strict=True)
        ]
    )


def _of_group(scene: Scene, group: tuple[str, ...]) -> np.ndarray:
    """(nv,) 1 for the velocities of the group's joints."""
    skeleton = scene.person.skeleton
    return np.array([float(name.startswith(group)) for name in skeleton.v_names])
