"""URDF: Pinocchio reads the same person as our own model has."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from bsip_cli.body.exports import model_text
from tests.exports.exported_person import moving_body, whole_body


@pytest.fixture(scope="module")
def read(identified) -> pin.Model:
    return pin.buildModelFromXML(model_text("urdf", identified), pin.JointModelFreeFlyer())


def placements(model: pin.Model, q: np.ndarray, names) -> dict[str, pin.SE3]:
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    return {name: data.oMf[model.getBodyId(name)].copy() for name in names}


def test_has_a_free_base_and_all_velocities(read, identified):
    assert read.nv == len(identified.person.skeleton.v_names)
    assert pin.computeTotalMass(read) == pytest.approx(identified.mass_kg, rel=1e-12)
    assert np.array_equal(read.gravity.linear[:2], [0, 0])
    assert read.gravity.linear[2] < 0


def test_every_body_has_its_inertia(read, identified):
    """Of the frame of its link, into which Pinocchio's joint frame is turned back."""
    for i, segment in enumerate(identified.person.skeleton.segments):
        frame = read.frames[read.getBodyId(segment)]
        found = frame.placement.actInv(read.inertias[frame.parentJoint])
        wanted = identified.in_joint(i)
        assert found.mass == pytest.approx(wanted.mass_kg, rel=1e-12)
        assert found.lever == pytest.approx(wanted.com_m, abs=1e-12)
        assert found.inertia == pytest.approx(wanted.tensor_kgm2, abs=1e-12)


def test_links_between_ball_axes_have_no_mass(read, identified):
    names = identified.person.skeleton.body_names
    with_mass = {read.frames[read.getBodyId(name)].parentJoint for name in names}
    others = set(range(read.njoints)) - with_mass
    assert len(with_mass) == 15
    assert [read.inertias[joint].mass for joint in others] == [0.0] * len(others)


@pytest.mark.parametrize("seed", range(6))
def test_same_whole_body_in_any_state(read, identified, seed):
    """Centre of mass, inertia about it and momentum follow; so does the ground wrench."""
    rng, names = np.random.default_rng(seed), identified.person.skeleton.segments
    q = pin.integrate(read, pin.neutral(read), rng.normal(0, 0.6, read.nv))
    v = rng.normal(0, 1.0, read.nv)
    wanted = moving_body(
        identified, lambda t: placements(read, pin.integrate(read, q, t * v), names)
    )
    found = whole_body(read, q, v)
    assert found.com_m == pytest.approx(wanted.com_m, abs=1e-10)
    assert found.inertia_kgm2 == pytest.approx(wanted.inertia_kgm2, abs=1e-9)
    assert found.momentum == pytest.approx(wanted.momentum, abs=1e-6)


def test_base_is_upright_with_z_up(read, identified):
    placed = placements(read, pin.neutral(read), ("lower_torso", "head", "foot_r", "foot_l"))
    up = placed["lower_torso"].rotation @ [0, 1, 0]
    assert up == pytest.approx([0, 0, 1], abs=1e-12)
    assert placed["head"].translation[2] > 0.4
    assert placed["foot_r"].translation[2] < -0.7
    assert placed["foot_l"].translation[1] > placed["foot_r"].translation[1]
