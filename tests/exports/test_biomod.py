"""bioMod: biorbd reads the same person as our own model has."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from bsip_cli.body.exports import model_text
from tests.exports.exported_person import moving_body

biorbd = pytest.importorskip("biorbd", reason="the biorbd package is not installed")


@pytest.fixture(scope="module")
def read(identified, tmp_path_factory):
    file = tmp_path_factory.mktemp("biomod") / "person.bioMod"
    file.write_text(model_text("biomod", identified), encoding="utf-8")
    return biorbd.Model(str(file))


def numbered(read) -> dict[str, int]:
    return {read.segment(k).name().to_string(): k for k in range(read.nbSegment())}


def placements(read, q: np.ndarray, names) -> dict[str, pin.SE3]:
    order = numbered(read)
    return {name: pin.SE3(read.globalJCS(q, order[name]).to_array()) for name in names}


def test_has_a_free_base_and_all_coordinates(read, identified):
    count = len(identified.person.skeleton.v_names)
    assert (read.nbQ(), read.nbQdot()) == (count, count)
    assert read.mass() == pytest.approx(identified.mass_kg, rel=1e-12)
    assert read.getGravity().to_array() == pytest.approx([0, 0, -9.80665])


def test_every_segment_has_its_inertia(read, identified):
    order = numbered(read)
    for i, segment in enumerate(identified.person.skeleton.segments):
        found = read.segment(order[segment]).characteristics()
        wanted = identified.in_joint(i)
        assert found.mass() == pytest.approx(wanted.mass_kg, rel=1e-12)
        assert found.CoM().to_array() == pytest.approx(wanted.com_m, abs=1e-12)
        assert found.inertia().to_array() == pytest.approx(wanted.tensor_kgm2, abs=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_same_whole_body_in_any_state(read, identified, seed):
    rng, names = np.random.default_rng(seed), identified.person.skeleton.segments
    q, v = rng.normal(0, 0.5, read.nbQ()), rng.normal(0, 1.0, read.nbQ())
    wanted = moving_body(identified, lambda t: placements(read, q + t * v, names))
    assert read.CoM(q).to_array() == pytest.approx(wanted.com_m, abs=1e-10)
    momentum = identified.mass_kg * read.CoMdot(q, v).to_array()
    assert momentum == pytest.approx(wanted.momentum[:3], abs=1e-6)
    turning = read.angularMomentum(q, v).to_array()
    assert turning == pytest.approx(wanted.momentum[3:], abs=1e-6)


def test_markers_are_where_they_are(read, identified):
    person, q = identified.person, np.zeros(read.nbQ())
    placed = placements(read, q, person.skeleton.segments)
    assert [name.to_string() for name in read.markerNames()] == list(person.markers)
    for k, place in enumerate(person.markers_in_joint_m()):
        frame = placed[person.skeleton.segments[person.marker_segments[k]]]
        assert read.marker(q, k).to_array() == pytest.approx(frame.act(place), abs=1e-10)


def test_stands_upright_at_zero(read):
    placed = placements(read, np.zeros(read.nbQ()), ("lower_torso", "head", "foot_r"))
    assert placed["lower_torso"].rotation @ [0, 1, 0] == pytest.approx([0, 0, 1], abs=1e-12)
    assert placed["head"].translation[2] > placed["foot_r"].translation[2] + 1
