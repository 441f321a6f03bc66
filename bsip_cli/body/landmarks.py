"""Names of the bony landmarks and joint centres that a marker may mark."""

from __future__ import annotations

_SIDED = (
    *("forehead", "occiput", "temple", "acromion", "acromial_angle", "clavicle", "asis", "psis"),
    *(f"{name}_{end}" for name in ("elbow", "knee", "malleolus") for end in ("lateral", "medial")),
    *("styloid_radial", "styloid_ulnar", "wrist", "calcaneus"),
    *(f"metacarpal_{k}" for k in (2, 3, 5)),
    *(f"metatarsal_{k}" for k in (1, 2, 5)),
)
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
