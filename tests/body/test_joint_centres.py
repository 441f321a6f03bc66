"""Joint centres from landmarks: by the tables of Reed, Dumas and the stature, and midpoints."""

import numpy as np
import pytest

from bsip_cli.body.joint_centres import joint_centres
from bsip_cli.errors import BadDataError

_LATERAL_ONLY = "lateral markers only: centres from the mean breadth at {}"
STATURE_M = 1.75
WIDTH = 0.25  # between the ASIS
THORAX, SLOPE = 0.14, -30.0  # C7 to suprasternale, degrees


def upright():
    """World X anterior, Y left, Z up; the pelvis level, the thorax' line sloping 30 degrees."""
    c7 = np.array([-0.06, 0.0, 1.5])
    slope = np.deg2rad(SLOPE)
    places = {
        "asis_r": (0.1, -WIDTH / 2, 1.0),
        "asis_l": (0.1, WIDTH / 2, 1.0),
        "psis_r": (-0.05, -0.04, 1.0),
        "psis_l": (-0.05, 0.04, 1.0),
        "c7": c7,
        "suprasternale": c7 + THORAX * np.array([np.cos(slope), 0.0, np.sin(slope)]),
    }
    for side, y in (("r", -1.0), ("l", 1.0)):
        places |= {
            f"acromion_{side}": (-0.02, 0.2 * y, 1.45),
            f"elbow_lateral_{side}": (-0.02, 0.3 * y, 1.15),
            f"styloid_radial_{side}": (0.16, 0.29 * y, 1.0),
            f"styloid_ulnar_{side}": (0.14, 0.31 * y, 0.98),
            f"knee_lateral_{side}": (0.0, 0.17 * y, 0.5),
            f"knee_medial_{side}": (0.0, 0.06 * y, 0.5),
            f"malleolus_lateral_{side}": (-0.02, 0.15 * y, 0.09),
            f"malleolus_medial_{side}": (-0.02, 0.08 * y, 0.1),
            f"calcaneus_{side}": (-0.08, 0.11 * y, 0.03),
            f"metatarsal_1_{side}": (0.11, 0.07 * y, 0.04),
            f"metatarsal_5_{side}": (0.09, 0.16 * y, 0.03),
        }
    return {name: np.array(place) for name, place in places.items()}


# Fractions of the pelvis width from mid-ASIS: anterior, up, right (Reed, in the ISB pelvis frame).
REED = {
    "M": {"waist": (-0.335, -0.032, 0.0), "hip_r": (-0.095, -0.370, 0.361)},
    "F": {"waist": (-0.340, 0.049, 0.0), "hip_r": (-0.139, -0.336, 0.372)},
}


@pytest.mark.parametrize("sex", ["M", "F"])
def test_pelvis_gets_reeds_fractions(sex):
    centres = joint_centres(upright(), sex, STATURE_M)
    middle = np.array([0.1, 0.0, 1.0])
    for joint, (anterior, up, right) in REED[sex].items():
        expected = middle + WIDTH * np.array([anterior, -right, up])
        np.testing.assert_allclose(centres.positions[joint], expected, atol=1e-12)
    mirrored = centres.positions["hip_r"] * [1, -1, 1]
    np.testing.assert_allclose(centres.positions["hip_l"], mirrored, atol=1e-12)
    np.testing.assert_allclose(centres.pelvis_axes, [[1, 0, 0], [0, 0, -1], [0, 1, 0]], atol=1e-12)


def test_other_sexes_get_the_mean_of_both_and_it_is_said():
    man, woman, other = (joint_centres(upright(), sex, STATURE_M) for sex in ("M", "F", "other"))
    for joint in ("waist", "hip_r", "hip_l"):
        middle = (man.positions[joint] + woman.positions[joint]) / 2
        np.testing.assert_allclose(other.positions[joint], middle, atol=1e-12)
    assert "mean of the women's and the men's tables" in other.notes[0]
    assert not any("mean of" in note for note in man.notes)


@pytest.mark.parametrize(("sex", "part", "angle"), [("M", 0.55, 8.0), ("F", 0.53, 14.0)])
def test_neck_and_shoulders_lie_at_their_angles_from_the_thorax_line(sex, part, angle):
    landmarks = upright()
    centres = joint_centres(landmarks, sex, STATURE_M).positions

    def at(start, fraction, degrees):
        slope = np.deg2rad(SLOPE + degrees)
        return start + fraction * THORAX * np.array([np.cos(slope), 0.0, np.sin(slope)])

    np.testing.assert_allclose(centres["neck"], at(landmarks["c7"], part, angle), atol=1e-12)
    for side in "lr":
        expected = at(landmarks[f"acromion_{side}"], 0.42, -67.0)
        np.testing.assert_allclose(centres[f"shoulder_{side}"], expected, atol=1e-12)
        assert centres[f"shoulder_{side}"][2] < landmarks[f"acromion_{side}"][2]


