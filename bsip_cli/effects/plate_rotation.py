"""A force plate that is turned against what the file says."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.plate_frame import loaded_plates, plate_of
from bsip_cli.effects.scene import Scene

_SMALL_DEG = 0.1  # not worth a word


class PlateRotation(Effect):
    """The plate is truly turned about its centre: measured are the true vectors turned back."""

    name = "plate_rotation"
    of_the_lab = True
    of_the_plates = True
    remedy = "stand on the plate, push forwards and sideways, then turn by 90 degrees and repeat"

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return loaded_plates(scene)

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        return tuple(Parameter(n, "rad", -0.5, 0.5, 0.02) for n in ("tilt_x", "tilt_y", "yaw"))

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        plate = plate_of(scene, target)
        wrench, centre = np.nan_to_num(plate.wrench), plate.centre_m()
        force = wrench[:, :3]
        moment = wrench[:, 3:] - np.cross(centre, force)
        true = Rotation.from_rotvec(values)
        dforce, dmoment = force - true.apply(force), moment - true.apply(moment)
        return np.hstack([dforce, dmoment + np.cross(centre, dforce)])

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        x, y, yaw = np.degrees(values)
        turned = f"turned by {yaw:+.1f} degrees about the vertical"
        tilted = f"tilted by {np.hypot(x, y):.1f} degrees"
        if np.hypot(x, y) < _SMALL_DEG:
            return f"plate {target} is {turned}"
        if abs(yaw) < _SMALL_DEG:
            return f"plate {target} is {tilted}"
        return f"plate {target} is {turned} and {tilted}"
