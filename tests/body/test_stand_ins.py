"""A person of whom trunk or arms are seen in part: stand-ins lie near to what was left out."""

from __future__ import annotations

import numpy as np
import pytest

from bsip_cli.body.anthropometry import mean_length_m
from bsip_cli.body.joint_centres import JointCentres, joint_centres
from bsip_cli.body.markersets import load_marker_set
from bsip_cli.body.skeleton import load_skeleton
from bsip_cli.motion.calibration import Calibration, calibrate
from tests.body.standing_person import HEIGHT_M, standing_markers

ARM_L = ("LUA", "LELB", "LFA", "LWRR", "LWRU", "LHAND")


def calibrated(*gone: str) -> Calibration:
    """The standing person without some of the markers."""
    markers = {label: place for label, place in standing_markers().items() if label not in gone}
    skeleton, marker_set = load_skeleton("hansen2017"), load_marker_set("hansen2017")
    return calibrate(skeleton, marker_set, markers, "M", HEIGHT_M)


def centres(*gone: str) -> JointCentres:
    """Joint centres of the same person, from the landmarks of the markers left."""
    landmarks = {
        marker.landmark: standing_markers()[marker.label]
        for marker in load_marker_set("hansen2017").markers
        if marker.landmark and marker.label not in gone
    }
    return joint_centres(landmarks, "M", HEIGHT_M)


def held(calibration: Calibration) -> set[str]:
    person = calibration.person
    return {s for s, h in zip(person.skeleton.segments, person.held, strict=True) if h}


@pytest.mark.parametrize("gone", [("C7", "IJ"), ("RAC", "LAC"), ("C7",), ("LAC",)])
def test_trunk_seen_in_part(gone):
    whole, part = centres(), centres(*gone)
    for joint in ("neck", "shoulder_l", "shoulder_r"):
        away = np.linalg.norm(whole.positions[joint] - part.positions[joint])
        assert away < 0.05, joint
    assert any("placed by mean proportions" in note for note in part.notes)
    assert not any("placed by mean proportions" in note for note in whole.notes)


def test_nothing_of_the_trunk_stands_straight_on_the_pelvis():
    trunk = ("C7", "T10", "XIPH", "IJ", "RSCAP", "RAC", "LAC")
    found = centres(*trunk, *ARM_L, *(f"R{name[1:]}" for name in ARM_L))
    up = found.positions["neck"] - found.positions["waist"]
    assert np.linalg.norm(up) == pytest.approx(mean_length_m("M", "torso", HEIGHT_M), rel=0.1)
    assert up @ found.pelvis_axes[:, 1] / np.linalg.norm(up) > 0.99


def test_an_arm_without_markers_hangs_down_and_is_held():
    found = calibrated(*ARM_L)
    assert held(found) == {"upper_arm_l", "forearm_l", "hand_l"}
    lengths = dict(
        zip(found.person.skeleton.segments, found.person.lengths_m.tolist(), strict=True)
    )
    assert lengths["upper_arm_l"] == pytest.approx(mean_length_m("M", "arm", HEIGHT_M))
    assert lengths["forearm_l"] == pytest.approx(mean_length_m("M", "forearm", HEIGHT_M))
    assert "no markers on the left arm: it hangs straight down" in found.notes


def test_no_head_and_no_hands():
    found = calibrated("RTEM", "LTEM", "FHEAD", *(f"{s}{n}" for s in "LR" for n in ARM_HAND))
    assert held(found) == {"head", "hand_l", "hand_r"}


ARM_HAND = ("WRR", "WRU", "HAND")


def test_one_styloid_serves_as_the_wrist():
    landmark = standing_markers()["LWRR"]
    found = centres("LWRU")
    np.testing.assert_allclose(found.positions["wrist_l"], landmark)
    assert "the left wrist has one marker only: taken as its centre" in found.notes
    whole = centres()
    assert np.linalg.norm(found.positions["wrist_l"] - whole.positions["wrist_l"]) < 0.03


def test_a_forearm_without_wrist_goes_on_straight():
    found = centres("LWRR", "LWRU")
    elbow = standing_markers()["LELB"]
    fore = found.positions["wrist_l"] - elbow
    upper = elbow - found.positions["shoulder_l"]
    assert fore @ upper == pytest.approx(np.linalg.norm(fore) * np.linalg.norm(upper))
    assert np.linalg.norm(fore) == pytest.approx(mean_length_m("M", "forearm", HEIGHT_M))


def test_an_elbow_without_marker_lies_between_shoulder_and_wrist():
    found = centres("LELB")
    shoulder, wrist = found.positions["shoulder_l"], found.positions["wrist_l"]
    share = np.linalg.norm(found.positions["elbow_l"] - shoulder) / np.linalg.norm(wrist - shoulder)
    upper, fore = (mean_length_m("M", row, HEIGHT_M) for row in ("arm", "forearm"))
    assert share == pytest.approx(upper / (upper + fore))


def test_everything_there_changes_nothing():
    assert not held(calibrated())
    assert calibrated().notes == tuple(centres().notes)
