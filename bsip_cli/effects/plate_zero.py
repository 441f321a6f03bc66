"""A force plate's channel with a constant offset."""

from __future__ import annotations

import numpy as np

from bsip_cli.effects.channel_words import OF_A_PLATE, unit_of
from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.plate_frame import CHANNELS, in_world, loaded_plates, plate_of
from bsip_cli.effects.scene import Scene


class PlateZero(Effect):
    name = "plate_zero"
    of_the_lab = True
    of_the_plates = True
    looks = "a constant difference in one channel, with and without load"
    remedy = "step off the plate for five seconds"

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return tuple(f"{p} {c}" for p in loaded_plates(scene) for c in CHANNELS)

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        if target.rsplit(" ", 1)[1].startswith("f"):
            return (Parameter("offset", "N", -200.0, 200.0, 10.0),)
        return (Parameter("offset", "N m", -100.0, 100.0, 5.0),)

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        name, channel = target.rsplit(" ", 1)
        reading = np.zeros((len(scene.times_s), 6))
        reading[:, CHANNELS.index(channel)] = values[0]
        return in_world(plate_of(scene, name), reading)

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        name, channel = target.rsplit(" ", 1)
        return (
            f"plate {name} reads {OF_A_PLATE[channel]} with a constant offset of {values[0]:+.1f} "
            f"{unit_of(channel)}"
        )
