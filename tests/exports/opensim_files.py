"""A small reader of OpenSim's files, written apart from their writer: places of all bodies from
model and motion, and net moments at the joints by Newton and Euler for each body."""

from __future__ import annotations

import contextlib
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from bsip_cli.body.exports.opensim_motion import COORDINATES
from bsip_cli.body.person import Person
from bsip_cli.dynamics.joint_moments import JointLoads
from tests.dynamics.newton_euler import driving_wrench, joint_axes


def read_mot(file: Path) -> dict[str, np.ndarray]:
    lines = file.read_text().splitlines()
    start = lines.index("endheader") + 1
    assert "inDegrees=no" in lines[:start]
    names = lines[start].split("\t")
    values = np.array([[float(x) for x in line.split("\t")] for line in lines[start + 1 :]])
    assert f"nRows={len(values)}" in lines and f"nColumns={len(names)}" in lines
    return dict(zip(names, values.T, strict=True))


class Model:
    """Bodies and joints of an .osim file."""

    def __init__(self, file: Path) -> None:
        model = ET.parse(file).getroot().find("Model")
        self.gravity = _numbers(model.find("gravity"))
        self.bodies = {
            body.get("name"): [_numbers(body.find(k)) for k in ("mass", "mass_center", "inertia")]
            for body in model.iter("Body")
        }
        joints = model.find("JointSet").find("objects")
        self.joints = [_Joint(joint) for joint in joints]

    def placed(self, motion: dict[str, np.ndarray]) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """By body: (N, 3, 3) orientation and (N, 3) origin in ground."""
        count = len(motion["time"])
        found = {"ground": (np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3)))}
        for joint in self.joints:
            R, p = found[joint.parent]
            R, p = _on(R, p, *joint.frames[0])
            joint.axes, turn, way = joint.moved(motion, R)
            p = p + np.einsum("nij,nj->ni", R, way)
            R = R @ turn
            offset, place = joint.frames[1]
            R = R @ offset.T
            found[joint.child] = R, p - np.einsum("nij,j->ni", R, place)
            joint.centre = p
        return found

    def moments(self, motion: dict, forces: dict, segments: list[str]) -> dict[str, np.ndarray]:
        """By coordinate that turns, (N,) net moment [N m]; the ends' samples are not good."""
        step = float(np.median(np.diff(motion["time"])))
        placed = self.placed(motion)
        drive = {name: self._drive(name, placed[name], step) for name in self.bodies}
        for name in segments:
            f, p, m = (
                np.stack([forces[f"{name}_{what}{a}"] for a in "xyz"], axis=1)
                for what in ("force_v", "force_p", "torque_")
            )
            drive[name] = drive[name] - np.hstack([f, m + np.cross(p, f)])
        found = {}
        for joint in self.joints:
            total = sum(drive[name] for name in self._beyond(joint.child))
            moment = total[:, 3:] - np.cross(joint.centre, total[:, :3])
            for name, axis in joint.axes.items():
                found[name] = np.einsum("nc,nc->n", moment, axis)
        return found

    def _beyond(self, body: str) -> list[str]:
        hanging = [joint.child for joint in self.joints if joint.parent == body]
        return [body, *(one for child in hanging for one in self._beyond(child))]

    def _drive(self, name: str, placed, step: float) -> np.ndarray:
        """(N, 6) force and moment about the origin that move a body."""
        (R, p), ((mass,), centre, (xx, yy, zz, xy, xz, yz)) = placed, self.bodies[name]
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        return driving_wrench(R, p + R @ centre, mass, inertia, self.gravity, step)


class _Joint:
    def __init__(self, element: ET.Element) -> None:
        frames = {f.get("name"): f for f in element.find("frames")}
        at = [frames[element.find(f"socket_{k}_frame").text] for k in ("parent", "child")]
        self.parent, self.child = (f.find("socket_parent").text.split("/")[-1] for f in at)
        self.frames = [
            (
                Rotation.from_euler("XYZ", _numbers(f.find("orientation"))).as_matrix(),
                _numbers(f.find("translation")),
            )
            for f in at
        ]
        if element.tag == "PinJoint":
            (only,) = element.find("coordinates")
            self.parts = [("rotation1", only.get("name"), np.array([0.0, 0.0, 1.0]))]
        else:
            self.parts = [_part(one) for one in element.find("SpatialTransform")]

    def moved(self, motion: dict, R: np.ndarray):
        """Axes of the turns in ground by coordinate, (N, 3, 3) turn and (N, 3) way."""
        turn, way, axes = np.tile(np.eye(3), (len(R), 1, 1)), np.zeros((len(R), 3)), {}
        for what, name, axis in self.parts:
            values = motion[name] if name else np.zeros(len(R))
            if what.startswith("rotation"):
                axes[name] = R @ turn @ axis
                turn = turn @ Rotation.from_rotvec(values[:, None] * axis).as_matrix()
            else:
                way = way + values[:, None] * axis
        return axes, turn, way


def _part(element: ET.Element) -> tuple[str, str, np.ndarray]:
    name, function = element.find("coordinates"), element.find("*[@name='function']")
    if name is None:
        assert function.tag == "Constant" and _numbers(function.find("value")) == 0.0
    else:
        assert list(_numbers(function.find("coefficients"))) == [1.0, 0.0]
    text = "" if name is None else name.text
    return element.get("name"), text, _numbers(element.find("axis"))


def _numbers(element: ET.Element) -> np.ndarray:
    return np.array([float(x) for x in element.text.split()])


def _on(R, p, offset, place):
    return R @ offset, p + R @ place


def by_coordinate(person: Person, R: np.ndarray, found: JointLoads) -> dict[str, np.ndarray]:
    """bsip's moments (N,) of the first body as OpenSim has them: about the axis of each turn.

    R : (N, n, 3, 3) orientation of all segments. A ball's axes are those of the joint coordinate
    system, but left joints have the last two the other way; a hinge's axis leans.
    """
    skeleton, moments = person.skeleton, {}
    for j, joint in enumerate(found.joints):
        kind, i = skeleton.joint_types[j + 1], j + 1
        side = np.array([1.0, -1.0, -1.0] if joint.endswith("_l") else [1.0, 1.0, 1.0])
        about = found.moment_Nm[:, j, :, 0] * side
        if kind == "revolute":
            axes = joint_axes(R[:, skeleton.parents[i]], R[:, i])
            moment = np.linalg.solve(axes, about[..., None])
            hinge = R[:, i] @ person.hinge_axes()[i]
            about = np.einsum("nc,nc->n", moment[..., 0], hinge)[:, None]
        moments |= {f"{joint}_{p}": a for p, a in zip(COORDINATES[kind], about.T, strict=True)}
    return moments


def of_the_tool(setup: Path) -> dict[str, np.ndarray]:
    """What InverseDynamicsTool writes, by coordinate, and ``time``; it runs where its files are."""
    import opensim

    opensim.Logger.setLevelString("error")
    with contextlib.chdir(setup.parent):
        assert opensim.InverseDynamicsTool(setup.name).run()
    table = opensim.TimeSeriesTable(str(setup.with_suffix(".sto")))
    found = {"time": np.array(table.getIndependentColumn())}
    for label in table.getColumnLabels():
        name = label.removesuffix("_moment").removesuffix("_force")
        found[name] = table.getDependentColumn(label).to_numpy()
    return found
