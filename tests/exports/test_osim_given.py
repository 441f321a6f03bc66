"""A given OpenSim model gets the person's inertias, in its own bodies and frames."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from bsip_cli.body.exports.identified import neutral_pose
from bsip_cli.body.exports.osim import (
    check_fits,
    check_segments,
    fitting_map,
    load_body_map,
    read_given_model,
    shipped_names,
    with_inertias,
)
from bsip_cli.errors import UsageError
from tests.exports.exported_person import our_model, whole_body

# Frames of bodies that are not where our segments' joints are: from our joint, our axes.
_AWAY = {
    "pelvis": ("lower_torso", (0.07, 0.03, 0.0)),
    "torso": ("upper_torso", (0.0, 0.0, 0.0)),
    "calcn_r": ("foot_r", (-0.05, -0.04, 0.01)),
    "talus_r": ("foot_r", (0.0, 0.0, 0.0)),
    "toes_r": ("foot_r", (0.12, -0.045, 0.01)),
    "calcn_l": ("foot_l", (-0.05, -0.04, -0.01)),
    "talus_l": ("foot_l", (0.0, 0.0, 0.0)),
    "toes_l": ("foot_l", (0.12, -0.045, -0.01)),
    "radius_r": ("forearm_r", (-0.006, -0.013, 0.026)),
    "radius_l": ("forearm_l", (-0.006, -0.013, -0.026)),
}
_SAME = {
    "femur": "thigh",
    "tibia": "shank",
    "humerus": "upper_arm",
    "ulna": "forearm",
    "hand": "hand",
}
_TREE = {
    "pelvis": "ground",
    "torso": "pelvis",
    **{f"femur_{side}": "pelvis" for side in "rl"},
    **{f"tibia_{side}": f"femur_{side}" for side in "rl"},
    **{f"talus_{side}": f"tibia_{side}" for side in "rl"},
    **{f"calcn_{side}": f"talus_{side}" for side in "rl"},
    **{f"toes_{side}": f"calcn_{side}" for side in "rl"},
}
_ARMS = {
    **{f"humerus_{side}": "torso" for side in "rl"},
    **{f"ulna_{side}": f"humerus_{side}" for side in "rl"},
    **{f"radius_{side}": f"ulna_{side}" for side in "rl"},
    **{f"hand_{side}": f"radius_{side}" for side in "rl"},
}
_MASSES = {"calcn": 1.25, "talus": 0.1, "toes": 0.22, "ulna": 0.6, "radius": 0.5, "patella": 0.09}


@dataclass(frozen=True)
class Drawn:
    """A model drawn around the person: its text, and where its bodies lie at zero coordinates."""

    text: str
    placed: dict[str, pin.SE3]

    def read(self):
        return read_given_model(self.text.encode(), "given.osim")


def draw(body, arms: bool) -> Drawn:
    """Bodies as published models have them; joints have the person's centres."""
    rotations, joints = neutral_pose(body.person)
    index = body.person.skeleton.index
    placed = {"ground": pin.SE3.Identity()}
    tree = _TREE | (_ARMS if arms else {})
    for name in tree:
        segment, shift = _AWAY.get(name, (None, (0, 0, 0)))
        bone, _, side = name.partition("_")
        at = index(segment or f"{_SAME[bone]}_{side}")
        placed[name] = pin.SE3(rotations[at], joints[at] + rotations[at] @ np.array(shift))
        if bone in ("toes", "radius"):  # not the first of their group: their axes may be any
            placed[name] *= pin.SE3(pin.rpy.rpyToMatrix(0.4, -0.3, 0.5), np.zeros(3))
    root = ET.Element("OpenSimDocument", Version="40500")
    root.append(ET.Comment("drawn for a test"))
    model = ET.SubElement(root, "Model", name="given")
    bodies = ET.SubElement(ET.SubElement(model, "BodySet", name="bodyset"), "objects")
    links = ET.SubElement(ET.SubElement(model, "JointSet", name="jointset"), "objects")
    for name, parent in tree.items():
        _add_body(bodies, name)
        # The joint's frames are turned and lie where the child's own joint to its parent is.
        turn = pin.rpy.rpyToMatrix(0.2, -0.1, 0.3)
        centre = placed[name] * pin.SE3(turn, np.zeros(3))
        if name.startswith(("calcn", "toes")):
            centre = placed[name] * pin.SE3(turn, np.array([0.01, 0.02, 0.0]))
        kind = "FreeJoint" if parent == "ground" else "PinJoint"
        _add_joint(links, kind, f"to_{name}", parent, name, placed, centre)
    _add_body(bodies, "patella_r")
    _add_joint(links, "WeldJoint", "to_patella_r", "tibia_r", "patella_r",
               placed | {"patella_r": placed["tibia_r"]}, placed["tibia_r"])  # fmt: skip
    ET.SubElement(model, "credits").text = "nobody"
    return Drawn(ET.tostring(root, encoding="unicode"), placed)


