"""URDF: for Pinocchio and other libraries of robotics."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable

import numpy as np

from bsip_cli.body.exports.identified import (
    AXES,
    BALL_AXES,
    BodyOnJoint,
    IdentifiedPerson,
    numbers,
    xml_document,
    xml_text,
)
from bsip_cli.body.inertia import Inertia

# Turns the segments' axes (X anterior, Y up, Z right) upright in a world with Z up.
_UPRIGHT = (np.pi / 2, 0.0, 0.0)


def urdf_text(body: IdentifiedPerson) -> str:
    """A URDF robot; the reader adds the free base. Errors as of `check_bodies`."""
    body.check_bodies()
    robot = xml_document("robot", body.said("urdf"), name=body.name)
    _add_link(robot, "base")
    for one in body.tree():
        _add_joints(robot, one)
        _add_link(robot, one.segment, one.inertia)
    return xml_text(robot)


def _add_link(robot: ET.Element, name: str, inertia: Inertia | None = None) -> None:
    link = ET.SubElement(robot, "link", name=name)
    if inertia is None:
        return
    inertial = ET.SubElement(link, "inertial")
    ET.SubElement(inertial, "origin", xyz=numbers(inertia.com_m), rpy="0 0 0")
    ET.SubElement(inertial, "mass", value=numbers([inertia.mass_kg]))
    moments = {
        f"i{a}{b}": numbers([inertia.tensor_kgm2["xyz".index(a), "xyz".index(b)]])
        for a, b in ("xx", "xy", "xz", "yy", "yz", "zz")
    }
    ET.SubElement(inertial, "inertia", moments)


def _add_joints(robot: ET.Element, one: BodyOnJoint) -> None:
    """The joint, or the chain of joints, between a segment and its parent."""
    name, parent, segment = one.joint, one.parent, one.segment
    if one.kind == "free":
        _add_joint(robot, name, "fixed", "base", segment, rpy=_UPRIGHT)
    elif one.kind == "revolute":
        rpy, place = (one.parent_tilt_rad - one.child_tilt_rad, 0.0, 0.0), one.place_m
        _add_joint(robot, name, "continuous", parent, segment, xyz=place, rpy=rpy, axis=one.axis)
    else:
        between = [f"{name}_{BALL_AXES[: k + 1]}" for k in range(2)]
        for link in between:
            _add_link(robot, link)
        ends, xyz = [parent, *between, segment], one.place_m
        for letter, above, below in zip(BALL_AXES, ends, ends[1:], strict=False):
            joint = f"{name}_{letter}"
            _add_joint(robot, joint, "continuous", above, below, xyz=xyz, axis=AXES[letter])
            xyz = np.zeros(3)


def _add_joint(
    robot: ET.Element,
    name: str,
    kind: str,
    parent: str,
    child: str,
    *,
    xyz: Iterable[float] = (0.0, 0.0, 0.0),
    rpy: Iterable[float] = (0.0, 0.0, 0.0),
    axis: Iterable[float] | None = None,
) -> None:
    joint = ET.SubElement(robot, "joint", name=name, type=kind)
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=child)
    ET.SubElement(joint, "origin", xyz=numbers(xyz), rpy=numbers(rpy))
    if axis is not None:
        ET.SubElement(joint, "axis", xyz=numbers(axis))
