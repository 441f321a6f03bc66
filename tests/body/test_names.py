"""Names of the code as people say them."""

from __future__ import annotations

import pytest

from bsip_cli.segments import SEGMENTS, in_words, mirrored, the_joint, without_side


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("elbow_l", "left elbow"),
        ("upper_arm_r", "right upper arm"),
        ("lower_torso", "lower torso"),
        ("waist", "waist"),
        ("knee_lateral_r", "right knee lateral"),
    ],
)
def test_names_in_words(name, words):
    assert in_words(name) == words


def test_the_base_is_the_whole_body():
    assert the_joint("root") == "the whole body"
    assert the_joint("wrist_r") == "the right wrist"


def test_every_segment_has_its_mirror():
    assert {mirrored(name) for name in SEGMENTS} == set(SEGMENTS)
    assert all(mirrored(mirrored(name)) == name for name in SEGMENTS)
    assert [mirrored(name) for name in ("hand_l", "foot_r", "head")] == ["hand_r", "foot_l", "head"]


def test_the_kind_of_a_segment():
    assert [without_side(name) for name in ("hand_l", "upper_arm_r", "head", "upper_torso")] == [
        "hand",
        "upper_arm",
        "head",
        "upper_torso",
    ]
