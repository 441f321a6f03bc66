"""Which marker set a recording uses, and what labels of many laboratories mean by their words."""

from __future__ import annotations

import json

import numpy as np
import pytest

from bsip_cli.body.markersets import MarkerSet, load_marker_set, shipped_names
from bsip_cli.errors import BadDataError
from bsip_cli.recordings.label_words import Meaning, meaning_of, meanings
from bsip_cli.recordings.marker_guess import guess_marker_set
from bsip_cli.recordings.read import read_recording
from bsip_cli.segments import LANDMARKS, SEGMENTS
from tests.recordings.label_lists import LabelList, label_lists

OF_REAL_FILES = {
    "biobuddy_ech/right_knee.c3d": "biobuddy_ech",
    "btk_functional_ll/FunctionalWalk.c3d": "plugin_gait",
    "btk_pig/PiG_Motion-FlatFoot-Full.c3d": "plugin_gait",
    "c3dorg_plate_types/analogfpscale04.c3d": "plugin_gait+words",
    "c3dorg_plate_types/Static Pose.c3d": "words",
    "edge_ezc3d/FP_Type1.c3d": "words",
    "edge_ezc3d/FP_Type3.c3d": "words",
    "edge_nimble/trial2.c3d": "helen_hayes+words",
    "golf_french/static.c3d": "words",
    "type3_running_kistler/Running_0002.c3d": "words",
    "zoo_children/HC030A-static.c3d": "plugin_gait",
    "edge_btk/Gait.c3d": "helen_hayes",
    "ezc3d_rehazenter_qualisys/Qualisys.c3d": "van_sint_jan",
    "hamner_other/run200.trc": "hamner_other",
    "ktk_walk_and_serve/kinematics_tennis_serve.c3d": "plugin_gait",
    "ktk_walk_and_serve/walk.c3d": "plugin_gait",
    "motionanalysis_helenhayes/Sample_Jump2.c3d": "helen_hayes",
    "opencap_subject4/squats1.trc": "opencap_subject4",
    "opensim_walking/walking2.c3d": "hamner_other+words",
    "pycgm/Sample_Static.c3d": "plugin_gait",
    "return11_static/c3dfile1.c3d": "return11_static",
    "sprinter_ja1/JA1Gait35.c3d": "sprinter_ja1",
    "squat2_pig61/markers.trc": "plugin_gait",
}
OF_NO_SET = (
    "edge_nimble/JH_01.c3d",
    "edge_c3dorg/Dance.c3d",
    "c3dorg_plate_types/FP1.C3D",
    "edge_custom/Record_12.c3d",
)


@pytest.mark.parametrize("prefix", ["", "Subject_01:", "A:B:"])
@pytest.mark.parametrize("name", shipped_names())
def test_each_set_is_guessed_from_its_own_labels(name, prefix):
    labels = [f"{prefix}{marker.label}" for marker in load_marker_set(name).markers]
    assert guess_marker_set(labels).name == name


@pytest.mark.parametrize("name", shipped_names())
def test_each_set_is_guessed_without_its_optional_markers_and_with_a_quarter_lost(name):
    labels = [m.label for m in load_marker_set(name).markers if not m.optional]
    kept = np.random.default_rng(0).permutation(labels)[: int(0.75 * len(labels))]
    assert guess_marker_set([*kept, "*12", "stick_1", "stick_2"]).name == name


def test_aliases_and_case_count():
    aliases = {"RASIS": "rasi", "LASIS": "Lasi", "RPSIS": "RPSI", "LPSIS": "LPSI "}
    labels = [m.label for m in load_marker_set("hansen2017").markers]
    assert guess_marker_set([aliases.get(name, name) for name in labels]).name == "hansen2017"


def test_labels_that_fit_no_set_are_refused_with_a_remedy():
    with pytest.raises(BadDataError) as caught:
        guess_marker_set(["M001", "M002", "C7"])
    assert "hansen2017" in str(caught.value)
    assert "marker_set" in caught.value.remedy
    assert "M001" in caught.value.found


def test_the_lower_half_of_a_set_is_enough():
    labels = "LASI RASI LPSI RPSI LTHI LKNE LTIB LANK LHEE LTOE RTHI RKNE RTIB RANK RHEE RTOE"
    assert guess_marker_set(labels.split()).name == "plugin_gait"
    more = guess_marker_set([*labels.split(), "LFIB", "RFIB"])
    assert more.base and more.base.marker_set.name == "plugin_gait"
    assert {m.label: m.segment for m in more.marker_set.markers}["LFIB"] == "shank_l"


NEAR = {  # labels of a shipped set, with some of another lab's own
    "plugin_gait": (
        "RASI LASI RPSI LPSI RKNE LKNE RANK LANK RHEE LHEE RTOE LTOE C7 CLAV STRN RSHO LSHO RELB "
        "LELB RFHD LFHD RBHD LBHD T10 RFIN LFIN RWristLat LWristLat RThighLat LThighLat RShankLat "
        "LShankLat R5thMet L5thMet",
        {"R5thMet": "metatarsal_5_r", "LWristLat": "styloid_radial_l", "RThighLat": ""},
    ),
    "hansen2017": (
        "RASIS LASIS RPSIS LPSIS C7 T10 XIPH IJ RAC LAC RELB LELB RKNEL LKNEL RKNEM LKNEM RMALL "
        "LMALL RMALM LMALM RCAL LCAL RToe LToe RFootLat LFootLat",
        {"RToe": "metatarsal_2_r", "LFootLat": ""},
    ),
    "van_sint_jan": (
        "L_IAS R_IAS L_IPS R_IPS CV7 SJN SXS L_SAJ R_SAJ L_FLE R_FLE L_FME R_FME L_FAL R_FAL L_TAM "
        "R_TAM L_FCC R_FCC L_FM1 R_FM1 L_FM5 R_FM5 L_HLE R_HLE L_HME R_HME Left_Wrist Right_Wrist",
        {"Left_Wrist": "wrist_l"},
    ),
}


