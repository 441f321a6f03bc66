"""OpenSim: the minimal model is the same person as our own model."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from bsip_cli.body.exports import model_text
from tests.exports.exported_person import configuration, our_model, whole_body

opensim = pytest.importorskip("opensim", reason="the opensim package is not installed")


@pytest.fixture(scope="module")
def read(identified, tmp_path_factory):
    opensim.Logger.setLevelString("error")
    file = tmp_path_factory.mktemp("osim") / "person.osim"
    file.write_text(model_text("osim", identified), encoding="utf-8")
    model = opensim.Model(str(file))
    model.initSystem()
    return model


def placed(model, state, names) -> dict[str, pin.SE3]:
    frames = {}
    for name in names:
        transform = model.getBodySet().get(name).getTransformInGround(state)
        turn = transform.R()
        rotation = np.array([[turn.get(i, j) for j in range(3)] for i in range(3)])
        frames[name] = pin.SE3(rotation, transform.p().to_numpy())
    return frames


def test_every_body_has_its_inertia(read, identified):
    state = read.initSystem()
    assert read.getNumCoordinates() == len(identified.person.skeleton.v_names)
    assert read.getTotalMass(state) == pytest.approx(identified.mass_kg, rel=1e-12)
    assert read.getGravity().to_numpy() == pytest.approx([0, -9.80665, 0])
    for i, segment in enumerate(identified.person.skeleton.segments):
        body, wanted = read.getBodySet().get(segment), identified.in_joint(i)
        assert body.getMass() == pytest.approx(wanted.mass_kg, rel=1e-12)
        assert body.getMassCenter().to_numpy() == pytest.approx(wanted.com_m, abs=1e-12)
        tensor = body.getInertia()
        moments, products = tensor.getMoments().to_numpy(), tensor.getProducts().to_numpy()
        assert moments == pytest.approx(np.diag(wanted.tensor_kgm2), abs=1e-12)
        entries = [wanted.tensor_kgm2[0, 1], wanted.tensor_kgm2[0, 2], wanted.tensor_kgm2[1, 2]]
        assert products == pytest.approx(entries, abs=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_same_whole_body_in_any_pose(read, identified, seed):
    """OpenSim turns ball joints by three angles, each set on its own."""
    rng, own = np.random.default_rng(seed), our_model(identified)
    state = read.initSystem()
    for coordinate in read.getCoordinateSet():
        coordinate.setValue(state, rng.normal(0, 0.6), False)
    read.realizePosition(state)
    frames = placed(read, state, identified.person.skeleton.segments)
    wanted = whole_body(own, configuration(identified, frames), np.zeros(own.nv))
    found = read.calcMassCenterPosition(state).to_numpy()
    assert found == pytest.approx(wanted.com_m, abs=1e-9)
    turned = max(np.linalg.norm(pin.log3(frame.rotation)) for frame in frames.values())
    assert turned > 0.5


def test_stands_on_the_floor_at_the_start(read, identified):
    state = read.initSystem()
    read.realizePosition(state)
    heights = [marker.getLocationInGround(state).get(1) for marker in read.getMarkerSet()]
    names = identified.person.skeleton.segments
    joints = [frame.translation[1] for frame in placed(read, state, names).values()]
    assert min(*heights, *joints) == pytest.approx(0.0, abs=1e-12)
    assert len(heights) == len(identified.person.markers)