def _add_body(bodies: ET.Element, name: str) -> None:
    element = ET.SubElement(bodies, "Body", name=name)
    ET.SubElement(element, "mass").text = str(_MASSES.get(name.partition("_")[0], 3.0))
    ET.SubElement(element, "mass_center").text = "0 0 0"
    ET.SubElement(element, "inertia").text = "0.01 0.01 0.01 0 0 0"


def _add_joint(links, kind, name, parent, child, placed, centre) -> None:
    joint = ET.SubElement(links, kind, name=name)
    ET.SubElement(joint, "socket_parent_frame").text = f"{parent}_offset"
    ET.SubElement(joint, "socket_child_frame").text = f"{child}_offset"
    frames = ET.SubElement(joint, "frames")
    for end in (parent, child):
        offset = placed[end].actInv(centre)
        element = ET.SubElement(frames, "PhysicalOffsetFrame", name=f"{end}_offset")
        socket = "/ground" if end == "ground" else f"/bodyset/{end}"
        ET.SubElement(element, "socket_parent").text = socket
        angles = Rotation.from_matrix(offset.rotation).as_euler("XYZ")
        for name, numbers in (("translation", offset.translation), ("orientation", angles)):
            ET.SubElement(element, name).text = " ".join(map(repr, numbers.tolist()))


def inertias_in(text: str) -> dict[str, pin.Inertia]:
    """Bodies of an .osim file, about their frames."""
    found = {}
    for element in ET.fromstring(text).iterfind("Model/BodySet/objects/Body"):
        xx, yy, zz, xy, xz, yz = (float(word) for word in element.findtext("inertia").split())
        com = np.array([float(word) for word in element.findtext("mass_center").split()])
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        found[element.get("name")] = pin.Inertia(float(element.findtext("mass")), com, tensor)
    return found


def in_world(drawn: Drawn, text: str, names) -> pin.Inertia:
    """These bodies as one, at zero coordinates."""
    found = inertias_in(text)
    parts = [drawn.placed[name].act(found[name]) for name in names]
    return sum(parts[1:], start=parts[0])


@pytest.fixture(scope="module", params=["rajagopal", "gait2392"])
def case(request, identified):
    """A drawn model, the map that fits it, and the result."""
    drawn = draw(identified, arms=request.param == "rajagopal")
    model = drawn.read()
    body_map = fitting_map(model.masses_kg)
    check_segments(body_map, identified.person.skeleton)
    check_fits(model, body_map)
    return request.param, drawn, body_map, with_inertias(model, body_map, identified)


def test_the_right_map_is_found(case):
    name, _, body_map, _ = case
    assert body_map.name == name
    assert set(shipped_names()) == {"gait2392", "rajagopal"}
    assert fitting_map(["pelvis", "torso"]) is None


def test_the_whole_person_is_in_the_model(case, identified):
    """Upright, the model's bodies together are the person's segments together."""
    _, drawn, body_map, result = case
    own = our_model(identified)
    q = pin.neutral(own)
    wanted = whole_body(own, q, np.zeros(own.nv))
    found = in_world(drawn, result.text, body_map.bodies())
    assert found.mass == pytest.approx(identified.mass_kg, rel=1e-12)
    assert found.lever == pytest.approx(wanted.com_m, abs=1e-12)
    assert found.inertia == pytest.approx(wanted.inertia_kgm2, abs=1e-10)
    assert max(result.misfit_m.values()) < 1e-12


def test_every_group_is_its_segments(case, identified):
    """Also where bodies share a segment, and where one body unites several."""
    _, drawn, body_map, result = case
    own = our_model(identified)
    data = own.createData()
    pin.forwardKinematics(own, data, pin.neutral(own))
    for group in body_map.groups:
        at = [identified.person.skeleton.index(name) + 1 for name in group.segments]
        parts = [data.oMi[i].act(own.inertias[i]) for i in at]
        wanted = sum(parts[1:], start=parts[0])
        found = in_world(drawn, result.text, group.bodies)
        assert found.mass == pytest.approx(wanted.mass, rel=1e-12)
        assert found.lever == pytest.approx(wanted.lever, abs=1e-12)
        assert found.inertia == pytest.approx(wanted.inertia, abs=1e-11)


def test_bodies_share_as_they_did(case):
    _, _, body_map, result = case
    found = inertias_in(result.text)
    for group in body_map.groups:
        before = [_MASSES.get(name.partition("_")[0], 3.0) for name in group.bodies]
        after = [found[name].mass for name in group.bodies]
        assert np.divide(after, sum(after)) == pytest.approx(np.divide(before, sum(before)))


