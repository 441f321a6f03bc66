"""URDF: for Pinocchio and other libraries of robotics."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable

import numpy as np

from bsip_cli.body.exports.identified import (
    BALL_AXES,
    IdentifiedPerson,
    numbers,
    xml_comment,
    xml_text,
)
from bsip_cli.body.inertia import Inertia

_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
# Turns the segments' axes (X anterior, Y up, Z right) upright in a world with Z up.
_UPRIGHT = (np.pi / 2, 0.0, 0.0)


def urdf_text(body: IdentifiedPerson) -> str:
    """A URDF robot; the reader adds the free base. Errors as of `check_bodies`."""
    body.check_bodies()
    robot = ET.Element("robot", name=body.name)
    robot.append(ET.Comment(xml_comment(body.said("urdf"))))
    _add_link(robot, "base")
    for i, segment in enumerate(body.person.skeleton.segments):
        _add_joints(robot, body, i)
        _add_link(robot, segment, body.in_joint(i))
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


def _add_joints(robot: ET.Element, body: IdentifiedPerson, i: int) -> None:
    """The joint, or the chain of joints, between a segment and its parent."""
    person = body.person
    skeleton = person.skeleton
    name, segment = skeleton.joints[i], skeleton.segments[i]
    parent = skeleton.segments[skeleton.parents[i]]
    position = person.joint_positions_m()[i]
    tilt = (person.parent_tilt_rad[i] - person.child_tilt_rad[i], 0.0, 0.0)
    if skeleton.joint_types[i] == "free":
        _add_joint(robot, name, "fixed", "base", segment, rpy=_UPRIGHT)
    elif skeleton.joint_types[i] == "revolute":
        axis = person.hinge_axes()[i]
        _add_joint(robot, name, "continuous", parent, segment, xyz=position, rpy=tilt, axis=axis)
    else:
        between = [f"{name}_{BALL_AXES[: k + 1]}" for k in range(2)]
        for link in between:
            _add_link(robot, link)
        ends = [parent, *between, segment]
        for k, letter in enumerate(BALL_AXES):
            place, axis = position if k == 0 else np.zeros(3), _AXES[letter]
            one = f"{name}_{letter}"
            _add_joint(robot, one, "continuous", ends[k], ends[k + 1], xyz=place, axis=axis)


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
