"""People seen in part or by a markerless system: stand-ins lie near to what was left out."""

from __future__ import annotations

import numpy as np
import pytest

from bsip_cli.body.anthropometry import mean_length_m
from bsip_cli.body.joint_centres import JointCentres, joint_centres, missing_landmarks, with_skin
from bsip_cli.body.markersets import load_marker_set
from bsip_cli.body.skeleton import load_skeleton
from bsip_cli.errors import BadDataError
from bsip_cli.motion.calibration import Calibration, calibrate
from bsip_cli.recordings.marker_guess import guess_marker_set
from tests.body.standing_person import HEIGHT_M, standing_markers

ARM_L = ("LUA", "LELB", "LFA", "LWRR", "LWRU", "LHAND")
ARM_HAND = ("WRR", "WRU", "HAND")


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


@pytest.mark.parametrize("label", sorted(standing_markers()))
def test_any_marker_may_be_missing_and_a_person_comes_of_it_or_words(label):
    try:
        person = calibrated(label).person
    except BadDataError as refused:
        assert label in str(refused) or "marker" in str(refused)
    else:
        assert np.isfinite(person.lengths_m).all()


@pytest.mark.parametrize("gone", [("C7", "IJ"), ("RAC", "LAC"), ("C7",), ("LAC",)])
def test_trunk_seen_in_part(gone):
    whole, part = centres(), centres(*gone)
    for joint in ("neck", "shoulder_l", "shoulder_r"):
        away = np.linalg.norm(whole.positions[joint] - part.positions[joint])
        assert away < 0.05, joint
    assert any("placed by mean proportions" in note for note in part.notes)
    assert not any("placed by mean proportions" in note for note in whole.notes)
    assert not held(calibrated()) and calibrated().notes == tuple(whole.notes)


def test_nothing_of_the_trunk_stands_straight_on_the_pelvis():
    trunk = ("C7", "T10", "XIPH", "IJ", "RSCAP", "RAC", "LAC")
    found = centres(*trunk, *ARM_L, *(f"R{name[1:]}" for name in ARM_L))
    up = found.positions["neck"] - found.positions["waist"]
    assert np.linalg.norm(up) == pytest.approx(mean_length_m("M", "torso", HEIGHT_M), rel=0.1)
    assert up @ found.pelvis_axes[:, 1] / np.linalg.norm(up) > 0.99


def test_an_arm_without_markers_hangs_down_and_is_held():
    found = calibrated(*ARM_L)
    assert held(found) == {"upper_arm_l", "forearm_l", "hand_l"}
    segments = found.person.skeleton.segments
    for segment, row in (("upper_arm_l", "arm"), ("forearm_l", "forearm")):
        length_m = found.person.lengths_m[segments.index(segment)]
        assert length_m == pytest.approx(mean_length_m("M", row, HEIGHT_M))
    assert "no markers on the left arm: it hangs straight down" in found.notes


def test_no_head_and_no_hands():
    found = calibrated("RTEM", "LTEM", "FHEAD", *(f"{s}{n}" for s in "LR" for n in ARM_HAND))
    assert held(found) == {"head", "hand_l", "hand_r"}


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


NAMES = ("hip", "knee", "ankle", "shoulder", "elbow")
OPENPOSE = (
    "Nose Neck RShoulder RElbow RWrist LShoulder LElbow LWrist MidHip RHip RKnee RAnkle LHip LKnee "
    "LAnkle REye LEye REar LEar LBigToe LSmallToe LHeel RBigToe RSmallToe RHeel"
)
_MEDIAPIPE = "EYE EAR SHOULDER ELBOW WRIST HIP KNEE ANKLE HEEL FOOT_INDEX PINKY THUMB"
MEDIAPIPE = " ".join(f"{side}_{name}" for side in ("LEFT", "RIGHT") for name in _MEDIAPIPE.split())
THEIA = " ".join(
    f"{s}{n}" for s in "LR" for n in ["HJC", "KJC", "AJC", "SJC", "EJC", "WJC", "Heel", "Toe"]
)
DEEPLABCUT = " ".join(
    f"{name}_{side}"
    for name in ["eye", "shoulder", "elbow", "wrist", "hip", "knee", "ankle", "heel", "toe"]
    for side in ("left", "right")
)
_STUDY = """
r.ASIS L.ASIS r.PSIS L.PSIS r_knee L_knee r_mknee L_mknee r_ankle L_ankle r_mankle L_mankle
r_calc L_calc r_toe L_toe r_5meta L_5meta r_shoulder L_shoulder C7 RHJC LHJC r_thigh1 r_thigh2
r_thigh3 L_thigh1 L_thigh2 L_thigh3 r_sh1 r_sh2 r_sh3 L_sh1 L_sh2 L_sh3 r_lelbow r_melbow
r_lwrist r_mwrist L_lelbow L_melbow L_lwrist L_mwrist
"""
OPENCAP = " ".join(
    [OPENPOSE.replace("MidHip", "midHip"), *(f"{name}_study" for name in _STUDY.split())]
)


