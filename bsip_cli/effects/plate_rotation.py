"""Force plates that are turned against what the file says."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.plate_frame import loaded_alone_or_all, plates_of, plates_that
from bsip_cli.effects.scene import Scene

_SMALL_DEG = 0.1  # not worth a word


class PlateRotation(Effect):
    """The plate is truly turned about its centre, or all plates about the middle of their centres:
    measured are the true vectors turned back."""

    name = "plate_rotation"
    of_the_lab = True
    of_the_plates = True
    looks = (
        "horizontal forces that point aside in proportion to the force on the plate; with"
        " a tilt, a horizontal force in quiet stance"
    )
    remedy = "stand on the plate, push forwards and sideways, then turn by 90 degrees and repeat"

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return loaded_alone_or_all(scene)

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        return tuple(Parameter(n, "rad", -0.5, 0.5, 0.02) for n in ("tilt_x", "tilt_y", "yaw"))

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        plates = plates_of(scene, target)
        wrench = np.sum([np.nan_to_num(plate.wrench) for plate in plates], axis=0)
        centre = np.mean([plate.centre_m() for plate in plates], axis=0)
        force = wrench[:, :3]
        moment = wrench[:, 3:] - np.cross(centre, force)
        true = Rotation.from_rotvec(values)
        dforce, dmoment = force - true.apply(force), moment - true.apply(moment)
        return np.hstack([dforce, dmoment + np.cross(centre, dforce)])

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        x, y, yaw = np.degrees(values)
        turned = f"turned by {yaw:+.1f} degrees about the vertical"
        tilted = f"tilted by {np.hypot(x, y):.1f} degrees"
        are = plates_that(target, "is", "are")
        if np.hypot(x, y) < _SMALL_DEG:
            return f"{are} {turned}"
        if abs(yaw) < _SMALL_DEG:
            return f"{are} {tilted}"
        return f"{are} {turned} and {tilted}"
