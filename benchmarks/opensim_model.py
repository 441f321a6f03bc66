"""A person as an OpenSim model (.osim), and markers as a .trc, both with Y up as OpenSim has it."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np

from bsip_cli.body.person import Person

# Ball and Free turn by quaternions; Custom by three angles in turn, as most published models do.
JOINTS = {
    "ball": {"free": "FreeJoint", "spherical": "BallJoint", "revolute": "PinJoint"},
    "custom": {"free": "CustomJoint", "spherical": "CustomJoint", "revolute": "PinJoint"},
}
_COORDINATES = {
    "free": ("rx", "ry", "rz", "tx", "ty", "tz"),
    "spherical": ("rx", "ry", "rz"),
    "revolute": ("angle",),
}


def model_xml(person: Person, joint_family: str = "ball") -> str:
    """The tree with bodies at the joint centres, the same joints, hinge tilts and markers.

    ``joint_family`` is a key of ``JOINTS``: how spherical joints and the free base are described.

    Every body weighs 1 kg: inverse kinematics asks for no inertia.
    """
    document = ET.Element("OpenSimDocument", Version="40000")
    model = ET.SubElement(document, "Model", name="person")
    bodies = ET.SubElement(ET.SubElement(model, "BodySet"), "objects")
    joints = ET.SubElement(ET.SubElement(model, "JointSet"), "objects")
    markers = ET.SubElement(ET.SubElement(model, "MarkerSet"), "objects")
    positions = person.joint_positions_m()
    for i, name in enumerate(person.skeleton.segments):
        body = ET.SubElement(bodies, "Body", name=name)
        ET.SubElement(body, "mass").text = "1"
        ET.SubElement(body, "inertia").text = "1 1 1 0 0 0"
        _add_joint(joints, person, i, positions[i], JOINTS[joint_family])
    local = person.markers_in_joint_m()
    for name, segment, place in zip(person.markers, person.marker_segments, local, strict=True):
        marker = ET.SubElement(markers, "Marker", name=name)
        body_name = person.skeleton.segments[segment]
        ET.SubElement(marker, "socket_parent_frame").text = f"/bodyset/{body_name}"
        ET.SubElement(marker, "location").text = _numbers(place)
        ET.SubElement(marker, "fixed").text = "true"
    ET.indent(document)
    return ET.tostring(document, encoding="unicode", xml_declaration=True)


def _add_joint(
    joints: ET.Element, person: Person, i: int, position: np.ndarray, types: dict[str, str]
) -> None:
    skeleton = person.skeleton
    kind, name = skeleton.joint_types[i], skeleton.joints[i]
    parent = f"/bodyset/{skeleton.segments[skeleton.parents[i]]}" if i else "/ground"
    joint = ET.SubElement(joints, types[kind], name=name)
    ET.SubElement(joint, "socket_parent_frame").text = "in_parent"
    ET.SubElement(joint, "socket_child_frame").text = "in_child"
    coordinates = ET.SubElement(joint, "coordinates")
    for part in _COORDINATES[kind]:
        ET.SubElement(coordinates, "Coordinate", name=f"{name}_{part}")
    frames = ET.SubElement(joint, "frames")
    for frame, socket, tilt, place in (
        ("in_parent", parent, person.parent_tilt_rad[i], position),
        ("in_child", f"/bodyset/{skeleton.segments[i]}", person.child_tilt_rad[i], np.zeros(3)),
    ):
        offset = ET.SubElement(frames, "PhysicalOffsetFrame", name=frame)
        ET.SubElement(offset, "socket_parent").text = socket
        ET.SubElement(offset, "translation").text = _numbers(place)
        ET.SubElement(offset, "orientation").text = _numbers(np.array([tilt, 0.0, 0.0]))
    if types[kind] == "CustomJoint":
        _add_transform(joint, name, _COORDINATES[kind])


def _add_transform(joint: ET.Element, name: str, parts: tuple[str, ...]) -> None:
    """Turns about X, Y and Z in this order; shifts along them where there are coordinates."""
    transform = ET.SubElement(joint, "SpatialTransform")
    for number, (part, axis) in enumerate(
        zip(("rx", "ry", "rz", "tx", "ty", "tz"), 2 * ("1 0 0", "0 1 0", "0 0 1"), strict=True)
    ):
        label = f"{'rotation' if number < 3 else 'translation'}{number % 3 + 1}"
        one = ET.SubElement(transform, "TransformAxis", name=label)
        ET.SubElement(one, "axis").text = axis
        if part in parts:
            ET.SubElement(one, "coordinates").text = f"{name}_{part}"
            function = ET.SubElement(one, "LinearFunction", name="function")
            ET.SubElement(function, "coefficients").text = "1 0"
        else:
            function = ET.SubElement(one, "Constant", name="function")
            ET.SubElement(function, "value").text = "0"


def _numbers(values: np.ndarray) -> str:
    return " ".join(f"{value:.17g}" for value in values)


def trc_text(labels: tuple[str, ...], markers_m: np.ndarray, rate_hz: float) -> str:
    """A .trc file of markers (N, m, 3) [m], turned from Z up to Y up."""
    count, width = markers_m.shape[:2]
    turned = markers_m[..., [0, 2, 1]] * [1.0, 1.0, -1.0]
    names = "\t\t\t".join(labels)
    axes = "\t".join(f"X{k}\tY{k}\tZ{k}" for k in range(1, width + 1))
    head = [
        "PathFileType\t4\t(X/Y/Z)\tmarkers.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame"
        "\tOrigNumFrames",
        f"{rate_hz:g}\t{rate_hz:g}\t{count}\t{width}\tm\t{rate_hz:g}\t1\t{count}",
        f"Frame#\tTime\t{names}\t\t",
        f"\t\t{axes}",
        "",
    ]
    rows = [
        f"{k + 1}\t{k / rate_hz:.9f}\t" + "\t".join(f"{value:.12f}" for value in frame.ravel())
        for k, frame in enumerate(turned)
    ]
    return "\n".join([*head, *rows, ""])
