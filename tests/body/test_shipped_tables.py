"""Marker sets and trees of segments: shipped ones, those of a user, bad ones, names of parts."""

import pytest

from bsip_cli.body.markersets import load_marker_set, shipped_names
from bsip_cli.body.skeleton import load_skeleton
from bsip_cli.dynamics.ground_wrench import pinocchio_model
from bsip_cli.errors import UsageError
from bsip_cli.files.regular import shipped
from bsip_cli.segments import LANDMARKS, SEGMENTS, in_words, mirrored, the_joint, without_side
from tests.body.standing_person import standing, standing_markers

SHIPPED = (
    "biobuddy_ech",
    "hamner_other",
    "hansen2017",
    "helen_hayes",
    "opencap_subject4",
    "plugin_gait",
    "return11_static",
    "sprinter_ja1",
    "van_sint_jan",
)
HANSEN = """RTEM LTEM FHEAD C7 T10 XIPH IJ RSCAP RASIS LASIS RPSIS LPSIS RAC LAC RUA LUA RELB LELB
RFA LFA RWRR RWRU LWRR LWRU RHAND LHAND RKNEL RKNEM LKNEL LKNEM RMALL RMALM LMALL LMALM RCAL LCAL
RMT2 LMT2"""


def written(tmp_path, text, name="mine"):
    file = tmp_path / f"{name}.toml"
    file.write_text(text, encoding="utf-8")
    return str(file)


def test_shipped_sets_are_these():
    assert set(SHIPPED) <= set(shipped_names())


@pytest.mark.parametrize(
    ("other", "name"),
    [
        ("opencap", "opencap_subject4"),
        ("ezc3d_rehazenter_qualisys", "van_sint_jan"),
        ("motionanalysis_helenhayes", "helen_hayes"),
    ],
)
def test_a_set_answers_to_its_other_names(other, name):
    assert load_marker_set(other) == load_marker_set(name)


@pytest.mark.parametrize("name", shipped_names())
def test_every_shipped_set_loads(name):
    marker_set = load_marker_set(name)
    labels = [marker.label for marker in marker_set.markers]
    assert len(labels) == len(set(labels)) > 20
    assert marker_set.description != name
    assert {marker.segment for marker in marker_set.markers} <= set(SEGMENTS)
    assert {marker.landmark for marker in marker_set.markers} - {""} <= LANDMARKS
    assert all(0 < marker.weight <= 1 for marker in marker_set.markers)
    sides = [m for m in marker_set.markers if m.landmark.endswith(("_l", "_r"))]
    centred = {"upper_torso", "lower_torso", "head"}
    assert all(m.segment[-2:] == m.landmark[-2:] for m in sides if m.segment not in centred)


def test_hansen2017_has_the_labels_of_the_contract():
    labels = [marker.label for marker in load_marker_set("hansen2017").markers]
    assert sorted(labels) == sorted(HANSEN.split())
    assert len(labels) == 38
    assert set(standing_markers()) == set(labels)


def test_a_set_of_ones_own(tmp_path):
    text = """description = "Mine"
[segments]
head = { TOP = "vertex", SIDE = "" }
foot_r = { "HEEL.R" = "calcaneus_r" }
[weights]
SIDE = 0.25
[optional]
markers = ["SIDE"]
[aliases]
TOP = ["HEAD1", "HV"]
"""
    mine = load_marker_set(written(tmp_path, text))
    assert mine.name == "mine"
    top, side, heel = mine.markers
    assert (top.landmark, top.weight, top.optional, top.aliases) == (
        "vertex",
        1.0,
        False,
        ("HEAD1", "HV"),
    )
    assert (side.landmark, side.weight, side.optional) == ("", 0.25, True)
    assert (heel.label, heel.segment) == ("HEEL.R", "foot_r")


def test_all_faults_at_once_with_the_nearest_names(tmp_path):
    text = """[segments]
heda = { TOP = "vertex" }
foot_r = { HEEL = "calcaneous_r", TOE = "metatarsal_2_r" }
foot_l = { TOE = "metatarsal_2_l", OUT = "qqqq" }
[weigths]
TOP = 0.5
[weights]
LOST = 0.5
[aliases]
GONE = ["G"]
[optional]
markers = ["AWAY"]
"""
    with pytest.raises(UsageError) as caught:
        load_marker_set(written(tmp_path, text))
    found = str(caught.value)
    for fault in (
        "unknown segment heda (did you mean head?)",
        "HEEL: unknown landmark calcaneous_r (did you mean calcaneus_r?)",
        "OUT: unknown landmark qqqq",
        "TOE stands twice",
        "unknown table weigths (did you mean weights?)",
        "LOST has options but no segment",
        "GONE has options but no segment",
        "AWAY has options but no segment",
    ):
        assert fault in found
    assert "mine.toml" in found


