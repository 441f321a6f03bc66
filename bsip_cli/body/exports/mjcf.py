"""MJCF: for MuJoCo."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np

from bsip_cli.body.exports.identified import IdentifiedPerson, numbers, xml_comment, xml_text
from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.body.inertia import Inertia

_ROD = Inertia(1e-6, np.zeros(3), 1e-9 * np.eye(3))


def mjcf_text(body: IdentifiedPerson) -> str:
    """A MuJoCo model with a free base, ball joints and hinges. Errors as of `check_bodies` and
    `markers`."""
    body.check_bodies()
    root = ET.Element("mujoco", model=body.name)
    root.append(ET.Comment(xml_comment(body.said("mjcf"))))
    ET.SubElement(root, "compiler", angle="radian", inertiafromgeom="false")
    ET.SubElement(root, "option", gravity=numbers([0.0, 0.0, -GRAVITY_M_S2]))
    world = ET.SubElement(root, "worldbody")
    elements: list[ET.Element] = []
    for i, parent in enumerate(body.person.skeleton.parents):
        above = elements[parent] if parent >= 0 else world
        elements.append(_add_body(above, body, i))
    for name, segment, place in body.markers():
        own = elements[segment]  # sites go before the child bodies: such files are read so
        first = next((k for k, one in enumerate(own) if one.tag == "body"), len(own))
        own.insert(first, ET.Element("site", name=name, pos=numbers(place)))
    return xml_text(root, declared=False)


def _add_body(above: ET.Element, body: IdentifiedPerson, i: int) -> ET.Element:
    person = body.person
    skeleton = person.skeleton
    position = person.joint_positions_m()[i]
    turn = person.parent_tilt_rad[i] - person.child_tilt_rad[i]
    kind, name = skeleton.joint_types[i], skeleton.joints[i]
    if kind == "free":
        position, turn = np.array([0.0, 0.0, body.height_of_base_m()]), np.pi / 2
    half = 0.5 * turn
    place = {"pos": numbers(position), "quat": numbers([np.cos(half), np.sin(half), 0.0, 0.0])}
    element = ET.SubElement(above, "body", {"name": skeleton.segments[i], **place})
    if kind == "free":
        ET.SubElement(element, "freejoint", name=name)
    elif kind == "spherical":
        ET.SubElement(element, "joint", name=name, type="ball")
    else:
        axis = numbers(person.hinge_axes()[i])
        ET.SubElement(element, "joint", name=name, type="hinge", axis=axis)
    values = (body.in_joint(i) if i in skeleton.bodies else _ROD).readable()
    mass, centre, moments = map(numbers, np.split(values, [1, 4]))
    ET.SubElement(element, "inertial", pos=centre, mass=mass, fullinertia=moments)
    return element
