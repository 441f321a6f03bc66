"""A trial's artifacts as the scene that effects and diagnosis work on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bsip_cli.body.person import Person
from bsip_cli.effects.scene import Plate, Scene
from bsip_cli.motion.jacobian import marker_residuals
from bsip_cli.stages.frames import WRENCH, coordinates_from, markers_from, ordered_markers
from bsip_cli.stages.known_loads import load_phi
from bsip_cli.study import Trial
from bsip_cli.unit import Unit


def scene_of(unit: Unit, person: Person, phi: np.ndarray, trial: Trial | None = None) -> Scene:
    """Motion, plates and marker residuals of a trial; phi (10 n,) of the person alone.

    Known loads are part of what is simulated.
    """
    kinematics, wrench = unit.read("kinematics", trial), unit.read("wrench", trial)
    corners = unit.read("plates", trial)
    plates = tuple(
        Plate(
            str(number),
            rows.sort_values("corner")[["x_m", "y_m", "z_m"]].to_numpy(),
            wrench[[f"plate{number}_{name}" for name in WRENCH]].to_numpy(),
        )
        for number, rows in corners.groupby("plate")
    )
    _, labels, positions = markers_from(unit.read("markers", trial))
    markers = ordered_markers(labels, positions, person.markers)
    q, v, a = coordinates_from(kinematics, person.skeleton)
    valid = wrench["valid"].to_numpy() & kinematics["determined"].to_numpy()
    scene = Scene(
        kinematics["time_s"].to_numpy(),
        person,
        q,
        v,
        a,
        phi + load_phi(unit, person, trial),
        plates,
        valid,
        robust_limit_m=unit.config.ik.robust_limit_m,
    )
    return replace(scene, residual_m=marker_residuals(person, q, markers))
