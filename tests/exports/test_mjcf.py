"""MJCF: MuJoCo reads the same person as our own model has."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from bsip_cli.body.exports import model_text
from tests.exports.exported_person import identified_person, joint_frames, our_model, poses

mujoco = pytest.importorskip("mujoco", reason="the mujoco package is not installed")


@pytest.fixture(scope="module")
def identified():
    return identified_person()


@pytest.fixture(scope="module")
def read(identified):
    return mujoco.MjModel.from_xml_string(model_text("mjcf", identified))


def qpos_of(q: np.ndarray, skeleton) -> np.ndarray:
    """MuJoCo writes quaternions w x y z, Pinocchio x y z w; the order of joints is the same."""
    qpos = q.copy()
    for start, kind in zip(skeleton.q_starts, skeleton.joint_types, strict=True):
        if kind != "revolute":
            first = start + 3 if kind == "free" else start
            qpos[first : first + 4] = np.roll(q[first : first + 4], 1)
    return qpos


def at(model, q: np.ndarray, skeleton):
    data = mujoco.MjData(model)
    data.qpos[:] = qpos_of(q, skeleton)
    mujoco.mj_forward(model, data)
    return data


def test_every_body_has_its_inertia(read, identified):
    """MuJoCo keeps principal axes: the tensor is put together again."""
    person = identified.person
    assert (read.nq, read.nv, read.nbody) == (51, 40, 16)
    for i, segment in enumerate(person.skeleton.segments):
        body = read.body(segment)
        wanted = identified.inertias[i]
        axes = pin.Quaternion(*body.iquat).normalized().toRotationMatrix()
        tensor = axes @ np.diag(body.inertia) @ axes.T
        assert body.mass[0] == pytest.approx(wanted.mass_kg, rel=1e-12)
        com = wanted.com_m + person.origin_in_joint_m[i]
        assert body.ipos == pytest.approx(com, abs=1e-12)
        assert tensor == pytest.approx(wanted.tensor_kgm2, abs=1e-9)


def test_poses_masses_and_gravity_agree(read, identified):
    skeleton, own = identified.person.skeleton, our_model(identified)
    for q in poses(identified):
        data = at(read, q, skeleton)
        frames = joint_frames(own, q)
        assert data.xpos[1:] == pytest.approx(np.array([f.translation for f in frames]), abs=1e-9)
        found = data.xmat[1:].reshape(-1, 3, 3)
        assert found == pytest.approx(np.array([f.rotation for f in frames]), abs=1e-9)
        com = pin.centerOfMass(own, own.createData(), q)
        assert data.subtree_com[0] == pytest.approx(com, abs=1e-9)


def test_mass_matrix_and_weight_agree(read, identified):
    """MuJoCo's base moves along world axes, Pinocchio's along its own."""
    skeleton, own = identified.person.skeleton, our_model(identified)
    for q in poses(identified):
        data = at(read, q, skeleton)
        found = np.zeros((read.nv, read.nv))
        for column, unit in zip(found, np.eye(read.nv), strict=True):
            mujoco.mj_mulM(read, data, column, unit)
        local = np.eye(read.nv)
        local[:3, :3] = joint_frames(own, q)[0].rotation.T
        matrix = pin.crba(own, own.createData(), q)
        matrix = np.triu(matrix) + np.triu(matrix, 1).T
        assert found == pytest.approx(local.T @ matrix @ local, abs=1e-8)
        weight = pin.computeGeneralizedGravity(own, own.createData(), q)
        assert data.qfrc_bias == pytest.approx(local.T @ weight, abs=1e-7)


def test_stands_on_the_floor_at_the_start(read):
    """The lowest marker or joint is at height zero, the head above, looking along X."""
    data = mujoco.MjData(read)
    mujoco.mj_forward(read, data)
    lowest = min(data.xpos[1:, 2].min(), data.site_xpos[:, 2].min())
    assert lowest == pytest.approx(0.0, abs=1e-12)
    assert data.body("head").xpos[2] > 1.2
    assert data.site("RMT2").xpos[0] > data.site("RCAL").xpos[0]


def test_markers_are_sites(read, identified):
    person = identified.person
    data = mujoco.MjData(read)
    mujoco.mj_forward(read, data)
    assert read.nsite == len(person.markers)
    for k, name in enumerate(person.markers):
        site = read.site(name)
        body = read.body(int(site.bodyid[0])).name
        assert body == person.skeleton.segments[person.marker_segments[k]]
        assert site.pos == pytest.approx(person.markers_in_joint_m()[k], abs=1e-12)


def test_clavicles_weigh_next_to_nothing():
    """MuJoCo refuses a body that moves and has no mass."""
    body = identified_person(girdle=True)
    read = mujoco.MjModel.from_xml_string(model_text("mjcf", body))
    assert (read.nv, read.nbody) == (46, 18)
    assert read.body_mass.sum() == pytest.approx(body.mass_kg, abs=1e-5)
    assert read.body("clavicle_l").mass[0] < 1e-5
