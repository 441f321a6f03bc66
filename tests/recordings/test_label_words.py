"""Labels of many laboratories, told by their words."""

from __future__ import annotations

import pytest

from bsip_cli.body.markersets import load_marker_set
from bsip_cli.recordings.label_words import Meaning, meaning_of, meanings
from bsip_cli.segments import LANDMARKS, SEGMENTS
from tests.recordings.label_lists import LabelList, label_lists

SPELLINGS = {
    "knee_lateral_r": "RKNE R.Knee r_knee RKneeLat R_FLE RLFC RLEPI KNE_R RightKnee Subject:RKNEL",
    "knee_medial_l": "LKNM L_FME LMFE L.Knee.Medial LMKN LKneeMed L_mknee",
    "malleolus_lateral_l": "LANK L_ankle LFAL LLMAL LMALL LAnkleLat LLM",
    "malleolus_medial_r": "RMMAL RMALM R_TAM RSPH R.Ankle.Medial r_mankle",
    "asis_l": "LASI L.ASIS LASIS L_IAS l_asis LIAS",
    "psis_r": "RPSI RPSIS R_IPS r.PSIS RBackAsis",
    "calcaneus_l": "LHEE LCAL L_FCC L_calc LHeel",
    "metatarsal_5_r": "RMT5 R_FM5 RM5 r_5meta RMFH5 RP5MT",
    "acromion_r": "RSHO RAC RACR R_SAJ RAcromium R.Shoulder",
    "styloid_radial_l": "LWRA LWRR L_RSP LRS LWristLat L_wrist_radius LFAradius",
    "c7": "C7 CV7 c7",
    "sacrum": "SACR VSAC Sacrum V.Sacral",
}


@pytest.mark.parametrize(
    ("landmark", "label"),
    [(landmark, label) for landmark, labels in SPELLINGS.items() for label in labels.split()],
)
def test_spellings(landmark, label):
    meaning = meaning_of(label)
    assert meaning is not None and meaning.landmark == landmark


@pytest.mark.parametrize("label", ["0001", "M1", "", "*12", "R", "L", "Ball", "BL"])
def test_what_says_nothing_is_not_understood(label):
    assert meaning_of(label) is None


@pytest.mark.parametrize("name", ["hansen2017", "plugin_gait", "hamner_other"])
def test_shipped_sets_are_understood_whole(name):
    markers = load_marker_set(name).markers
    found = meanings([marker.label for marker in markers])
    assert found == {m.label: Meaning(m.segment, m.landmark) for m in markers}


def test_a_landmark_has_one_label():
    found = meanings(["LHeel", "LHEE2", "LCAL", "LTHI", "LTHI2"])
    assert found["LCAL"].landmark == "calcaneus_l" and found["LHeel"].landmark == ""
    assert found["LTHI"] == found["LTHI2"] == Meaning("thigh_l", "")


def test_everything_said_exists():
    for labels in SPELLINGS.values():
        for label in labels.split():
            meaning = meaning_of(label)
            assert meaning and meaning.segment in SEGMENTS and meaning.landmark in LANDMARKS


@pytest.mark.parametrize("labels", label_lists(), ids=lambda one: one.name)
def test_lists_of_languages_and_systems(labels: LabelList):
    assert labels.faults(meanings(labels.labels)) == []


@pytest.mark.parametrize(
    "affix", ["Anna:{}", "S01_{}", "S01 {}", "subj-{}", "P.{}", "{}_1", "{}-Raw"]
)
@pytest.mark.parametrize("number", [1, 7, 15])
def test_what_all_labels_begin_or_end_with_does_not_count(affix, number):
    labels = label_lists()[number]
    found = meanings([affix.format(label) for label in labels.labels])
    assert labels.faults({label: found.get(affix.format(label)) for label in labels.labels}) == []


def test_two_people_with_an_underscore_are_each_understood():
    labels = label_lists()[7]
    found = meanings([f"{name}_{label}" for label in labels.labels for name in "AB"])
    for name in "AB":
        assert labels.faults({n: found.get(f"{name}_{n}") for n in labels.labels}) == []


def test_the_other_side_settles_what_a_letter_is():
    alone = meanings(["CLD", "EASD", "MLD", "CALD", "GENOUD"])
    pair = meanings(["RLE", "RME", "RLM", "RMM", "LLE", "LME", "LLM", "LMM", "RCA", "LCA"])
    assert alone["CLD"].landmark == "knee_lateral_r"
    assert pair["RLE"].landmark == "knee_lateral_r" and pair["LMM"].landmark == "malleolus_medial_l"


@pytest.mark.parametrize("stem", ["LTHI", "L_Knee_", "ROberarm", "L.Shank."])
def test_three_of_a_stem_are_a_cluster_and_only_track(stem):
    found = meanings([f"{stem}{k}" for k in (1, 2, 3)])
    assert len(found) == 3 and {meaning.landmark for meaning in found.values()} == {""}


def test_a_word_is_not_understood_by_its_letters():
    labels = [f"{word}_{side}" for word in ("bark", "palec", "armbage") for side in "LPVH"]
    assert meanings(["C7", *labels]).keys() == {"C7"}


@pytest.mark.parametrize("sides", ["GD", "ID", "SD", "ED"])
def test_english_words_with_the_sides_of_another_language(sides):
    left, right = sides
    words = ("ASI", "PSI", "KNE", "ANK", "HEE", "THI")
    found = meanings([f"{s}{word}" for s in sides for word in words])
    assert found[f"{left}THI"].segment == "thigh_l" and found[f"{right}THI"].segment == "thigh_r"
    assert found[f"{right}KNE"].landmark == "knee_lateral_r"


def test_drawn_frames_are_no_markers():
    found = meanings(["LHEE", "LHDF0", "LHDF1", "LHDF2", "LHDF3", "LFHD"])
    assert set(found) == {"LHEE", "LFHD"}


def test_absurd_labels_take_no_time_and_no_memory():
    labels = [f"{'lamtrk' * 500}{k}" for k in range(200)] + ["9" * 6000, "²³", "\x00", "L" * 59]
    assert meanings(labels) == {}
