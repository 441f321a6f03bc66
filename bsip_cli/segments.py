"""The names of segments and landmarks, fixed for every table and file, and as people read them."""

from __future__ import annotations

SEGMENTS = (
    *("lower_torso", "upper_torso", "head"),
    *("upper_arm_l", "upper_arm_r", "forearm_l", "forearm_r", "hand_l", "hand_r"),
    *("thigh_l", "thigh_r", "shank_l", "shank_r", "foot_l", "foot_r"),
)
"""Segments with mass: every skeleton has them."""

LINKS = ("clavicle_l", "clavicle_r")
"""Massless rods between segments, which a skeleton may have (Robert 2017)."""

_JOINTS = {
    "lower_torso": "root",
    "upper_torso": "waist",
    "head": "neck",
    "clavicle": "sternoclavicular",
    "upper_arm": "shoulder",
    "forearm": "elbow",
    "hand": "wrist",
    "thigh": "hip",
    "shank": "knee",
    "foot": "ankle",
}
TRUNK = ("lower_torso", "upper_torso")
_SIDES = {"_l": "left", "_r": "right"}


def in_words(name: str) -> str:
    """A segment, joint or landmark as people say it: ``left upper arm`` for upper_arm_l."""
    side = _SIDES.get(name[-2:])
    words = name[:-2] if side else name
    return f"{side} {words}".replace("_", " ") if side else words.replace("_", " ")


def the_joint(name: str) -> str:
    """A joint with its article; the floating base, which is no joint, by what hangs on it."""
    if name == "root":
        return "the whole body"
    return f"the {in_words(name)}" + (" joint" if name.startswith("sternoclavicular") else "")


def how_held(segment: str, neutral: str = "") -> str:
    """What is done with a segment that has no markers; ``neutral`` : more of the neutral pose."""
    if segment == "head":
        return "it is held upright"
    return f"its joint is held at the neutral pose{neutral}"


def without_side(name: str) -> str:
    """The kind of segment: upper_arm for upper_arm_l; what has no side, itself."""
    return name[:-2] if name[-2:] in _SIDES else name


def joint_of(segment: str) -> str:
    """The joint that a segment hangs on: shoulder_l for upper_arm_l."""
    kind = without_side(segment)
    return _JOINTS[kind] + segment[len(kind) :]


def mirrored(name: str) -> str:
    """The same on the other side: upper_arm_r for upper_arm_l; what has no side, itself."""
    other = {"_l": "_r", "_r": "_l"}.get(name[-2:])
    return name[:-2] + other if other else name


# --- bony landmarks and joint centres that a marker may mark --------------------------------------


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
