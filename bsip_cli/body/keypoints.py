"""Skin landmarks in place of joint centres, which markerless systems give instead of them.

The stand-ins lie where the regressions of :mod:`bsip_cli.body.joint_centres` lead back to the given
centres. What keypoints do not show is taken as in upright standing: the pelvis faces along the line
from the hips to the shoulders, knees and ankles bend about the line of the hips.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from bsip_cli.segments import in_words
from bsip_cli.stated.sex_words import with_other

# Hip joint centre in fractions of the distance of the ASIS, from their middle; X anterior, Y up, Z
# right.
HIP_FRACTIONS = with_other({"M": (-0.095, -0.370, 0.361), "F": (-0.139, -0.336, 0.372)})
_HALF_M = 0.04  # of the distance of the stand-ins across a joint; only middle and direction count
_ACROMION = 0.11  # above the shoulder's centre, in parts of the length from hips to shoulders
_ACROSS = {
    "knee_centre": ("knee_lateral", "knee_medial"),
    "ankle_centre": ("malleolus_lateral", "malleolus_medial"),
    "elbow_centre": ("elbow_lateral", "elbow_medial"),
}
_TRUNK = ("hip_centre_l", "hip_centre_r", "shoulder_centre_l", "shoulder_centre_r")
_PELVIS = ("asis_l", "asis_r", "sacrum")


def stood_in_for(known: Collection[str]) -> set[str]:
    """Names of the skin landmarks that the known centres can stand in for."""
    stand_ins = {
        f"{name}_{side}"
        for centre, names in _ACROSS.items()
        for side in "lr"
        if f"{centre}_{side}" in known and set(_TRUNK) <= set(known)
        for name in names
    }
    if set(_TRUNK) <= set(known):
        stand_ins |= {*_PELVIS, "acromion_l", "acromion_r"}
    return stand_ins - set(known)


def with_skin(
    landmarks: Mapping[str, np.ndarray], sex: str
) -> tuple[dict[str, np.ndarray], tuple[str, ...]]:
    """Landmarks (3,) [m] with skin landmarks for the joint centres among them, and what was done.

    Those that have markers stay as they are.
    """
    wanted = stood_in_for(landmarks.keys())
    if not wanted:
        return dict(landmarks), ()
    hips = 0.5 * (landmarks["hip_centre_l"] + landmarks["hip_centre_r"])
    shoulders = 0.5 * (landmarks["shoulder_centre_l"] + landmarks["shoulder_centre_r"])
    across = landmarks["hip_centre_r"] - landmarks["hip_centre_l"]
    right = across / np.linalg.norm(across)
    up = shoulders - hips
    up = up - (up @ right) * right
    y = up / np.linalg.norm(up)
    x = np.cross(y, right)
    ahead, above, aside = HIP_FRACTIONS[sex]
    width = float(np.linalg.norm(across)) / (2 * aside)
    middle = hips - width * (ahead * x + above * y)
    placed = {
        "asis_l": middle - 0.5 * width * right,
        "asis_r": middle + 0.5 * width * right,
        "sacrum": middle - width * x,
    }
    for side in "lr":
        placed[f"acromion_{side}"] = landmarks[f"shoulder_centre_{side}"] + _ACROMION * up
        outward = right if side == "r" else -right
        for centre, (lateral, medial) in _ACROSS.items():
            if (given := landmarks.get(f"{centre}_{side}")) is not None:
                placed[f"{lateral}_{side}"] = given + _HALF_M * outward
                placed[f"{medial}_{side}"] = given - _HALF_M * outward
    note = "joint centres are given, no skin landmarks: placed from them as in upright standing: "
    return dict(landmarks) | {name: placed[name] for name in wanted}, (
        note + ", ".join(in_words(name) for name in sorted(wanted)),
    )
