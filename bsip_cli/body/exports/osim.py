"""OpenSim 4 (.osim): the person's masses, centres of mass and inertias in a given model.

The axes of a given model's bodies at zero coordinates are taken for those of the segments in the
neutral pose (X anterior, Y up, Z to the right), as published models have them; origins are placed
on each other by joint centres that both have.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable
from copy import deepcopy
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from bsip_cli.body.exports.identified import (
    IdentifiedPerson,
    neutral_pose,
    numbers,
    xml_comment,
)
from bsip_cli.body.inertia import Inertia
from bsip_cli.body.skeleton import Skeleton, named_file
from bsip_cli.errors import UsageError
from bsip_cli.files.regular import read_toml, shipped

_BODIES = "Model/BodySet/objects/Body"


@dataclass(frozen=True, eq=False)
class GivenJoint:
    """A joint at zero coordinates: its frame in the parent body and in the child body."""

    parent: str
    child: str
    in_parent: pin.SE3
    in_child: pin.SE3


@dataclass(frozen=True)
class GivenModel:
    """An OpenSim 4 model as XML, masses by body, and joints by the body they carry."""

    file: str
    document: ET.Element
    masses_kg: dict[str, float]
    joints: dict[str, GivenJoint]


@dataclass(frozen=True)
class Replacement:
    """The model with the person's inertias, and what a user should know of it.

    ``misfit_m`` is the largest distance, by body, between joint centres that should coincide;
    ``untouched`` are the model's other bodies and their masses [kg].
    """

    text: str
    misfit_m: dict[str, float]
    untouched: dict[str, float]
    sentence: str


def read_given_model(content: bytes, file: str) -> GivenModel:
    """Parse an .osim file.

    UsageError: it is not a model of OpenSim 4.
    """
    builder = ET.TreeBuilder(insert_comments=True)
    try:
        document = ET.fromstring(content, ET.XMLParser(target=builder))
        is_model = document.tag == "OpenSimDocument" and document.find("Model") is not None
        version = int(document.get("Version", "0")) if is_model else 0
        if version < 40000:
            raise ValueError(f"OpenSimDocument of version {version}" if is_model else document.tag)
        bodies = document.iterfind(_BODIES)
        masses = {each.attrib["name"]: _number(each.findtext("mass", "0")) for each in bodies}
        elements = document.iterfind("Model/JointSet/objects/*")
        joints = [_joint(each) for each in elements if isinstance(each.tag, str)]
    except (ET.ParseError, ValueError, KeyError, TypeError) as error:
        raise UsageError(
            f"cannot be read as a model ({error})",
            file=file,
            expected="an .osim file of OpenSim 4",
            remedy="open the model in OpenSim 4 and save it",
        ) from None
    return GivenModel(file, document, masses, {joint.child: joint for joint in reversed(joints)})


def check_fits(model: GivenModel, body_map: BodyMap) -> None:
    """The model has every body and joint that the map names.

    UsageError: it lacks some, or bodies of a group are not joined to each other or have no mass.
    """
    lost = sorted(body_map.bodies() - set(model.masses_kg))
    anchors = {body for group in body_map.groups for _, body in group.joints}
    loose = sorted(anchors - set(model.joints))
    for fault, names in (("body", lost), ("joint that carries", loose)):
        if names:
            raise UsageError(
                f"has no {fault} {', '.join(names)}",
                file=model.file,
                expected=f"what the map {body_map.name} names",
                remedy="give a map of this model's bodies with --model-bodies",
            )
    for group in body_map.groups:
        placed = _placements(model, group)
        faults = [
            f"{body} ({segment}) is no joint of these bodies"
            for segment, body in group.joints
            if not {body, model.joints[body].parent} & set(placed)
        ]
        if set(placed) != set(group.bodies):
            faults.append("its bodies are not joined to each other")
        if sum(model.masses_kg[body] for body in group.bodies) <= 0:
            faults.append("its bodies have no mass to share by")
        if faults:
            raise UsageError(
                f"group {', '.join(group.bodies)}: {faults[0]}",
                file=model.file,
                remedy="correct the map of bodies",
            )


def with_inertias(model: GivenModel, body_map: BodyMap, person: IdentifiedPerson) -> Replacement:
    """The model with the inertial parameters of the person; nothing else changes. Errors as of
    `check_bodies`."""
    person.check_bodies()
    changed: dict[str, Inertia] = {}
    misfit: dict[str, float] = {}
    for group in body_map.groups:
        placed = _placements(model, group)
        whole, misfit[group.bodies[0]] = _united(model, group, placed, person)
        total = sum(model.masses_kg[body] for body in group.bodies)
        for body, place in placed.items():  # all parts have the whole's shape, so are it together
            part = model.masses_kg[body] / total
            own = pin.Inertia(part * whole.mass, whole.lever, part * whole.inertia)
            seen = place.actInv(own)
            changed[body] = Inertia(seen.mass, np.array(seen.lever), np.array(seen.inertia))
    document = deepcopy(model.document)
    for element in document.iterfind(_BODIES):
        if element.attrib["name"] in changed:
            _set_inertia(element, changed[element.attrib["name"]])
    untouched = {name: mass for name, mass in model.masses_kg.items() if name not in changed}
    sentence = _sentence(misfit, untouched)
    lines = (*person.made_of, f"map of bodies: {body_map.name}", sentence)
    document.insert(0, ET.Comment(xml_comment(lines)))
    text = ET.tostring(document, encoding="unicode", xml_declaration=True) + "\n"
    return Replacement(text, misfit, untouched, sentence)


def _set_inertia(element: ET.Element, inertia: Inertia) -> None:
    """Write mass, mass centre and inertia about it (xx yy zz xy xz yz) of a ``Body``."""
    values = inertia.readable()
    parts = {"mass": values[:1], "mass_center": values[1:4], "inertia": values[4:]}
    for tag, part in parts.items():
        found = element.find(tag)
        child = ET.SubElement(element, tag) if found is None else found
        child.text = numbers(part)


def _sentence(misfit_m: dict[str, float], untouched: dict[str, float]) -> str:
    body, worst = max(misfit_m.items(), key=lambda item: item[1])
    left = ", ".join(untouched)
    kept = f"; {left} stay as they were ({sum(untouched.values()):.3g} kg)" if left else ""
    return (
        f"bodies placed by common joint centres, which differ by up to {1000 * worst:.0f} mm "
        f"({body}){kept}; the model's axes at zero coordinates are taken for the segments' "
        "(X anterior, Y up, Z right)"
    )


def _united(
    model: GivenModel, group: BodyGroup, placed: dict[str, pin.SE3], person: IdentifiedPerson
) -> tuple[pin.Inertia, float]:
    """The segments as one in the neutral pose, in the group's frame, and the misfit [m]."""
    skeleton = person.person.skeleton
    rotations, joints = neutral_pose(person.person)
    at = [skeleton.index(name) for name in group.segments]
    turn, joint_m = rotations[at[0]], joints[at[0]]
    whole = pin.Inertia.Zero()
    for i in at:
        own = person.in_joint(i)
        part = pin.Inertia(own.mass_kg, own.com_m, own.tensor_kgm2)
        whole += pin.SE3(turn, joint_m).actInv(pin.SE3(rotations[i], joints[i])).act(part)
    theirs = []
    for _, body in group.joints:  # centre of the joint that carries it
        joint = model.joints[body]
        inside = body in placed
        there = placed[body] * joint.in_child if inside else placed[joint.parent] * joint.in_parent
        theirs.append(there.translation)
    ways = [joints[skeleton.index(segment)] - joint_m for segment, _ in group.joints]
    shifts = np.array(theirs) - np.array([turn.T @ way for way in ways])
    shift = shifts.mean(axis=0)
    misfit_m = float(np.linalg.norm(shifts - shift, axis=1).max())
    return pin.SE3(np.eye(3), shift).act(whole), misfit_m


