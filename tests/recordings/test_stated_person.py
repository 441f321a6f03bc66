"""What a C3D file says of mass, height and sex, and how tall the markers make the person."""

from __future__ import annotations

import numpy as np
import pytest

from bsip_cli.recordings.c3d import open_c3d
from bsip_cli.recordings.c3d_person import against_table, stated_person, together
from bsip_cli.recordings.model import StatedPerson
from bsip_cli.recordings.read import read_recording
from bsip_cli.recordings.scene import Stature, crossed_limbs, handedness, stature


def stated(**groups: dict) -> tuple[StatedPerson, list[str]]:
    values = {
        group: {
            name: v if isinstance(v, tuple) else np.array([v], float) for name, v in one.items()
        }
        for group, one in groups.items()
    }
    person, findings = stated_person(values)
    return person, [f"{f.found}; {f.expected}" for f in findings if f.level == "warning"]


@pytest.mark.parametrize(
    ("groups", "expected"),
    [
        ({"PROCESSING": {"BODYMASS": np.float32(32.1), "HEIGHT": 1450}}, (32.1, 1.45, "")),
        ({"PROCESSING": {"Bodymass": 60, "Height": 168}}, (60, 1.68, "")),
        (
            {"SUBJECT": {"WEIGHT": 82.7, "HEIGHT": 1.63, "GENDER": ("f",)}},
            (82.7, 1.63, "F"),
        ),
        ({"SUBJECTS": {"MASS": 70.5, "SEX": ("Männlich",)}}, (70.5, None, "M")),
        ({"SUBJECTS": {"BODY_MASS": ("70,5 kg",), "HEIGHT": ("163 cm",)}}, (70.5, 1.63, "")),
        (
            {"SUBJECT_INFO": {"Weight": 155.4, "Weight_Units": ("lbs",), "Height": 64.2}},
            (70.488, 1.631, ""),
        ),
        ({"PATIENT": {"MASS": 70500, "STATURE": 1630}}, (70.5, 1.63, "")),
        ({"SUBJECT": {"WEIGHT": 600, "HEIGHT": 170}}, (61.183, 1.7, "")),  # N, not lb
        ({"PROCESSING": {"BODYMASS": 0, "HEIGHT": 0}}, (None, None, "")),
        ({"PROCESSING": {"BODYMASS": np.nan}}, (None, None, "")),
        ({"EXPERIMENT": {"WEIGHT": 50, "HEIGHT": 1.6}}, (None, None, "")),  # of a robot's target
        ({"PROCESSING": {"LLEGLENGTH": 850, "RKNEEWIDTH": 100}}, (None, None, "")),
        ({"PROCESSING": {"BODYMASS": 70}, "SUBJECT": {"MASS": 70.1}}, (70, None, "")),
    ],
)
def test_what_programs_write(groups, expected):
    person, warned = stated(**groups)
    mass, height, sex = expected
    about = [v if v is None else pytest.approx(v, abs=1e-3) for v in (mass, height)]
    assert ([person.mass_kg, person.height_m], person.sex, warned) == (about, sex, [])


@pytest.mark.parametrize(
    ("groups", "height_m", "said"),
    [
        ({"PROCESSING": {"BODYMASS": 70}, "SUBJECT": {"MASS": 80}}, None, "SUBJECT:MASS = 80"),
        ({"SUBJECT": {"WEIGHT": 182, "HEIGHT": 1.63}}, 1.63, "82.6 kg (lb)"),
        ({"SUBJECT": {"WEIGHT": 110.9, "HEIGHT": 1630}}, 1.63, "50.3 kg (lb)"),
        ({"SUBJECT": {"MASS": 500}}, None, "226.8 kg (lb) or 50.99 kg (N)"),
    ],
)
def test_a_mass_that_may_be_several_is_said_and_not_used(groups, height_m, said):
    person, warned = stated(**groups)
    assert person == StatedPerson(None, height_m)
    assert said in " ".join(warned)


