"""Joint centres of markerless systems in place of markers on the skin."""

from __future__ import annotations

import numpy as np
import pytest

from bsip_cli.body.joint_centres import joint_centres, missing_landmarks, with_skin
from bsip_cli.body.skeleton import load_skeleton
from bsip_cli.motion.calibration import calibrate
from bsip_cli.recordings.marker_guess import guess_marker_set
from tests.body.standing_person import HEIGHT_M, standing_markers
from tests.body.test_stand_ins import centres

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
