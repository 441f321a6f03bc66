"""Joint moments against OpenSim's InverseDynamicsTool on the exported model."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from bsip_cli.body.exports.osim import osim_text
from bsip_cli.dynamics.joint_moments import joint_loads
from bsip_cli.dynamics.pinocchio_model import pinocchio_model
from tests.body.standing_person import Swing, joint_frames, standing
from tests.dynamics.test_joint_moments import KNOWN, feet, phi_of
from tests.exports.exported_person import identified_person

opensim = pytest.importorskip("opensim", reason="the reader is not installed: opensim")

RATE_HZ = 200.0
UP = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])  # from Z up to Y up


def test_moments_of_inverse_dynamics_tool(tmp_path):
    body = identified_person()
    person = body.person
    swing = Swing(pinocchio_model(person), standing().q, 3, 0.25)
    _, q, v, a = swing.sampled(1.5, RATE_HZ)
    ground = feet(len(q) * 5)
    ground = {s: type(g)(g.wrench[::5], g.noise[::5], g.noise_at_m) for s, g in ground.items()}
    found = joint_loads(person, q, v, a, phi_of(body), ground, KNOWN)
    torques = _by_opensim(tmp_path, body, q, ground)
    R, _ = joint_frames(person, q)
    inner = slice(20, -20)
    for j, joint in enumerate(found.joints):
        i = j + 1
        of_opensim = torques[joint][inner]
        parent = R[inner, person.skeleton.parents[i]]
        side = -1.0 if joint.endswith("_l") else 1.0
        first, third = parent @ [0, 0, 1], side * (R[inner, i] @ [0, 1, 0])
        second = np.cross(third, first)
        second /= np.linalg.norm(second, axis=1, keepdims=True)
        axes = np.stack([first, second, third], axis=1)
        mine = np.linalg.solve(axes, found.moment_Nm[inner, j])[..., 0]
        if person.skeleton.joint_types[i] == "revolute":
            hinge = R[inner, i] @ person.hinge_axes()[i]
            mine = np.einsum("nc,nc->n", mine, hinge)[:, None]
        else:
            mine = _generalised(mine, parent, R[inner, i])
        limit = max(0.01 * np.abs(of_opensim).max(), 0.1)
        assert np.abs(mine - of_opensim).max() < limit, joint


def _angles(parent: np.ndarray, own: np.ndarray) -> np.ndarray:
    """(N, 3) body-fixed X, Y, Z angles of a ball joint's coordinates."""
    turn = parent.swapaxes(1, 2) @ own
    return np.stack(
        [
            np.arctan2(-turn[:, 1, 2], turn[:, 2, 2]),
            np.arcsin(turn[:, 0, 2]),
            np.arctan2(-turn[:, 0, 1], turn[:, 0, 0]),
        ],
        axis=1,
    )


def _generalised(moment: np.ndarray, parent: np.ndarray, own: np.ndarray) -> np.ndarray:
    """The moment (N, 3) about X of the parent, Y after that turn, and Z of the segment."""
    x, z = parent[:, :, 0], own[:, :, 2]
    angle = _angles(parent, own)[:, :1]
    y = np.cos(angle) * parent[:, :, 1] + np.sin(angle) * parent[:, :, 2]
    return np.stack([np.einsum("nc,nc->n", moment, e) for e in (x, y, z)], axis=1)


def _with_angles(text: str) -> str:
    """The exported model with its ball and free joints as custom ones of the same coordinates.

    The tool takes the rates of coordinates for speeds, which in a ball joint are the angular
    velocity (OpenSim 4.6): its accelerations are wrong there, its forces are not.
    """
    root = ET.fromstring(text)
    for kind in ("BallJoint", "FreeJoint"):
        for joint in root.iter(kind):
            joint.tag = "CustomJoint"
            names = [one.get("name") for one in joint.iter("Coordinate")]
            transform = ET.SubElement(joint, "SpatialTransform")
            labels = [f"{what}{k}" for what in ("rotation", "translation") for k in "123"]
            axes = 2 * ("1 0 0", "0 1 0", "0 0 1")
            for k, (label, axis) in enumerate(zip(labels, axes, strict=True)):
                one = ET.SubElement(transform, "TransformAxis", name=label)
                ET.SubElement(one, "axis").text = axis
                if k < len(names):
                    ET.SubElement(one, "coordinates").text = names[k]
                    function = ET.SubElement(one, "LinearFunction", name="function")
                    ET.SubElement(function, "coefficients").text = "1 0"
                else:
                    function = ET.SubElement(one, "Constant", name="function")
                    ET.SubElement(function, "value").text = "0"
    return ET.tostring(root, encoding="unicode")