def keypoints() -> dict[str, np.ndarray]:
    """Centres of the standing person's joints and the markers of the feet, by landmark."""
    places = {
        f"{name}_centre_{side}": centres().positions[f"{name}_{side}"]
        for name in NAMES
        for side in "lr"
    }
    places |= {f"wrist_{side}": centres().positions[f"wrist_{side}"] for side in "lr"}
    for side in "lr":
        for landmark, label in (("calcaneus", "CAL"), ("metatarsal_2", "MT2")):
            places[f"{landmark}_{side}"] = standing_markers()[f"{side.upper()}{label}"]
    return places


@pytest.mark.parametrize("sex", ["M", "F"])
def test_the_given_centres_are_the_joints(sex):
    assert missing_landmarks(keypoints()) == []
    landmarks, notes = with_skin(keypoints(), sex)
    found = joint_centres(landmarks, sex, HEIGHT_M).positions
    for name in NAMES:
        for side in "lr":
            given = keypoints()[f"{name}_centre_{side}"]
            assert found[f"{name}_{side}"] == pytest.approx(given, abs=1e-9), name
    assert len(notes) == 1 and "left asis" in notes[0]


def test_trunk_and_neck_lie_near_those_of_markers():
    found = joint_centres(with_skin(keypoints(), "M")[0], "M", HEIGHT_M).positions
    for name in ("waist", "neck"):
        assert np.linalg.norm(found[name] - centres().positions[name]) < 0.06, name


def test_markers_go_before_stand_ins():
    asis = standing_markers()["RASIS"]
    landmarks, _ = with_skin(keypoints() | {"asis_r": asis}, "M")
    assert landmarks["asis_r"] == pytest.approx(asis)
    skin = {"asis_l": asis, "c7": asis}
    assert with_skin(skin, "M") == (skin, ())


@pytest.mark.parametrize("labels", [OPENPOSE, MEDIAPIPE, THEIA, DEEPLABCUT])
def test_keypoints_are_told_as_joint_centres(labels):
    guess = guess_marker_set(labels.split())
    assert len(guess.centres) == 10
    landmarks = {marker.landmark for marker in guess.marker_set.markers}
    assert missing_landmarks(landmarks) == []
    about = guess.findings()[-1]
    assert "centres of joints" in about.found and about.level == "warning"


def test_predicted_markers_go_before_the_keypoints_beside_them():
    guess = guess_marker_set(OPENCAP.split())
    landmarks = {m.landmark: m.label for m in guess.marker_set.markers}
    assert not guess.centres and landmarks["knee_medial_r"] == "r_mknee"
    assert guess.unknown == ("RHJC", "LHJC")


def test_skin_markers_stay_markers_without_a_telltale():
    labels = "RHip LHip RKnee LKnee RAnkle LAnkle RHeel LHeel RToe LToe Sacrum R.ASIS L.ASIS"
    assert guess_marker_set(labels.split()).centres == ()


def test_a_person_is_calibrated_from_keypoints():
    guess = guess_marker_set(THEIA.split())
    places = {m.label: keypoints()[m.landmark] for m in guess.marker_set.markers if m.landmark}
    skeleton = load_skeleton("hansen2017")
    calibration = calibrate(skeleton, guess.marker_set, places, "M", None)
    assert calibration.stature_m == pytest.approx(HEIGHT_M, rel=0.05)
    assert any("joint centres are given" in note for note in calibration.notes)
