"""Joint moments against OpenSim's InverseDynamicsTool on the exported model, motion and loads."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bsip_cli.body.exports import model_text
from bsip_cli.body.exports.opensim_motion import coordinates, loads, loads_xml, mot_text, setup_xml
from bsip_cli.dynamics.ground_wrench import pinocchio_model
from bsip_cli.dynamics.joint_moments import joint_loads
from tests.body.standing_person import Swing, joint_frames, standing
from tests.dynamics.test_joint_moments import KNOWN, feet, phi_of
from tests.exports.exported_person import identified_person
from tests.exports.opensim_files import by_coordinate, of_the_tool

pytest.importorskip("opensim", reason="the reader is not installed: opensim")

RATE_HZ = 200.0
KNOWN_S = (0.3, 1.2)  # when the plates tell the feet's forces


def test_moments_of_inverse_dynamics_tool(tmp_path):
    body = identified_person()
    person = body.person
    swing = Swing(pinocchio_model(person), standing().q, 3, 0.25)
    times, q, v, a = swing.sampled(1.5, RATE_HZ)
    ground = feet(len(q) * 5)
    ground = {s: type(g)(g.wrench[::5], g.noise[::5], g.noise_at_m) for s, g in ground.items()}
    found = joint_loads(person, q, v, a, phi_of(body), ground, KNOWN)
    told = np.flatnonzero((times >= KNOWN_S[0]) & (times <= KNOWN_S[1]))
    wrenches = {s: g.wrench[told] for s, g in ground.items()}
    torques = of_the_tool(written(tmp_path, body, times, q, times[told], wrenches))
    R, _ = joint_frames(person, q)
    for name, mine in by_coordinate(person, R, found).items():
        theirs = np.interp(times[told], torques["time"], torques[name])
        assert np.abs(mine[told] - theirs).max() < max(0.002 * np.abs(theirs).max(), 0.02), name


def written(folder: Path, body, times, q, told_s, wrenches) -> Path:
    """Model, motion, loads and the set-up of the tool."""
    (folder / "model.osim").write_text(model_text("osim", body))
    motion = coordinates(body.person.skeleton, q)
    (folder / "motion.mot").write_text(mot_text("motion", times, motion, ["from bsip"]))
    (folder / "loads.mot").write_text(mot_text("loads", told_s, loads(wrenches), ["from bsip"]))
    (folder / "loads.xml").write_text(loads_xml([*wrenches], "loads.mot", ["from bsip"]))
    files = {"model_file": "model.osim", "coordinates_file": "motion.mot"}
    files |= {"external_loads_file": "loads.xml"}
    text = setup_xml("moments", files, told_s[0], told_s[-1], ["from bsip"])
    (folder / "moments.xml").write_text(text)
    return folder / "moments.xml"
