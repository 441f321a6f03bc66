"""Axes of the lab and of the cameras that are not those of plates and gravity."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.dynamics.segment_motion import UP
from bsip_cli.effects.effect import Effect, Parameter, Reported, Words
from bsip_cli.effects.scene import Scene


class Turned(Effect):
    """Something of the lab is turned against the rest by the angles about x and y (rotation
    vector)."""

    is_of_laboratory = True
    numbers = tuple(Parameter(f"angle_{axis}", "rad", -0.2, 0.2, 0.01) for axis in "xy")

    def reported(self, scene: Scene, target: str, values: np.ndarray) -> Reported:
        """The angle, and its parts about the lab's axes."""
        parts = super().reported(scene, target, values)
        return (("angle", "rad", float(np.hypot(*values))), *parts)


class GravityTilt(Turned):
    """A lab whose Z axis is not the vertical.

    The lab's axes are turned against the world by the angles about x and y (rotation vector).

    Markers and plates are turned together, so only gravity does not point down the lab's Z.
    """

    name = "gravity_tilt"
    looks = (
        "a constant horizontal force in stance, in proportion to the weight and the same "
        "on all plates; in flight the body falls aside"
    )
    remedy = "hang a plumb line into the lab and measure it with two markers"

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        down = scene.model.gravity.linear
        turned = Rotation.from_rotvec([values[0], values[1], 0.0]).apply(down)
        weight = scene.mass_kg * (down - turned)
        force = np.broadcast_to(weight, (len(scene.times_s), 3))
        return np.hstack([force, np.cross(scene.centre_of_mass_m, force)])

    def words(self, scene: Scene, target: str, values: np.ndarray) -> Words:
        what = f"the lab's Z axis is {np.degrees(np.hypot(*values)):.2f} degrees off the vertical"
        return Words(what, is_signed=False)


class CameraFrame(Turned):
    """Cameras whose axes are turned against plates and gravity.

    All markers are turned about the origin by the angles about x and y (rotation vector).

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
        centre = scene.centre_of_mass_m
        back = Rotation.from_rotvec([-values[0], -values[1], 0.0]).as_matrix().T
        force, moment = np.split(scene.predicted - scene.at_rest, 2, axis=1)
        moved = centre @ back - centre
        return np.hstack([force @ back - force, moment @ back - moment + np.cross(moved, weight)])

    def words(self, scene: Scene, target: str, values: np.ndarray) -> Words:
        degrees = np.degrees(np.hypot(*values))
        what = f"the cameras' axes are turned by {degrees:.2f} degrees against plates and gravity"
        return Words(what, is_signed=False)