def test_several_files_of_one_person():
    one = StatedPerson(32.1, 1.45, "F")
    assert together({"a": one, "b": StatedPerson(), "c": one}) == (one, ())
    both, (said,) = together({"a": one, "b": StatedPerson(35.0, 1.45)})
    assert both == StatedPerson(None, 1.45, "F")
    assert said == "its files state different masses: 32.1 kg in a, 35 kg in b; none used"


def test_the_table_is_used_and_the_contradiction_said():
    file = StatedPerson(50.3, 1.63)
    (said,) = against_table(file, 110.9, 1.63, 2.0)
    assert said.level == "warning" and "50.3 kg" in said.found and "110.9 kg" in said.expected
    assert against_table(file, 50.0, None, 2.0) == []


@pytest.mark.real
@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("zoo_children/HC030A-static.c3d", StatedPerson(45.8, 1.48, name="HC030A")),
        ("btk_pig/PiG_Motion-FlatFoot-Hole.c3d", StatedPerson(66.5, 1.79, name="ANTO_M")),
        ("btk_pig/PiG_Calibration-FlatFoot-Hole.c3d", StatedPerson(name="ANTO_M")),  # zeros
        ("golf_french/static.c3d", StatedPerson(name="Golf_025_")),
    ],
)
def test_real_files(real_data, name, expected):
    assert read_recording(real_data / name).stated == expected


LABELS = ("LFHD", "RFHD", "C7", "LASI", "RASI", "LHEE", "LTOE", "RHEE", "RTOE")
PARTS = np.array([0.985, 0.985, 0.88, 0.62, 0.62, 0.03, 0.03, 0.03, 0.03])
CHILDREN = ("HC002D", "HC030A", "HC031A", "HC032A", "HC033A", "HC038A", "HC039A")


def standing(tall_m: float, frames: int = 100) -> np.ndarray:
    places = np.zeros((frames, len(LABELS), 3))
    places[..., 2] = PARTS * tall_m
    places[:, 5:, 0] = [-0.12, 0.12, -0.12, 0.12]
    return places


def told(tall_m: float, labels=LABELS, places=None) -> Stature:
    return stature(labels, standing(tall_m) if places is None else places)


@pytest.mark.parametrize("ratio", [0.86, 0.88, 1.13, 1.16])
def test_a_stated_height_that_is_not_the_markers_is_said_with_both_numbers(ratio):
    found, expected, action = told(1.70).against(1.70 * ratio)
    assert f"{1.70 * ratio:.2f} m" in found and f"{told(1.70).height_m:.2f} m" in found
    assert "11 %" in expected and "height_m" in action


@pytest.mark.parametrize("ratio", [0.93, 0.985, 1.0, 1.02, 1.07])
def test_what_markers_cannot_tell_is_not_said(ratio):
    found = told(1.70)
    assert found.against(found.height_m * ratio) is None


def test_toes_that_hang_in_the_air_make_nobody_taller():
    places = standing(1.70)
    places[20:90, :, 2] += 0.3
    places[20:90, [6, 8], 2] -= 0.15
    assert told(1.70, places=places).height_m == pytest.approx(told(1.70).height_m, rel=0.01)


def test_a_breastbone_alone_tells_no_height():
    labels = ("C3XX", "C4XX", "STRN", *LABELS[3:])
    assert told(1.70, labels).part == "lower_torso"
    assert told(1.70, (*labels[:3], "A1XX", "A2XX", *labels[5:])) is None


def test_who_never_stands_on_a_flat_foot_has_no_height():
    places = standing(1.70)
    places[:, [6, 8], 2] += 0.2 * (np.arange(100) % 2)[:, None]
    places[:, [5, 7], 2] += 0.2 * (1 - np.arange(100) % 2)[:, None]
    assert told(1.70, places=places) is None


