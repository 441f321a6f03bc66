"""Cameras whose axes are turned against plates and gravity."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.dynamics.segment_motion import UP
from bsip_cli.effects.gravity_tilt import Turned
from bsip_cli.effects.scene import Scene


class CameraFrame(Turned):
    """All markers are turned about the origin by the angles about x and y (rotation vector).

    A turn about the vertical is one of all plates the other way: ``plate_rotation``.
    """

    name = "camera_frame"
    looks = (
        "in stance the centre of pressure goes aside by the height of the body times the "
        "angle, alike on all plates"
    )
    remedy = "lay the calibration frame of the cameras on a plate, level, and calibrate again"

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """The same motion turned back, under the same gravity."""
        weight = scene.mass_kg * GRAVITY_M_S2 * UP
        centre, back = scene.centre_of_mass_m, Rotation.from_rotvec([-values[0], -values[1], 0.0])
        standing = np.hstack([np.broadcast_to(weight, centre.shape), np.cross(centre, weight)])
        force, moment = np.split(scene.predicted - standing, 2, axis=1)
        moved = back.apply(centre) - centre
        return np.hstack(
            [back.apply(force) - force, back.apply(moment) - moment + np.cross(moved, weight)]
        )

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        degrees = np.degrees(np.hypot(*values))
        return f"the cameras' axes are turned by {degrees:.2f} degrees against plates and gravity"