def _placements(model: GivenModel, group: BodyGroup) -> dict[str, pin.SE3]:
    """The group's bodies in the frame of its first one, at zero coordinates."""
    placed = {group.bodies[0]: pin.SE3.Identity()}
    inner = [
        joint for joint in model.joints.values() if {joint.parent, joint.child} <= set(group.bodies)
    ]
    for _ in inner:  # every round places at least one more body, if it can be placed at all
        for joint in inner:
            across = joint.in_parent * joint.in_child.inverse()
            if joint.parent in placed:
                placed.setdefault(joint.child, placed[joint.parent] * across)
            elif joint.child in placed:
                placed[joint.parent] = placed[joint.child] * across.inverse()
    return placed


def _joint(element: ET.Element) -> GivenJoint:
    frames = {frame.get("name"): frame for frame in element.iterfind("frames/PhysicalOffsetFrame")}
    ends = []
    for side in ("parent", "child"):
        socket = _last(element.findtext(f"socket_{side}_frame"))
        if socket in frames:
            frame = frames[socket]  # turned about X, then the new Y, then the new Z
            body = _last(frame.findtext("socket_parent"))
            turns = Rotation.from_euler("XYZ", _three(frame.findtext("orientation", "0 0 0")))
            offset = pin.SE3(turns.as_matrix(), _three(frame.findtext("translation", "0 0 0")))
            ends.append((body, offset))
        else:
            ends.append((socket, pin.SE3.Identity()))
    (parent, in_parent), (child, in_child) = ends
    return GivenJoint(parent, child, in_parent, in_child)