def test_says_what_it_assumed_and_left(case, identified):
    _, _, body_map, result = case
    assert result.untouched == {"patella_r": 0.09}
    for words in ("0 mm", "patella_r stay as they were (0.09 kg)", "X anterior, Y up, Z right"):
        assert words in result.sentence
    for words in (body_map.name, *result.sentence.split("; "), "participant sub-01, method OM"):
        assert words in result.text


def test_nothing_else_changes(case, identified):
    """Apart from the comment on top and the three entries of the mapped bodies."""
    _, drawn, body_map, result = case
    before, after = ET.fromstring(drawn.text), ET.fromstring(result.text)
    for root in (before, after):
        for element in root.iterfind("Model/BodySet/objects/Body"):
            if element.get("name") in body_map.bodies():
                for tag in ("mass", "mass_center", "inertia"):
                    element.remove(element.find(tag))
    assert ET.canonicalize(ET.tostring(before), strip_text=True) == ET.canonicalize(
        ET.tostring(after), strip_text=True
    )
    assert "drawn for a test" in result.text


def test_a_model_of_another_size_is_told(identified):
    """Its hips are 4 cm wider: the misfit is named."""
    drawn = draw(identified, arms=True)
    root = ET.fromstring(drawn.text)
    for side, shift in (("r", 0.02), ("l", -0.02)):
        frame = root.find(f".//PinJoint[@name='to_femur_{side}']//*[@name='pelvis_offset']")
        x, y, z = (float(word) for word in frame.findtext("translation").split())
        frame.find("translation").text = f"{x} {y} {z + shift}"
    model = read_given_model(ET.tostring(root), "given.osim")
    result = with_inertias(model, load_body_map("rajagopal"), identified)
    assert result.misfit_m["pelvis"] == pytest.approx(0.02, abs=1e-9)
    assert "differ by up to 20 mm (pelvis)" in result.sentence


def test_opensim_reads_it(case, identified, tmp_path):
    opensim = pytest.importorskip("opensim", reason="the opensim package is not installed")
    opensim.Logger.setLevelString("error")
    _, _, _, result = case
    file = tmp_path / "given.osim"
    file.write_text(result.text, encoding="utf-8")
    model = opensim.Model(str(file))
    state = model.initSystem()
    assert model.getTotalMass(state) == pytest.approx(identified.mass_kg + 0.09, rel=1e-12)
    own = our_model(identified)
    wanted = identified.mass_kg * pin.centerOfMass(own, own.createData(), pin.neutral(own))
    patella = (
        model.getBodySet().get("patella_r").findStationLocationInGround(state, opensim.Vec3(0))
    )
    found = model.calcMassCenterPosition(state).to_numpy() * model.getTotalMass(state)
    assert found - 0.09 * patella.to_numpy() == pytest.approx(wanted, abs=1e-9)


# --- what cannot be used ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"not xml", "cannot be read as a model"),
        (b"<robot/>", "cannot be read as a model (robot)"),
        (b'<OpenSimDocument Version="30000"><Model/></OpenSimDocument>', "version 30000"),
        (b'<OpenSimDocument Version="40000"/>', "OpenSimDocument"),
        (
            b'<OpenSimDocument Version="40000"><Model><BodySet><objects><Body name="a"><mass>nan'
            b"</mass></Body></objects></BodySet></Model></OpenSimDocument>",
            "'nan' instead of a number",
        ),
        (
            b'<OpenSimDocument Version="40000"><Model><JointSet><objects><PinJoint name="a">'
            b"</PinJoint></objects></JointSet></Model></OpenSimDocument>",
            "a joint without frames",
        ),
    ],
)
def test_file_that_is_no_model(content, said):
    with pytest.raises(UsageError, match="To correct it: open the model in OpenSim 4") as error:
        read_given_model(content, "given.osim")
    assert said in str(error.value)


def test_map_that_does_not_fit(identified, tmp_path):
    legs = draw(identified, arms=False).read()
    with pytest.raises(UsageError, match="has no body hand_l, hand_r, humerus_l"):
        check_fits(legs, load_body_map("rajagopal"))
    file = tmp_path / "own.toml"
    file.write_text(
        '[[groups]]\nbodies = ["pelvis", "toes_r"]\nsegments = ["lower_torso"]\n'
        'joints = [["thigh_r", "femur_r"]]\n'
    )
    own = load_body_map(str(file))
    with pytest.raises(UsageError, match="pelvis, toes_r: its bodies are not joined"):
        check_fits(legs, own)
    with pytest.raises(UsageError, match="left out: upper_torso, head"):
        check_segments(own, identified.person.skeleton)
    file.write_text('[[groups]]\nbodies = ["pelvis"]\n')
    with pytest.raises(UsageError, match="not a map of bodies"):
        load_body_map(str(file))
    with pytest.raises(UsageError, match="expected gait2392, rajagopal"):
        load_body_map("nonsense")