def test_of_several_trials_the_head_counts_and_the_usual_one():
    low, *heads = (Stature(1.3, "lower_torso"), *(Stature(h, "head") for h in (1.7, 1.71, 2.0)))
    assert Stature.of_all([low, None, *heads]) == Stature(1.71, "head")
    assert Stature.of_all([None]) is None


@pytest.mark.real
@pytest.mark.parametrize("child", CHILDREN)
def test_children_are_as_tall_as_stated_and_no_sixth_taller(real_data, child):
    recording = open_c3d(real_data / "zoo_children" / f"{child}-static.c3d").recording
    stated_m = recording.stated.height_m
    found = stature(recording.labels, recording.markers_m)
    assert found.part == "head" and found.against(stated_m) is None
    assert found.against(1.16 * stated_m) and found.against(0.86 * stated_m)


def test_ankles_exchanged_in_walking_move_with_the_other_knee():
    signs = {"l": 1.0, "r": -1.0}.items()
    time_s = np.linspace(0.0, 3.0, 150)
    swing = 0.3 * np.sin(2 * np.pi * time_s)
    still = np.zeros_like(swing)
    knees = {s: np.stack([0.5 * k * swing, 0.1 * k + still, 0.5 + still], axis=1) for s, k in signs}
    ankles = {s: np.stack([k * swing, 0.1 * k + still, 0.1 + still], axis=1) for s, k in signs}
    labels = ["LKNE", "RKNE", "LANK", "RANK"]
    markers = np.stack([knees["l"], knees["r"], ankles["l"], ankles["r"]], axis=1)
    assert crossed_limbs(labels, markers) == []
    assert crossed_limbs(labels, markers[:, [0, 1, 3, 2]]) == ["shanks"]
    assert crossed_limbs(labels, markers[:, [1, 0, 3, 2]]) == []
    markers[:, 3] = np.nan
    assert crossed_limbs(labels, markers) == []


def test_whole_limbs_on_the_other_side_of_a_trunk_that_walks():
    """Not told by distances between their own markers, nor by feet one before the other."""
    x, side = np.sin(np.arange(100) / 8.0)[:, None, None], np.array([1.0, -1.0])
    parts = {  # ahead, to the left, swing
        "ASI": (0.1, 0.12, 0.0),
        "PSI": (-0.1, 0.05, 0.0),
        "KNE": (0.0, 0.1, 0.1),
        "ANK": (0.0, 0.1, 0.3),
        "HEE": (-0.1, 0.1, 0.35),
        "TOE": (0.15, 0.1, 0.35),
        "ELB": (0.0, 0.25, 0.05),
    }
    labels = [s + name for name in parts for s in "LR"] + ["C7", "CLAV"]
    markers = np.zeros((100, len(labels), 3))
    ahead, left, swing = np.repeat(np.array([*parts.values()]), 2, axis=0).T
    markers[:, :-2, 0] = ahead + (x * swing[:, None] * np.tile(side, len(parts))[:, None])[..., 0]
    markers[:, :-2, 1] = left * np.tile(side, len(parts))
    markers[:, -2:, 0] = [-0.1, 0.1]

    def exchanged(names):
        swap = {s + one: o + one for one in names for s, o in ("LR", "RL")}
        return handedness([swap.get(label, label) for label in labels], markers).exchanged()

    assert exchanged([]) == []
    assert exchanged(["KNE", "ANK", "HEE", "TOE"]) == ["legs"]
    assert exchanged(["ELB"]) == ["arms"]
    assert exchanged(["ASI", "PSI"]) == ["pelvis"]
    assert handedness(labels, markers * [1, -1, 1]).sign == -1
    # A front and a back of the pelvis exchanged make knees wrong too: one witness, not two.
    turned = {"ASI": "PSI", "PSI": "ASI"}
    wrong = [label[0] + turned.get(label[1:], label[1:]) for label in labels]
    few = [k for k, label in enumerate(labels) if label[1:] in ("ASI", "PSI", "KNE")]
    assert handedness([wrong[k] for k in few], markers[:, few]).sign == 0
