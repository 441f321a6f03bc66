"""Markers that were low-passed before they were delivered."""

from __future__ import annotations

import numpy as np
from scipy.signal import butter, sosfiltfilt
from scipy.spatial.transform import Rotation

from bsip_cli.body.skeleton import Skeleton
from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.scene import Scene

CUTOFFS_HZ = (1.0, 1.3, 1.6, 2.0, 2.5, 3.0, 3.7, 4.5, 5.5, 7.0, 9.0)
ROUNDS = 4  # of restoring what a low-pass took; more would restore noise
# Two passes of order two: each cuts at this multiple of where both together pass 1/sqrt(2).
CORNER = (np.sqrt(2.0) - 1.0) ** -0.25


class OverSmoothing(Effect):
    """The markers went through a zero-phase Butterworth of order four, and the pose with them.

    ``share`` is 1 where the cut-off is right. What the markers' residuals show of it is of second
    order and left out.
    """

    name = "over_smoothing"
    of_the_lab = True
    remedy = "export the trial again without the lab's filter"

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return ("",)

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        cutoffs = tuple(f for f in CUTOFFS_HZ if CORNER * f < 0.4 * scene.rate_hz)
        return (
            Parameter("share", "1", 0.0, 2.0, 1.0),
            Parameter("cutoff", "Hz", 0.5, 12.0, 0.5, cutoffs),
        )

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        share, cutoff = values
        lost = scene.once((self.name, float(cutoff)), lambda: _lost_wrench(scene, float(cutoff)))
        return share * lost

    def possible(self, scene: Scene, target: str, values: np.ndarray) -> bool:
        """A share far from 1 belongs to another cut-off."""
        return super().possible(scene, target, values) and bool(values[0] >= 0.3)

    def reported(
        self, scene: Scene, target: str, values: np.ndarray
    ) -> tuple[tuple[str, str, float], ...]:
        return (("cutoff", "Hz", float(effective_cutoff_hz(values))),)

    def sentence(self, target: str, values: np.ndarray) -> str:
        return (
            f"the markers were smoothed at about {effective_cutoff_hz(values):.1f} Hz before they "
            "were delivered"
        )


def effective_cutoff_hz(values: np.ndarray) -> float:
    """Cut-off whose loss is the share: at low frequencies it falls like the fourth power."""
    return float(values[1] * max(values[0], 1e-6) ** -0.25)


def _lost_wrench(scene: Scene, cutoff_hz: float) -> np.ndarray:
    """(N, 6) what the wrench lacks for want of the motion beyond the cut-off."""
    sections = butter(2, CORNER * cutoff_hz, fs=scene.rate_hz, output="sos")
    padding = min(len(scene.q) - 1, round(2 * scene.rate_hz / cutoff_hz))
    left, lost = scene.q, np.zeros_like(scene.q)
    # Van Cittert: (1 - L) + (1 - L)^2 + ... is 1/L - 1, what the low-pass L took.
    for _ in range(ROUNDS):
        left = left - sosfiltfilt(sections, left, axis=0, padlen=padding)
        lost = lost + left
    errors = tangent(scene.person.skeleton, scene.q, lost)
    return scene.response.of(errors[..., None])[..., 0]


def tangent(skeleton: Skeleton, q: np.ndarray, change: np.ndarray) -> np.ndarray:
    """(N, nv) a small change of the entries of q (N, nq) in the tangent space."""
    moved = np.empty((len(q), len(skeleton.v_names)))
    starts = zip(skeleton.q_starts, skeleton.v_starts, skeleton.joint_types, strict=True)
    for at, av, kind in starts:
        if kind == "revolute":
            moved[:, av] = change[:, at]
            continue
        if kind == "free":
            turn = Rotation.from_quat(q[:, at + 3 : at + 7])
            moved[:, av : av + 3] = turn.inv().apply(change[:, at : at + 3])
            at, av = at + 3, av + 3
        u, w = q[:, at : at + 3], q[:, at + 3 : at + 4]
        p, r = change[:, at : at + 3], change[:, at + 3 : at + 4]
        moved[:, av : av + 3] = 2 * (w * p - r * u - np.cross(u, p))
    return moved