def _by_opensim(folder: Path, body, q: np.ndarray, ground) -> dict[str, np.ndarray]:
    person = body.person
    skeleton = person.skeleton
    (folder / "model.osim").write_text(_with_angles(osim_text(body)))
    R, p = joint_frames(person, q)
    times = np.arange(len(q)) / RATE_HZ
    columns = {"time": times}
    for i, name in enumerate(skeleton.joints):
        kind, parent = skeleton.joint_types[i], skeleton.parents[i]
        if kind == "revolute":
            columns[f"{name}_angle"] = q[:, skeleton.q_starts[i]]
            continue
        above = np.tile(UP.T, (len(q), 1, 1)) if i == 0 else R[:, parent]
        for part, course in zip("xyz", _angles(above, R[:, i]).T, strict=True):
            columns[f"{name}_r{part}"] = np.unwrap(course)
        if i == 0:
            for part, course in zip("xyz", (p[:, 0] @ UP.T).T, strict=True):
                columns[f"{name}_t{part}"] = course
    _storage(folder / "motion.mot", columns)
    loads = {"time": times}
    forces = []
    for foot, one in ground.items():
        force, moment = one.wrench[:, :3] @ UP.T, one.wrench[:, 3:] @ UP.T
        for label, values in (("f", force), ("p", np.zeros_like(force)), ("m", moment)):
            for part, course in zip("xyz", values.T, strict=True):
                loads[f"{foot}_{label}{part}"] = course
        forces.append(
            f'<ExternalForce name="{foot}"><applied_to_body>{foot}</applied_to_body>'
            "<force_expressed_in_body>ground</force_expressed_in_body>"
            "<point_expressed_in_body>ground</point_expressed_in_body>"
            f"<force_identifier>{foot}_f</force_identifier>"
            f"<point_identifier>{foot}_p</point_identifier>"
            f"<torque_identifier>{foot}_m</torque_identifier></ExternalForce>"
        )
    _storage(folder / "loads.mot", loads)
    (folder / "loads.xml").write_text(
        '<OpenSimDocument Version="40000"><ExternalLoads name="loads"><objects>'
        + "".join(forces)
        + f"</objects><datafile>{folder / 'loads.mot'}</datafile></ExternalLoads></OpenSimDocument>"
    )
    tool = opensim.InverseDynamicsTool()
    tool.setModelFileName(str(folder / "model.osim"))
    tool.setCoordinatesFileName(str(folder / "motion.mot"))
    tool.setExternalLoadsFileName(str(folder / "loads.xml"))
    tool.setStartTime(float(times[0]))
    tool.setEndTime(float(times[-1]))
    tool.setLowpassCutoffFrequency(-1)
    tool.setResultsDir(str(folder))
    tool.setOutputGenForceFileName("torques.sto")
    assert tool.run()
    table = opensim.TimeSeriesTable(str(folder / "torques.sto"))
    at = np.array(table.getIndependentColumn())

    def course(label: str) -> np.ndarray:
        return np.interp(times, at, table.getDependentColumn(label).to_numpy())

    return {
        name: np.stack(
            [course(f"{name}_angle_moment")]
            if kind == "revolute"
            else [course(f"{name}_r{part}_moment") for part in "xyz"],
            axis=1,
        )
        for name, kind in zip(skeleton.joints[1:], skeleton.joint_types[1:], strict=True)
    }


def _storage(file: Path, columns: dict[str, np.ndarray]) -> None:
    rows = np.stack(list(columns.values()), axis=1)
    head = [file.stem, "version=1", f"nRows={len(rows)}", f"nColumns={rows.shape[1]}"]
    head += ["inDegrees=no", "endheader", "\t".join(columns)]
    lines = ["\t".join(f"{x:.12g}" for x in row) for row in rows]
    file.write_text("\n".join([*head, *lines, ""]))
