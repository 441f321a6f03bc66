"""The names of the 15 segments, fixed for every table and file."""

from __future__ import annotations

SEGMENTS = (
    "lower_torso",
    "upper_torso",
    "head",
    "upper_arm_l",
    "upper_arm_r",
    "forearm_l",
    "forearm_r",
    "hand_l",
    "hand_r",
    "thigh_l",
    "thigh_r",
    "shank_l",
    "shank_r",
    "foot_l",
    "foot_r",
)
