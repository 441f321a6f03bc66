"""Labels of many laboratories, told by their words."""

from __future__ import annotations

import pytest

from bsip_cli.body.markersets import LANDMARKS, load_marker_set
from bsip_cli.body.names import SEGMENTS
from bsip_cli.recordings.label_words import Meaning, meaning_of, meanings

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