HEAD = 'head = { TOP = "vertex" }\n'
WRONG_TYPES = {
    "segment is no table": ('[segments]\nhead = "TOP"\n', "head"),
    "landmark is a number": ("[segments]\nhead = { TOP = 3 }\n", "TOP"),
    "weight is a word": (f'[segments]\n{HEAD}[weights]\nTOP = "half"\n', "TOP"),
    "weight is negative": (f"[segments]\n{HEAD}[weights]\nTOP = -1\n", "TOP"),
    "aliases are one word": (f'[segments]\n{HEAD}[aliases]\nTOP = "HV"\n', "TOP"),
    "weights are a number": (f"weights = 3\n[segments]\n{HEAD}", "weights"),
    "optional is a list": (f'optional = ["TOP"]\n[segments]\n{HEAD}', "optional"),
    "optional markers are a word": (
        f'[segments]\n{HEAD}[optional]\nmarkers = "TOP"\n',
        "optional markers",
    ),
    "other names are a word": (f'also_called = "x"\n[segments]\n{HEAD}', "also_called"),
    "no segments": ('description = "x"\n', "segments"),
    "not TOML": ("[segments\n", "TOML"),
}


@pytest.mark.parametrize(("text", "named"), WRONG_TYPES.values(), ids=WRONG_TYPES.keys())
def test_wrong_types_are_usage_errors(tmp_path, text, named):
    with pytest.raises(UsageError) as caught:
        load_marker_set(written(tmp_path, text))
    assert named in caught.value.found


def test_an_unknown_set_names_the_known_ones():
    with pytest.raises(UsageError, match="hansen2017, helen_hayes, opencap_subject4"):
        load_marker_set("hansen")


def row(name, parent, joint, kind, table="thigh"):
    values = {"name": name, "parent": parent, "joint": joint, "type": kind, "table": table}
    return "[[segments]]\n" + "".join(f'{key} = "{value}"\n' for key, value in values.items())


ROOT = row("lower_torso", "", "root", "free", "pelvis")
GOOD = ROOT + row("thigh_l", "lower_torso", "hip_l", "spherical")


def test_the_shipped_skeleton_has_fifteen_segments_and_forty_velocities():
    skeleton = load_skeleton("hansen2017")
    assert set(skeleton.segments) == set(SEGMENTS)
    assert len(skeleton.segments) == len(SEGMENTS) == 15
    assert len(skeleton.v_names) == len(set(skeleton.v_names)) == 40
    assert len(skeleton.q_names) == len(set(skeleton.q_names)) == 51
    kinds = zip(skeleton.joints, skeleton.joint_types, strict=True)
    hinges = {joint for joint, kind in kinds if kind == "revolute"}
    assert hinges == {"elbow_l", "elbow_r", "knee_l", "knee_r"}


def test_entries_stand_where_pinocchio_has_them():
    skeleton = load_skeleton("hansen2017")
    model = pinocchio_model(standing().person)
    assert list(model.names)[1:] == list(skeleton.joints)
    assert [model.joints[i + 1].idx_q for i in range(15)] == list(skeleton.q_starts)
    assert [model.joints[i + 1].idx_v for i in range(15)] == list(skeleton.v_starts)


def test_seventeen_segments_of_which_fifteen_have_mass():
    """Robert 2017: clavicles are massless rods between the trunk and the arms."""
    skeleton = load_skeleton("robert17")
    assert len(skeleton.segments) == 17 and len(skeleton.v_names) == 46
    assert {*skeleton.segments} - {*skeleton.body_names} == {"clavicle_l", "clavicle_r"}
    assert {*skeleton.body_names} == {*SEGMENTS}
    assert skeleton.body_names == tuple(skeleton.segments[i] for i in skeleton.bodies)
    arm = skeleton.segments[skeleton.parents[skeleton.index("upper_arm_r")]]
    assert arm == "clavicle_r"


def test_a_marker_rides_on_the_link_that_its_landmark_moves_with():
    plain, girdle = load_skeleton("hansen2017"), load_skeleton("robert17")
    for landmark, rides in (("acromion_r", "clavicle_r"), ("c7", "upper_torso"), ("", "head")):
        named = "head" if not landmark else "upper_torso"
        assert girdle.carrying(named, landmark) == rides
        assert plain.carrying(named, landmark) == named


def test_sides():
    skeleton = load_skeleton("hansen2017")
    sides = [skeleton.side(name) for name in ("foot_l", "foot_r", "head", "lower_torso")]
    assert sides == ["l", "r", "", ""]


HANSEN_TREE = shipped("skeletons", "hansen2017.toml").read_text(encoding="utf-8")
ROBERT_TREE = shipped("skeletons", "robert17.toml").read_text(encoding="utf-8")
CLAVICLE = row("clavicle_l", "upper_torso", "sternoclavicular_l", "spherical", "")
ELBOW = 'joint = "elbow_l"\ntype = '


def test_one_clavicle_is_enough(tmp_path):
    """A tree of one's own with 16 segments."""
    arm = 'name = "upper_arm_l"\nparent = "upper_torso"'
    assert arm in HANSEN_TREE
    with_rod = HANSEN_TREE.replace(f"[[segments]]\n{arm}", CLAVICLE + f"[[segments]]\n{arm}")
    tree = with_rod.replace(arm, arm.replace("upper_torso", "clavicle_l"))
    skeleton = load_skeleton(written(tmp_path, tree))
    assert len(skeleton.segments) == 16 and len(skeleton.bodies) == 15