def test_midpoints():
    landmarks = upright() | {
        "elbow_medial_l": np.array([-0.02, 0.21, 1.17]),
        "elbow_medial_r": np.array([-0.01, -0.21, 1.16]),
    }
    centres = joint_centres(landmarks, "M", STATURE_M)
    for side in "lr":
        for joint, a, b in (
            ("elbow", "elbow_lateral", "elbow_medial"),
            ("wrist", "styloid_radial", "styloid_ulnar"),
            ("knee", "knee_lateral", "knee_medial"),
            ("ankle", "malleolus_lateral", "malleolus_medial"),
        ):
            middle = 0.5 * (landmarks[f"{a}_{side}"] + landmarks[f"{b}_{side}"])
            np.testing.assert_allclose(centres.positions[f"{joint}_{side}"], middle, atol=1e-12)
    assert all(hinge[1] < -0.9 for hinge in centres.hinges.values())  # to the person's right
    assert centres.notes == ()


def test_a_bent_elbow_with_a_lateral_marker_only_turns_about_the_normal_of_the_arm():
    landmarks = upright()
    centres = joint_centres(landmarks, "M", STATURE_M)
    for side in "lr":
        hinge = centres.hinges[f"elbow_{side}"]
        lateral = landmarks[f"elbow_lateral_{side}"]
        wrist = centres.positions[f"wrist_{side}"]
        for end in (wrist, centres.positions[f"shoulder_{side}"]):
            assert hinge @ (lateral - end) == pytest.approx(0, abs=1e-12)
        inward = centres.positions[f"elbow_{side}"] - lateral
        assert np.linalg.norm(inward) == pytest.approx(0.022 * STATURE_M)
        assert inward[1] * lateral[1] < 0  # towards the body
    assert centres.notes == (_LATERAL_ONLY.format("left elbow, right elbow"),)


def test_lateral_markers_alone_give_knees_and_ankles_from_the_stature():
    landmarks = {k: v for k, v in upright().items() if "medial" not in k}
    centres = joint_centres(landmarks, "M", STATURE_M)
    expected = landmarks["knee_lateral_r"] + [0, 0.031 * STATURE_M, 0]
    np.testing.assert_allclose(centres.positions["knee_r"], expected, atol=1e-12)
    expected = landmarks["malleolus_lateral_l"] - [0, 0.022 * STATURE_M, 0]
    np.testing.assert_allclose(centres.positions["ankle_l"], expected, atol=1e-12)
    where = "left elbow, left knee, left ankle, right elbow, right knee, right ankle"
    assert centres.notes == (_LATERAL_ONLY.format(where),)


def test_without_suprasternale_the_thorax_comes_from_the_stature_and_it_is_said():
    landmarks = upright()
    with_it = joint_centres(landmarks, "M", STATURE_M).positions["neck"]
    del landmarks["suprasternale"]
    centres = joint_centres(landmarks, "M", STATURE_M)
    assert np.linalg.norm(centres.positions["neck"] - with_it) < 0.03
    assert centres.positions["neck"][0] > landmarks["c7"][0]
    assert any("suprasternale" in note for note in centres.notes)


def test_the_sacrum_replaces_the_psis():
    landmarks = upright()
    expected = joint_centres(landmarks, "M", STATURE_M).positions["waist"]
    landmarks["sacrum"] = 0.5 * (landmarks.pop("psis_l") + landmarks.pop("psis_r"))
    found = joint_centres(landmarks, "M", STATURE_M).positions["waist"]
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_a_turned_person_has_turned_joint_centres():
    """Half a turn and a lean: nothing may depend on the lab's axes."""
    turn = np.array([[-0.8, 0.6, 0.0], [-0.6, -0.8, 0.0], [0.0, 0.0, 1.0]])
    lean = np.array([[1.0, 0.0, 0.0], [0.0, 0.96, -0.28], [0.0, 0.28, 0.96]])
    R, shift = turn @ lean, np.array([2.0, -1.0, 0.5])
    before = joint_centres(upright(), "M", STATURE_M)
    moved = {name: R @ place + shift for name, place in upright().items()}
    after = joint_centres(moved, "M", STATURE_M)
    for name, place in before.positions.items():
        np.testing.assert_allclose(after.positions[name], R @ place + shift, atol=1e-12)
    for name, hinge in before.hinges.items():
        np.testing.assert_allclose(after.hinges[name], R @ hinge, atol=1e-12)


def test_missing_landmarks_are_all_named():
    landmarks = upright()
    gone = ["asis_l", "calcaneus_r", "knee_lateral_l", "malleolus_lateral_r", "psis_l", "psis_r"]
    gone += ["metatarsal_1_l", "metatarsal_5_l"]
    for name in gone:
        del landmarks[name]
    with pytest.raises(BadDataError) as caught:
        joint_centres(landmarks, "M", STATURE_M)
    found = caught.value.found
    for name in [*gone[:4], "a metatarsal of the left foot", "psis_l and psis_r, or sacrum"]:
        assert name in found
    assert "foot_r" not in found
    assert caught.value.remedy
