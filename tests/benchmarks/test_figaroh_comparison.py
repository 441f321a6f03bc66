"""What both sides of the comparison are given is the same problem."""

import json

import numpy as np
import pinocchio as pin

from benchmarks import figaroh_comparison
from tests.identification.synthetic_identification import motion, recording, world


def test_the_wrench_in_the_base_is_what_the_base_joint_carries():
    one = recording(0.5)
    model = world().model
    data = model.createData()
    torques = [
        pin.computeJointTorqueRegressor(model, data, q, v, a)[:6] @ world().phi_true
        for q, v, a in zip(one.q, one.v, one.a, strict=True)
    ]
    turned = figaroh_comparison.in_base(one.wrench, one.q)
    np.testing.assert_allclose(turned, torques, atol=1e-8)
    np.testing.assert_allclose(figaroh_comparison.in_world(turned, one.q), one.wrench, atol=1e-9)


def test_bsips_side_finds_the_wrench(tmp_path, capsys):
    figaroh_comparison.write_problem(tmp_path, 20.0, 0.0 * figaroh_comparison.NOISE)
    figaroh_comparison.bsip_worker(tmp_path)
    assert json.loads(capsys.readouterr().out)["rank"] == 128
    other = motion(figaroh_comparison.OTHER_S, figaroh_comparison.OTHER_SEED)
    found = np.load(tmp_path / "bsip.npy")
    assert found.shape == (len(other[0]), 6)
    assert np.abs(found - figaroh_comparison.wrench_of(world().phi_true)).max() < 1e-5
    np.save(tmp_path / "figaroh.npy", figaroh_comparison.in_base(found, other[0]))
    rows = figaroh_comparison.wrench_rows(tmp_path, "none")
    assert [row[1] for row in rows] == ["bsip - truth", "figaroh - truth", "bsip - figaroh"]
    assert float(rows[2][3]) < 1e-9