def _last(path: str | None) -> str:
    """``pelvis`` of ``/bodyset/pelvis``."""
    if path is None:
        raise ValueError("a joint without frames")
    return path.strip().rpartition("/")[2]


def _three(text: str) -> np.ndarray:
    values = np.array([_number(word) for word in text.split()])
    if values.shape != (3,):
        raise ValueError(f"{text!r} instead of three numbers")
    return values


def _number(text: str) -> float:
    value = float(text)
    if not np.isfinite(value):
        raise ValueError(f"{text!r} instead of a number")
    return value


# --- which bodies of a model are which segments, as data (configs/opensim) ------------------------


@dataclass(frozen=True)
class BodyGroup:
    """Bodies of a model that together are some of our segments.

    bodies : they share the mass in the proportions they have in the model; the first one's frame
        is that of the group.
    segments : united in the neutral pose, in the first one's axes.
    joints : pairs (segment, body): the joint between the segment and its parent and the one
        between the body and its parent are the same point.
    """

    bodies: tuple[str, ...]
    segments: tuple[str, ...]
    joints: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class BodyMap:
    """Which bodies of another OpenSim model, by its name, are which of bsip's segments."""

    name: str
    groups: tuple[BodyGroup, ...]

    def bodies(self) -> set[str]:
        return {body for group in self.groups for body in group.bodies}


def load_body_map(name: str) -> BodyMap:
    """Read a map: the name of a shipped one, or a path that ends in ``.toml``.

    UsageError: there is no such file, or it is no map.
    """
    file = named_file("opensim", name, "map of bodies")
    data = read_toml(file)
    try:
        groups = []
        for row in data["groups"]:
            joints = tuple((str(segment), str(body)) for segment, body in row["joints"])
            groups.append(BodyGroup(_texts(row["bodies"]), _texts(row["segments"]), joints))
        if not all(one.bodies and one.segments and one.joints for one in groups):
            raise ValueError("a group without bodies, segments or joints")
    except (KeyError, TypeError, ValueError) as error:
        raise UsageError(
            f"not a map of bodies ({error})",
            file=file,
            expected="[[groups]] with bodies, segments and joints",
        ) from None
    return BodyMap(file.stem, tuple(groups))


def shipped_names() -> tuple[str, ...]:
    """Of the maps in configs/opensim, without ``.toml``."""
    return tuple(sorted(path.stem for path in shipped("opensim").glob("*.toml")))


def fitting_map(bodies: Iterable[str]) -> BodyMap | None:
    """The shipped map that fits a model with these bodies and explains most of them."""
    known = set(bodies)
    fitting = (each for each in map(load_body_map, shipped_names()) if each.bodies() <= known)
    return max(fitting, key=lambda each: len(each.bodies()), default=None)


def check_segments(body_map: BodyMap, skeleton: Skeleton) -> None:
    """Every segment of the skeleton that has mass goes into exactly one group.

    UsageError: a segment is missing, stands twice, or is not one with mass of the skeleton.
    """
    named = [segment for group in body_map.groups for segment in group.segments]
    jointed = {segment for group in body_map.groups for segment, _ in group.joints}
    unknown = sorted({*named, *jointed} - set(skeleton.body_names))
    lost = [segment for segment in skeleton.body_names if segment not in named]
    twice = sorted({segment for segment in named if named.count(segment) > 1})
    faults = (("unknown", unknown), ("left out", lost), ("more than once", twice))
    said = [f"{fault}: {', '.join(found)}" for fault, found in faults if found]
    if said:
        raise UsageError(
            f"segments of the skeleton are {'; '.join(said)}",
            file=body_map.name,
            expected="every segment in one group",
        )


def _texts(value: object) -> tuple[str, ...]:
    if not isinstance(value, list) or not all(isinstance(text, str) for text in value):
        raise TypeError(f"{value!r} is no list of names")
    return tuple(value)