def test_a_tree_of_ones_own(tmp_path):
    text = HANSEN_TREE.replace(f'{ELBOW}"revolute"', f'{ELBOW}"spherical"')
    skeleton = load_skeleton(written(tmp_path, text, "tree"))
    assert skeleton.name == "tree"
    assert len(skeleton.v_names) == 42


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            HANSEN_TREE + row("abdomen", "lower_torso", "lumbar", "spherical"),
            "abdomen, of which neither frame nor mass is known",
        ),
        (HANSEN_TREE + CLAVICLE, "nothing that hangs on clavicle_l"),
        (
            ROBERT_TREE.replace('type = "spherical"\ntable = ""', 'type = "revolute"\ntable = ""'),
            "a hinge",
        ),
        (
            ROBERT_TREE.replace('table = ""', 'table = "arm"'),
            "clavicle_l with the table's row 'arm'",
        ),
        (ROBERT_TREE.replace('table = "hand"', 'table = ""'), "hand_l with the table's row ''"),
        (
            HANSEN_TREE.replace('table = "hand"', 'table = "paw"'),
            "hand_l with the table's row 'paw'",
        ),
        (
            ROBERT_TREE.replace('"acromion_l"', '"wing"'),
            "clavicle_l with the unknown landmark wing",
        ),
        (GOOD, "no upper_torso, no head, no upper_arm_l"),
        (HANSEN_TREE.replace('"neck"', '"atlas"'), "head on atlas instead of neck"),
        (
            HANSEN_TREE.replace('"neck"\ntype = "spherical"', '"neck"\ntype = "revolute"'),
            "a hinge at neck, of which no axis is known",
        ),
    ],
)
def test_a_body_that_cannot_be_built_is_refused(tmp_path, text, said):
    with pytest.raises(UsageError, match=said):
        load_skeleton(written(tmp_path, text, "tree"))


CHILD = row("shank_l", "thigh_l", "knee_l", "revolute")
BAD = {
    "no base": row("thigh_l", "thigh_l", "hip_l", "spherical"),
    "base is no free joint": row("lower_torso", "", "root", "spherical"),
    "two bases": ROOT + row("thigh_l", "", "hip_l", "free"),
    "a free joint within": ROOT + row("thigh_l", "lower_torso", "hip_l", "free"),
    "child before its parent": ROOT + CHILD + row("thigh_l", "lower_torso", "hip_l", "spherical"),
    "its own parent": ROOT + row("thigh_l", "thigh_l", "hip_l", "spherical"),
    "a parent that is not there": ROOT + row("thigh_l", "pelvis", "hip_l", "spherical"),
    "an unknown joint type": ROOT + row("thigh_l", "lower_torso", "hip_l", "universal"),
    "a missing entry": ROOT + '[[segments]]\nname = "thigh_l"\n',
    "a segment twice": GOOD + row("thigh_l", "lower_torso", "hip_r", "spherical"),
    "a joint twice": GOOD + row("thigh_r", "lower_torso", "hip_l", "spherical"),
    "no segment": "segments = []\n",
    "segments that are no rows": 'segments = ["head"]\n',
    "a number for a table": "segments = 3\n",
    "no table": 'name = "tree"\n',
    "not TOML": "[[segments\n",
}


@pytest.mark.parametrize("text", BAD.values(), ids=BAD.keys())
def test_bad_trees_are_refused(tmp_path, text):
    file = written(tmp_path, text, "tree")
    with pytest.raises(UsageError, match=r"not a tree|not a skeleton|TOML") as caught:
        load_skeleton(file)
    assert "tree.toml" in str(caught.value)
    assert caught.value.expected


def test_an_unknown_skeleton_names_the_known_ones():
    with pytest.raises(UsageError, match="hansen2017"):
        load_skeleton("hansen2018")


def test_every_segment_has_its_mirror():
    assert {mirrored(name) for name in SEGMENTS} == set(SEGMENTS)
    assert all(mirrored(mirrored(name)) == name for name in SEGMENTS)
    assert [mirrored(name) for name in ("hand_l", "foot_r", "head")] == ["hand_r", "foot_l", "head"]


@pytest.mark.parametrize(
    ("said", "name", "words"),
    [
        (in_words, "elbow_l", "left elbow"),
        (in_words, "upper_arm_r", "right upper arm"),
        (in_words, "lower_torso", "lower torso"),
        (in_words, "waist", "waist"),
        (in_words, "knee_lateral_r", "right knee lateral"),
        (the_joint, "root", "the whole body"),
        (the_joint, "wrist_r", "the right wrist"),
        (without_side, "hand_l", "hand"),
        (without_side, "upper_arm_r", "upper_arm"),
        (without_side, "head", "head"),
        (without_side, "upper_torso", "upper_torso"),
    ],
)
def test_names_in_words(said, name, words):
    assert said(name) == words
