"""OpenSim: a model with the tree of our own skeleton (.osim of OpenSim 4)."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping

import numpy as np

from bsip_cli.body.exports.identified import IdentifiedPerson, numbers, xml_comment, xml_text
from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.body.inertia import Inertia

# A ball or free joint's speeds are no rates of its coordinates, and InverseDynamicsTool (OpenSim
# 4.6) takes them for that: three turns in a row are a joint whose moments it computes.
_JOINTS = {"free": "CustomJoint", "spherical": "CustomJoint", "revolute": "PinJoint"}
COORDINATES = {
    "free": ("rz", "rx", "ry", "tx", "ty", "tz"),
    "spherical": ("rz", "rx", "ry"),
    "revolute": ("angle",),
}
"""Of each type of joint, in the order of the joint coordinate system: turns about Z of the parent
(flexion), X after that turn, and Y of the segment."""
_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
_NOTES = (
    "SI units, Y up. Body frames: origin at the joint to the parent, axes of the segment (X",
    "anterior, Y up, Z right). No muscles, no geometry, no limits.",
)


def osim_text(body: IdentifiedPerson) -> str:
    """An OpenSim 4 model: bodies, custom and pin joints, markers. Errors as of `check_bodies` and
    `markers`."""
    body.check_bodies()
    document = ET.Element("OpenSimDocument", Version="40000")
    document.append(ET.Comment(xml_comment((*body.made_of, *_NOTES))))
    model = ET.SubElement(document, "Model", name=body.name)
    ET.SubElement(model, "gravity").text = numbers([0.0, -GRAVITY_M_S2, 0.0])
    bodies = _set_of(model, "BodySet", "bodyset")
    joints = _set_of(model, "JointSet", "jointset")
    markers = _set_of(model, "MarkerSet", "markerset")
    for i, name in enumerate(body.person.skeleton.segments):
        set_inertia(ET.SubElement(bodies, "Body", name=name), body.in_joint(i))
        _add_joint(joints, body, i)
    for name, segment, place in body.markers():
        on = f"/bodyset/{body.person.skeleton.segments[segment]}"
        parts = {"socket_parent_frame": on, "location": numbers(place), "fixed": "true"}
        add_texts(ET.SubElement(markers, "Marker", name=name), parts)
    return xml_text(document)


def set_inertia(element: ET.Element, inertia: Inertia) -> None:
    """Write mass, mass centre and inertia about it (xx yy zz xy xz yz) of a ``Body``."""
    values = inertia.readable()
    parts = {"mass": values[:1], "mass_center": values[1:4], "inertia": values[4:]}
    for tag, part in parts.items():
        found = element.find(tag)
        child = ET.SubElement(element, tag) if found is None else found
        child.text = numbers(part)


def add_texts(element: ET.Element, texts: Mapping[str, str]) -> None:
    """An element with a text below another, for each tag."""
    for tag, text in texts.items():
        ET.SubElement(element, tag).text = text


def _set_of(model: ET.Element, tag: str, name: str) -> ET.Element:
    return ET.SubElement(ET.SubElement(model, tag, name=name), "objects")


def _add_joint(joints: ET.Element, body: IdentifiedPerson, i: int) -> None:
    person = body.person
    skeleton = person.skeleton
    kind, name = skeleton.joint_types[i], skeleton.joints[i]
    parent = f"/bodyset/{skeleton.segments[skeleton.parents[i]]}" if i else "/ground"
    joint = ET.SubElement(joints, _JOINTS[kind], name=name)
    add_texts(joint, {"socket_parent_frame": "in_parent", "socket_child_frame": "in_child"})
    coordinates = ET.SubElement(joint, "coordinates")
    for part in COORDINATES[kind]:
        coordinate = ET.SubElement(coordinates, "Coordinate", name=f"{name}_{part}")
        if part == "ty":
            height = numbers([body.height_of_base_m()])
            ET.SubElement(coordinate, "default_value").text = height
    frames = ET.SubElement(joint, "frames")
    position = person.joint_positions_m()[i]
    for frame, socket, tilt, place in (
        ("in_parent", parent, person.parent_tilt_rad[i], position),
        ("in_child", f"/bodyset/{skeleton.segments[i]}", person.child_tilt_rad[i], np.zeros(3)),
    ):
        offset = ET.SubElement(frames, "PhysicalOffsetFrame", name=frame)
        turned = {"translation": numbers(place), "orientation": numbers([tilt, 0.0, 0.0])}
        add_texts(offset, {"socket_parent": socket} | turned)
    if kind != "revolute":
        _add_transform(joint, name, kind)


def _add_transform(joint: ET.Element, name: str, kind: str) -> None:
    """Three turns, and in the free joint three ways: one coordinate each; else zero."""
    transform = ET.SubElement(joint, "SpatialTransform")
    parts = (*COORDINATES["spherical"], "tx", "ty", "tz")
    for number, part in enumerate(parts):
        what = "rotation" if number < 3 else "translation"
        one = ET.SubElement(transform, "TransformAxis", name=f"{what}{number % 3 + 1}")
        is_free = part in COORDINATES[kind]
        if is_free:
            ET.SubElement(one, "coordinates").text = f"{name}_{part}"
        ET.SubElement(one, "axis").text = numbers(_AXES[part[1]])
        function = ET.SubElement(one, "LinearFunction" if is_free else "Constant", name="function")
        tag, value = ("coefficients", [1.0, 0.0]) if is_free else ("value", [0.0])
        ET.SubElement(function, tag).text = numbers(value)
