"""Joint moments against OpenSim's InverseDynamicsTool on the exported model, motion and loads."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bsip_cli.body.exports.opensim_motion import coordinates, loads, loads_xml, mot_text, setup_xml
from bsip_cli.body.exports.osim import COORDINATES, osim_text
from bsip_cli.dynamics.joint_moments import joint_loads
from bsip_cli.dynamics.pinocchio_model import pinocchio_model
from tests.body.standing_person import Swing, joint_frames, standing
from tests.dynamics.test_joint_moments import KNOWN, feet, phi_of
from tests.exports.exported_person import identified_person

opensim = pytest.importorskip("opensim", reason="the reader is not installed: opensim")

RATE_HZ = 200.0
KNOWN_S = (0.3, 1.2)  # when the plates tell the feet's forces


def test_moments_of_inverse_dynamics_tool(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # the tool looks for its files where it runs
    body = identified_person()
    person = body.person
    swing = Swing(pinocchio_model(person), standing().q, 3, 0.25)
    times, q, v, a = swing.sampled(1.5, RATE_HZ)
    ground = feet(len(q) * 5)
    ground = {s: type(g)(g.wrench[::5], g.noise[::5], g.noise_at_m) for s, g in ground.items()}
    found = joint_loads(person, q, v, a, phi_of(body), ground, KNOWN)
    told = np.flatnonzero((times >= KNOWN_S[0]) & (times <= KNOWN_S[1]))
    wrenches = {s: g.wrench[told] for s, g in ground.items()}
    torques = by_opensim(tmp_path, body, times, q, times[told], wrenches)
    R, _ = joint_frames(person, q)
    for j, joint in enumerate(found.joints):
        i = j + 1
        kind = person.skeleton.joint_types[i]
        of_opensim = np.stack([torques[f"{joint}_{part}"] for part in COORDINATES[kind]], axis=1)
        side = np.array([1.0, -1.0, -1.0] if joint.endswith("_l") else [1.0, 1.0, 1.0])
        mine = found.moment_Nm[:, j, :, 0] * side
        if kind == "revolute":
            parent = R[:, person.skeleton.parents[i]]
            first, third = parent @ [0, 0, 1], R[:, i] @ [0, 1, 0]
            second = np.cross(third, first)
            second /= np.linalg.norm(second, axis=1, keepdims=True)
            axes = np.stack([first, second, third], axis=1)
            moment = np.linalg.solve(axes, mine[..., None])[..., 0]
            mine = np.einsum("nc,nc->n", moment, R[:, i] @ person.hinge_axes()[i])[:, None]
        apart = np.abs(mine - of_opensim)[told].max()
        assert apart < max(0.002 * np.abs(of_opensim[told]).max(), 0.02), joint


def by_opensim(folder: Path, body, times, q, told_s, wrenches) -> dict[str, np.ndarray]:
    """By coordinate, (N,) what the tool computes from the exported files."""
    (folder / "model.osim").write_text(osim_text(body))
    motion = coordinates(body.person.skeleton, q)
    (folder / "motion.mot").write_text(mot_text("motion", times, motion, ["from bsip"]))
    (folder / "loads.mot").write_text(mot_text("loads", told_s, loads(wrenches), ["from bsip"]))
    (folder / "loads.xml").write_text(loads_xml([*wrenches], "loads.mot", ["from bsip"]))
    files = {"model_file": "model.osim", "coordinates_file": "motion.mot"}
    files |= {"external_loads_file": "loads.xml"}
    text = setup_xml("moments", files, told_s[0], told_s[-1], ["from bsip"])
    (folder / "setup.xml").write_text(text)
    opensim.Logger.setLevelString("error")
    tool = opensim.InverseDynamicsTool(str(folder / "setup.xml"))
    assert tool.run()
    table = opensim.TimeSeriesTable(str(folder / "moments.sto"))
    at = np.array(table.getIndependentColumn())
    ends = ("_moment", "_force")
    found = {}
    for label in table.getColumnLabels():
        course = np.interp(times, at, table.getDependentColumn(label).to_numpy())
        found[label.removesuffix(ends[0]).removesuffix(ends[1])] = course
    return found
