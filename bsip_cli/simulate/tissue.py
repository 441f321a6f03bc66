"""Soft tissue as measured on people: larger on trunk and thighs, curved in the pose, swinging.

Travel of markers against the bone: thigh cluster 18 mm and 10 degrees, shank 17 mm in the swing of
gait under fluoroscopy (CAMS-Knee data, PMC8631460); pelvis and thigh 3 to 54 mm in range, by marker
and movement (Fiorentino 2017, Gait Posture); back 9 to 11 mm between extension and flexion (Zemp
2014, PLoS ONE 9:e95426). Limbs' tissue vibrates near the frequencies of running's impacts
(Wakeling and Nigg 2001, J Appl Physiol 90:412). Assumed, without a source: how much of a segment
swings as one mass, its damping, and the trunk's frequency.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

SKIN_SIZE_M = {  # as in `landmarks`: travel of a marker for a large joint movement
    "thigh": 0.018,
    "shank": 0.007,
    "lower_torso": 0.012,
    "thorax": 0.012,
}
CURVED_SHARE = 0.5  # travel with the square of a joint's sine, of that with the sine
SWINGING = {  # share of the segment's mass, and the range of its frequency [Hz]
    "thigh_l": (0.3, (8.0, 11.0)),
    "thigh_r": (0.3, (8.0, 11.0)),
    "shank_l": (0.2, (8.0, 11.0)),
    "shank_r": (0.2, (8.0, 11.0)),
    "upper_torso": (0.1, (5.0, 8.0)),
    "lower_torso": (0.2, (5.0, 8.0)),
}
DAMPING_RATIO = (0.2, 0.4)
MARKER_SHARE = (0.3, 1.0)  # of the tissue's swing that a marker over it shows


@dataclass(frozen=True)
class Swing:
    """Part of a segment that hangs on its bone by a spring and a damper."""

    mass_share: float
    frequency_hz: float
    damping_ratio: float


def draw_tissue(rng: np.random.Generator) -> dict[str, Swing]:
    """What swings, by segment; left and right at frequencies of their own."""
    return {
        segment: Swing(share, float(rng.uniform(*range_hz)), float(rng.uniform(*DAMPING_RATIO)))
        for segment, (share, range_hz) in SWINGING.items()
    }
