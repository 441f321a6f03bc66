"""Force plates whose forces are scaled wrongly."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bsip_cli.effects.channel_words import OF_A_PLATE
from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.plate_frame import (
    CHANNELS,
    in_plate,
    in_world,
    loaded_alone_or_all,
    plates_of,
    plates_that,
)
from bsip_cli.effects.scene import Plate, Scene
from bsip_cli.effects.simulated_loads import with_simulated_load

TYPICAL = 0.04  # a quarter of it is not told: plates of one lab differ by some tenths of a percent
KNOWN_TO = 0.002  # a body whose mass lies elsewhere than the table's pushes as if weighed otherwise


class PlateGain(Effect):
    """One force channel, in the own axes of a plate or of all, shows 1 + gain times the truth: what
    is simulated."""

    name = "plate_gain"
    of_the_lab = True
    of_the_plates = True
    remedy = "weigh the person on a scale; lay a known weight on the plate"

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return tuple(f"{p} {c}" for p in loaded_alone_or_all(scene) for c in CHANNELS[:3])

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        return (Parameter("gain", "1", -0.15, 0.15, TYPICAL, known_to=KNOWN_TO),)

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        name, channel = target.rsplit(" ", 1)
        gain, k = values[0], CHANNELS.index(channel)
        wrong = {plate.name for plate in plates_of(scene, name)}
        share = gain / (1 + gain)
        right = [
            replace(p, wrench=p.wrench - share * _alone(p, k)) if p.name in wrong else p
            for p in scene.plates
        ]
        true = with_simulated_load(scene, right)
        return gain * np.sum([_alone(plate, k) for plate in true if plate.name in wrong], axis=0)

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        name, channel = target.rsplit(" ", 1)
        order = "large" if values[0] > 0 else "small"
        reads = plates_that(name, "reads", "read")
        return f"{reads} {OF_A_PLATE[channel]} {100 * abs(values[0]):.1f} % too {order}"


def _alone(plate: Plate, channel: int) -> np.ndarray:
    """(N, 6) what one channel carries."""
    reading = in_plate(plate, np.nan_to_num(plate.wrench))
    part = np.zeros_like(reading)
    part[:, channel] = reading[:, channel]
    return in_world(plate, part)
