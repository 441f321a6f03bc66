"""Names of the bony landmarks and joint centres that a marker may mark."""

from __future__ import annotations

_SIDED = {
    "forehead",
    "occiput",
    "temple",
    "acromion",
    "acromial_angle",
    "clavicle",
    "asis",
    "psis",
    "elbow_lateral",
    "elbow_medial",
    "styloid_radial",
    "styloid_ulnar",
    "wrist",
    "metacarpal_2",
    "metacarpal_3",
    "metacarpal_5",
    "knee_lateral",
    "knee_medial",
    "malleolus_lateral",
    "malleolus_medial",
    "calcaneus",
    "metatarsal_1",
    "metatarsal_2",
    "metatarsal_5",
}
JOINT_CENTRES = frozenset(
    f"{name}_centre_{side}"
    for name in ("shoulder", "elbow", "hip", "knee", "ankle")
    for side in "lr"
)
LANDMARKS = frozenset(
    {"vertex", "sellion", "forehead", "occiput", "c7", "t10", "suprasternale", "xiphoid", "sacrum"}
    | {f"{name}_{side}" for name in _SIDED for side in "lr"}
    | JOINT_CENTRES
)