@pytest.mark.parametrize("name", NEAR)
def test_near_misses_are_completed_by_words(name):
    labels, expected = NEAR[name][0].split(), NEAR[name][1]
    guess = guess_marker_set(labels)
    assert guess.name == f"{name}+words" and not guess.unknown and not guess.lacking()
    landmarks = {m.label: m.landmark for m in guess.marker_set.markers}
    assert {label: landmarks[label] for label in expected} == expected
    (finding,) = guess.findings()
    assert f"{name} fits partly" in finding.found


def test_a_set_of_words_says_what_it_took_and_what_not():
    labels = "EIASG EIASD SACRUM GENOUG GENOUD CHEVILLEG CHEVILLED TALONG TALOND ORTEILG ORTEILD"
    guess = guess_marker_set([*labels.split(), "C7", "CUISSEG", "CUISSED", "QQQ"], source="a.c3d")
    (finding,) = guess.findings()
    assert "GENOUG = left knee lateral" in finding.action and "2 more only track" in finding.action
    assert finding.action.endswith("not understood: QQQ")


@pytest.mark.parametrize(
    ("without", "named"),
    [
        ("TALON ORTEIL", r"the left foot .the heel and a metatarsal., the right foot"),
        ("SACRUM EIAS", r"the lower torso .both ASIS"),
        ("GENOU", r"the left thigh .*the right thigh"),
    ],
)
def test_what_is_missing_for_which_segment(without, named):
    labels = "EIASG EIASD SACRUM GENOUG GENOUD CHEVILLEG CHEVILLED TALONG TALOND ORTEILG ORTEILD"
    kept = [label for label in labels.split() if not label.startswith(tuple(without.split()))]
    with pytest.raises(BadDataError, match=named) as caught:
        guess_marker_set(kept, source="'my trial.c3d'")
    assert "`bsip markers 'my trial.c3d'`" in caught.value.remedy


def test_labels_that_several_columns_share_are_no_markers():
    labels = [m.label for m in load_marker_set("hansen2017").markers][:-4]
    guess = guess_marker_set([*labels, "RFoot", "RFoot", "LFoot"])
    names = [marker.label for marker in guess.marker_set.markers]
    assert "LFoot" in names and "RFoot" not in names


def test_a_set_survives_as_data():
    made = guess_marker_set(
        ["RASI", "LASI", "SACR", "RKNEE", "LKNEE", "RANK", "LANK", "RHEE", "LHEE", "RTOE", "LTOE"]
    )
    assert MarkerSet.from_data(json.loads(json.dumps(made.marker_set.as_data()))) == made.marker_set


@pytest.mark.real
@pytest.mark.parametrize(("name", "expected"), OF_REAL_FILES.items())
def test_sets_of_real_recordings(real_data, name, expected):
    assert guess_marker_set(read_recording(real_data / name).labels).name == expected


@pytest.mark.real
@pytest.mark.parametrize("name", OF_NO_SET)
def test_real_recordings_of_no_shipped_set(real_data, name):
    with pytest.raises(BadDataError, match="no known marker set fits"):
        guess_marker_set(read_recording(real_data / name).labels)


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
    assert meaning is not None and meaning.landmark == landmark and landmark in LANDMARKS
    assert meaning.segment in SEGMENTS


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


def test_initials_are_understood_where_other_labels_have_others():
    clusters = [f"{s}{h}{a}{side}" for s in "FTB" for h in "HB" for a in "AP" for side in "GD"]
    clusters.remove("FBPG")  # a cluster of three
    wrists = ["PSRG", "PSUG", "PSRD", "PSUD"]
    found = meanings([*clusters, *wrists, "EIASG", "EIASD", "Genou_G", "Genou_D", "Poignet_G"])
    assert {label for label in clusters if label in found} == {*clusters}
    assert {found[label].segment for label in ("FHAG", "FHPG", "FBAG")} == {"thigh_l"}
    assert found["PSRG"].landmark == "styloid_radial_l"
    assert found["PSUD"].landmark == "styloid_ulnar_r"


@pytest.mark.parametrize("words", ["ruka noga glava", "haft hoft hond", "kolano stopa udo"])
def test_words_of_other_languages_are_no_initials(words):
    labels = [f"{word}_{side}" for word in words.split() for side in "GD"]
    assert not {*meanings(["C7", "EIASG", "EIASD", *labels])} & {*labels}


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


def test_numbered_labels_of_one_stem_sit_on_one_segment():
    markers = load_marker_set("opencap_subject4").markers
    labels = [f"{m.label}_study" for m in markers if m.segment != "hand_l"]
    guess = guess_marker_set([*labels, "r_sh1_study", "L_sh1_study", "RHJC_study", "Wand7Q_study"])
    segments = {marker.label: marker.segment for marker in guess.marker_set.markers}
    assert segments["r_sh1"] == "shank_r" and segments["L_sh1"] == "shank_l"
    (said,) = guess.findings()
    assert said.action.endswith("not understood: Wand7Q; no markers on the body: RHJC")
