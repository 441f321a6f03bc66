import pytest

from bsip_cli.body.skeleton import load_skeleton
from bsip_cli.config import shipped
from bsip_cli.dynamics.ground_wrench import pinocchio_model
from bsip_cli.errors import UsageError
from bsip_cli.segments import SEGMENTS


def row(name, parent, joint, kind, table="thigh"):
    values = {"name": name, "parent": parent, "joint": joint, "type": kind, "table": table}
    return "[[segments]]\n" + "".join(f'{key} = "{value}"\n' for key, value in values.items())


ROOT = row("lower_torso", "", "root", "free", "pelvis")
GOOD = ROOT + row("thigh_l", "lower_torso", "hip_l", "spherical")


def written(tmp_path, text):
    file = tmp_path / "tree.toml"
    file.write_text(text, encoding="utf-8")
    return str(file)


def test_the_shipped_skeleton_has_the_segments_of_the_contract():
    skeleton = load_skeleton("hansen2017")
    assert set(skeleton.segments) == set(SEGMENTS)
    assert len(skeleton.segments) == len(SEGMENTS) == 15


def test_forty_velocities():
    skeleton = load_skeleton("hansen2017")
    assert len(skeleton.v_names) == len(set(skeleton.v_names)) == 40
    assert len(skeleton.q_names) == len(set(skeleton.q_names)) == 51
    revolute = {
        j for j, k in zip(skeleton.joints, skeleton.joint_types, strict=True) if k[0] == "r"
    }
    assert revolute == {"elbow_l", "elbow_r", "knee_l", "knee_r"}


def test_entries_stand_where_pinocchio_has_them():
    from tests.body.standing_person import standing

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


SHIPPED = shipped("skeletons", "hansen2017.toml").read_text(encoding="utf-8")
ROBERT = shipped("skeletons", "robert17.toml").read_text(encoding="utf-8")
CLAVICLE = row("clavicle_l", "upper_torso", "sternoclavicular_l", "spherical", "")
ELBOW = 'joint = "elbow_l"\ntype = '


def test_one_clavicle_is_enough(tmp_path):
    """A tree of one's own with 16 segments."""
    arm = 'name = "upper_arm_l"\nparent = "upper_torso"'
    assert arm in SHIPPED
    with_rod = SHIPPED.replace(f"[[segments]]\n{arm}", CLAVICLE + f"[[segments]]\n{arm}")
    skeleton = load_skeleton(
        written(tmp_path, with_rod.replace(arm, arm.replace("upper_torso", "clavicle_l")))
    )
    assert len(skeleton.segments) == 16 and len(skeleton.bodies) == 15


def test_a_tree_of_ones_own(tmp_path):
    text = SHIPPED.replace(f'{ELBOW}"revolute"', f'{ELBOW}"spherical"')
    skeleton = load_skeleton(written(tmp_path, text))
    assert skeleton.name == "tree"
    assert len(skeleton.v_names) == 42


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            SHIPPED + row("abdomen", "lower_torso", "lumbar", "spherical"),
            "abdomen, of which neither frame nor mass is known",
        ),
        (SHIPPED + CLAVICLE, "nothing that hangs on clavicle_l"),
        (
            ROBERT.replace('type = "spherical"\ntable = ""', 'type = "revolute"\ntable = ""'),
            "a hinge",
        ),
        (ROBERT.replace('table = ""', 'table = "arm"'), "clavicle_l with the table's row 'arm'"),
        (ROBERT.replace('table = "hand"', 'table = ""'), "hand_l with the table's row ''"),
        (SHIPPED.replace('table = "hand"', 'table = "paw"'), "hand_l with the table's row 'paw'"),
        (ROBERT.replace('"acromion_l"', '"wing"'), "clavicle_l with the unknown landmark wing"),
        (GOOD, "no upper_torso, no head, no upper_arm_l"),
        (SHIPPED.replace('"neck"', '"atlas"'), "head on atlas instead of neck"),
        (
            SHIPPED.replace('"neck"\ntype = "spherical"', '"neck"\ntype = "revolute"'),
            "a hinge at neck, of which no axis is known",
        ),
    ],
)
def test_a_body_that_cannot_be_built_is_refused(tmp_path, text, said):
    with pytest.raises(UsageError, match=said):
        load_skeleton(written(tmp_path, text))


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
    file = written(tmp_path, text)
    with pytest.raises(UsageError, match=r"not a tree|not a skeleton|TOML") as caught:
        load_skeleton(file)
    assert "tree.toml" in str(caught.value)
    assert caught.value.expected


def test_an_unknown_skeleton_names_the_known_ones():
    with pytest.raises(UsageError, match="hansen2017"):
        load_skeleton("hansen2018")
