"""MJCF: for MuJoCo."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np

from bsip_cli.body.exports.identified import (
    BodyOnJoint,
    IdentifiedPerson,
    numbers,
    xml_document,
    xml_text,
)
from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.body.inertia import Inertia

_ROD = Inertia(1e-6, np.zeros(3), 1e-9 * np.eye(3))


def mjcf_text(body: IdentifiedPerson) -> str:
    """A MuJoCo model with a free base, ball joints and hinges. Errors as of `check_bodies` and
    `markers`."""
    body.check_bodies()
    root = xml_document("mujoco", body.said("mjcf"), model=body.name)
    ET.SubElement(root, "compiler", angle="radian", inertiafromgeom="false")
    ET.SubElement(root, "option", gravity=numbers([0.0, 0.0, -GRAVITY_M_S2]))
    elements = {"": ET.SubElement(root, "worldbody")}
    base_m = np.array([0.0, 0.0, body.height_of_base_m()])
    for one in body.tree():
        elements[one.segment] = _add_body(elements[one.parent], one, base_m)
    for name, segment, place in body.markers():
        own = elements[segment]  # sites go before the child bodies: such files are read so
        first = next((k for k, inner in enumerate(own) if inner.tag == "body"), len(own))
        own.insert(first, ET.Element("site", name=name, pos=numbers(place)))
    return xml_text(root, declared=False)


def _add_body(above: ET.Element, one: BodyOnJoint, base_m: np.ndarray) -> ET.Element:
    place, turn = one.place_m, one.parent_tilt_rad - one.child_tilt_rad
    if one.kind == "free":
        place, turn = base_m, np.pi / 2
    quat = numbers([np.cos(0.5 * turn), np.sin(0.5 * turn), 0.0, 0.0])
    element = ET.SubElement(above, "body", name=one.segment, pos=numbers(place), quat=quat)
    if one.kind == "free":
        ET.SubElement(element, "freejoint", name=one.joint)
    elif one.kind == "spherical":
        ET.SubElement(element, "joint", name=one.joint, type="ball")
    else:
        ET.SubElement(element, "joint", name=one.joint, type="hinge", axis=numbers(one.axis))
    values = (one.inertia if one.inertia.mass_kg else _ROD).readable()
    mass, centre, moments = map(numbers, np.split(values, [1, 4]))
    ET.SubElement(element, "inertial", pos=centre, mass=mass, fullinertia=moments)
    return element
