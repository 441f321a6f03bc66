"""Markers that were low-passed before they were delivered."""

from __future__ import annotations

from types import MappingProxyType

import numpy as np
from scipy.signal import butter, sosfiltfilt

from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.scene import Scene

CUTOFFS_HZ = (1.0, 1.3, 1.6, 2.0, 2.5, 3.0, 3.7, 4.5, 5.5, 7.0, 9.0)
FILTERS_HZ = 0.08  # to which a cut-off says what a filter does: labs use more kinds than one
ROUNDS = 4  # of restoring what a low-pass took; more restore what is no longer there
# Two passes of order two: each cuts at this multiple of where both together pass 1/sqrt(2).
CORNER = (np.sqrt(2.0) - 1.0) ** -0.25


class OverSmoothing(Effect):
    """The markers went through a zero-phase Butterworth of order four, and the pose with them.

    ``share`` is 1 where the cut-off is right.
    """

    name = "over_smoothing"
    of_the_lab = True
    least_named = MappingProxyType({"share": 0.3})  # less belongs to another cut-off
    looks = "peaks of the simulated force too low and too wide, in fast movements only"
    remedy = "export the trial again without the lab's filter"

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return ("",)

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        cutoffs = tuple(f for f in CUTOFFS_HZ if CORNER * f < 0.4 * scene.rate_hz)
        most = min(12.0, 0.45 * scene.rate_hz / CORNER)
        return (
            Parameter("share", "1", 0.0, 2.0, 1.0),
            Parameter("cutoff", "Hz", 0.5, most, 0.5, cutoffs, known_to=FILTERS_HZ),
        )

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        share, cutoff = float(values[0]), float(values[1])
        scanned = self.parameters(scene, target)[1].scan
        # All that are scanned cost little more than one.
        cutoffs = scanned if cutoff in scanned else (cutoff,)
        lost = scene.once((self.name, cutoffs), lambda: _lost_wrenches(scene, cutoffs))
        return share * lost[..., cutoffs.index(cutoff)]

    def marker_change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """The filter bends the body: markers that move on circles come nearer to the centre."""
        errors = -values[0] * _lost_m(scene, float(values[1]))[..., None]
        return scene.pose_response.left(errors)[..., 0]

    def reported(
        self, scene: Scene, target: str, values: np.ndarray
    ) -> tuple[tuple[str, str, float], ...]:
        return (("cutoff", "Hz", float(effective_cutoff_hz(values))),)

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        return (
            "the markers were low-passed with a cut-off near "
            f"{effective_cutoff_hz(values):.1f} Hz before they were delivered"
        )


def effective_cutoff_hz(values: np.ndarray) -> float:
    """Cut-off whose loss is the share: at low frequencies it falls like the fourth power."""
    return float(values[1] * max(values[0], 1e-6) ** -0.25)


def _lost_m(scene: Scene, cutoff_hz: float) -> np.ndarray:
    """(N, m, 3) what the filter took from the markers, of the model's own, which have no noise."""
    sections = butter(2, CORNER * cutoff_hz, fs=scene.rate_hz, output="sos")
    padding = min(len(scene.q) - 1, round(2 * scene.rate_hz / cutoff_hz))
    left, lost = scene.model_markers_m, np.zeros_like(scene.model_markers_m)
    # Van Cittert: (1 - L) + (1 - L)^2 + ... is 1/L - 1, what the low-pass L took.
    for _ in range(ROUNDS):
        left = left - sosfiltfilt(sections, left, axis=0, padlen=padding)
        lost = lost + left
    return lost


def _lost_wrenches(scene: Scene, cutoffs_hz: tuple[float, ...]) -> np.ndarray:
    """(N, 6, k) what the simulated wrench lacks for want of what the filter took."""
    lost = np.stack([_lost_m(scene, cutoff) for cutoff in cutoffs_hz], axis=-1)
    return scene.response.of(scene.pose_response.of(lost))
