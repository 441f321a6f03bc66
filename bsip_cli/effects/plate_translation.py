"""Force plates that lie elsewhere than the file says."""

from __future__ import annotations

import numpy as np

from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.plate_frame import loaded_alone_or_all, plates_of, plates_that
from bsip_cli.effects.scene import Scene

# Feet deform where they press, and a body whose mass lies ahead of the model's looks alike; the
# height shows only where forces point sideways, and there arms heavier than the model's do.
KNOWN_TO_M = (0.001, 0.001, 0.015)
# Far away is a plate that was moved; its height is off by the depth of its sensors, if by anything.
MOST_M = (0.3, 0.3, 0.1)

HEIGHT_TOLD_MM = 60.0  # three times what bodies of another table seem to be higher or lower
HEIGHT_ALONE_MM = 20.0  # what they seem to be


class PlateTranslation(Effect):
    """The plate, or every plate, truly lies at its stated place plus the shift: the measured moment
    lacks shift x force."""

    name = "plate_translation"
    of_the_lab = True
    of_the_plates = True
    looks = (
        "the measured centre of pressure lies beside the simulated one by the same "
        "distance wherever the person stands; forces agree"
    )
    remedy = "stand on the plate with both feet, then turn by 90 degrees and stand again"

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return loaded_alone_or_all(scene)

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        return tuple(
            Parameter(axis, "m", -most, most, 0.02, known_to=known)
            for axis, most, known in zip("xyz", MOST_M, KNOWN_TO_M, strict=True)
        )

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        loads = [np.nan_to_num(plate.wrench[:, :3]) for plate in plates_of(scene, target)]
        force = np.sum(loads, axis=0)
        return np.hstack([np.zeros_like(force), -np.cross(values, force)])

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        x, y, z = 1000 * values
        sideways = np.hypot(x, y)
        least = min(HEIGHT_TOLD_MM, max(HEIGHT_ALONE_MM, sideways))
        height = f", height {z:+.0f} mm" if abs(z) > least else ""
        return (
            f"{plates_that(target, 'lies', 'lie')} {sideways:.0f} mm sideways from where the "
            f"file says (lab X {x:+.0f} mm, Y {y:+.0f} mm{height})"
        )
