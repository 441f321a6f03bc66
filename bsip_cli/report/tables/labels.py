"""What the names in the data are called in print."""

from __future__ import annotations

from bsip_cli.statistics.cohort_values import Topic

UNITS = {"mm2": "mm²", "% body weight": "% BW"}

SEQUENCE_IN_PRINT = "in the paper: random, 120 s"

SEGMENT_ORDER = (
    "lower_torso",
    "upper_torso",
    "head",
    "upper_arm_l",
    "forearm_l",
    "hand_l",
    "upper_arm_r",
    "forearm_r",
    "hand_r",
    "thigh_l",
    "shank_l",
    "foot_l",
    "thigh_r",
    "shank_r",
    "foot_r",
)
"""As in table 1 of Hansen 2017; other segments follow."""

_SIDES = {"l": "left", "r": "right"}


def segment(name: str) -> str:
    """left upper arm for upper_arm_l."""
    stem, _, end = name.rpartition("_")
    words = f"{_SIDES[end]} {stem}" if stem and end in _SIDES else name
    return words.replace("_", " ")


def segment_rank(name: str) -> int:
    return SEGMENT_ORDER.index(name) if name in SEGMENT_ORDER else len(SEGMENT_ORDER)


def unit(name: str) -> str:
    return UNITS.get(name, name)


def task(topic: Topic) -> str:
    """The movement; the one that identified OM is named as such."""
    if topic.role == "sequence":
        return f"{topic.task} (identified OM; {SEQUENCE_IN_PRINT})"
    return topic.task
