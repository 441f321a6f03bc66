"""Model, motion and loads for OpenSim, read again by a reader of our own (`opensim_files`)."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bsip_cli.body.exports import model_text
from bsip_cli.body.exports.opensim_motion import (
    COORDINATES,
    coordinates,
    loads,
    loads_xml,
    mot_text,
    setup_xml,
)
from bsip_cli.dynamics.joint_moments import joint_loads
from tests.body.standing_person import joint_frames, standing
from tests.dynamics.test_joint_moments import KNOWN, STEP_S, feet, motion, phi_of
from tests.exports.opensim_files import Model, by_coordinate, read_mot

UP = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])


@pytest.fixture(scope="module", params=[False, True], ids=["hansen2017", "robert17"])
def written(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("opensim")
    body, q, v, a = motion(request.param)
    times, ground = STEP_S * np.arange(len(q)), feet(len(q))
    (folder / "m.osim").write_text(model_text("osim", body))
    columns = coordinates(body.person.skeleton, q)
    (folder / "m.mot").write_text(mot_text("m", times, columns, ["said"]))
    acting = loads({name: one.wrench for name, one in ground.items()})
    (folder / "l.mot").write_text(mot_text("l", times, acting, ["said"]))
    found = joint_loads(body.person, q, v, a, phi_of(body), ground, KNOWN)
    return folder, body, q, found


def test_bodies_are_where_they_were(written):
    folder, body, q, _ = written
    R, p = joint_frames(body.person, q)
    placed = Model(folder / "m.osim").placed(read_mot(folder / "m.mot"))
    for i, segment in enumerate(body.person.skeleton.segments):
        assert placed[segment][1] == pytest.approx(p[:, i] @ UP.T, abs=1e-9)
        assert placed[segment][0] == pytest.approx(UP @ R[:, i], abs=1e-9)


def test_moments_of_newton_and_euler_from_the_files(written):
    """At ball joints the numbers of the artifact themselves, but for the sides' signs."""
    folder, body, q, found = written
    model, inner = Model(folder / "m.osim"), slice(8, -8)
    read = (read_mot(folder / name) for name in ("m.mot", "l.mot"))
    moments = model.moments(*read, ["foot_r", "foot_l"])
    R, _ = joint_frames(body.person, q)
    for name, ours in by_coordinate(body.person, R, found).items():
        limit = max(1e-3 * np.nanmax(np.abs(ours[inner])), 2e-3)
        assert np.nanmax(np.abs(ours - moments[name])[inner]) < limit, name


def test_angles_run_on_through_the_pose_where_two_axes_coincide():
    """An arm swung sideways over the head, and a turn about the vertical of three rounds."""
    skeleton = standing().person.skeleton
    t = np.linspace(0.0, 1.0, 401)
    q = np.tile(standing().q, (len(t), 1))
    i = skeleton.joints.index("shoulder_r")
    start, wobble = skeleton.q_starts[i], 0.05 * np.sin(9 * t)
    arm = Rotation.from_euler("ZXY", np.stack([wobble, -2.6 * t, 0.1 + wobble], axis=1))
    q[:, start : start + 4] = arm.as_quat()
    heading = Rotation.from_rotvec(np.stack([0 * t, 0 * t, 6 * np.pi * t], axis=1))
    q[:, 3:7] = (heading * Rotation.from_quat(q[0, 3:7])).as_quat()
    found = coordinates(skeleton, q)
    names = [f"shoulder_r_{part}" for part in COORDINATES["spherical"]]
    angles = np.stack([found[name] for name in names], axis=1)
    assert np.abs(np.diff(angles, axis=0)).max() < 0.02
    assert angles[-1, 1] == pytest.approx(-2.6, abs=1e-9)
    assert Rotation.from_euler("ZXY", angles).approx_equal(arm, atol=1e-9).all()
    base = found[f"{skeleton.joints[0]}_ry"]
    assert base[-1] - base[0] == pytest.approx(6 * np.pi, abs=1e-6)


def test_loads_are_the_wrench_and_press_where_they_act():
    wrench = np.zeros((4, 6))
    at = np.array([0.3, -0.2, 0.0])
    wrench[1:3, :3] = [[10.0, 5.0, 400.0], [20.0, -5.0, 600.0]]
    twist = np.array([0.0, 0.0, 4.0])
    wrench[1:3, 3:] = np.cross(at, wrench[1:3, :3]) + twist
    found = loads({"foot_r": wrench})
    force, point, torque = (
        np.stack([found[f"foot_r_{what}{a}"] for a in "xyz"], axis=1)
        for what in ("force_v", "force_p", "torque_")
    )
    assert force == pytest.approx(wrench[:, :3] @ UP.T)
    assert torque + np.cross(point, force) == pytest.approx(wrench[:, 3:] @ UP.T, abs=1e-12)
    assert point[1:] == pytest.approx(np.tile(UP @ at, (3, 1)))  # the last one stays
    assert point[0] == pytest.approx(0.0)
    assert torque[1:3] == pytest.approx(np.tile([0.0, 4.0, 0.0], (2, 1)), abs=1e-12)


def test_set_up_names_its_files_and_the_time_that_is_known():
    files = {"model_file": "a.osim", "coordinates_file": "a.mot", "external_loads_file": "l.xml"}
    tool = ET.fromstring(setup_xml("x", files, 0.5, 1.25, ["made -- so"])).find(
        "InverseDynamicsTool"
    )
    assert {name: tool.find(name).text for name in files} == files
    assert tool.find("time_range").text == "0.5 1.25"
    assert tool.find("output_gen_force_file").text == "x.sto"
    forces = ET.fromstring(loads_xml(["foot_l", "foot_r"], "l.mot", ["so"])).iter("ExternalForce")
    assert [f.find("applied_to_body").text for f in forces] == ["foot_l", "foot_r"]
