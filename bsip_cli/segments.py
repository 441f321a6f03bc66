"""The names of the segments, fixed for every table and file, and names as people read them."""

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
