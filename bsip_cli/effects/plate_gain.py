"""A force plate whose forces are scaled wrongly."""

from __future__ import annotations

import numpy as np

from bsip_cli.effects.channel_words import OF_A_PLATE
from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.plate_frame import CHANNELS, in_plate, in_world, loaded_plates, plate_of
from bsip_cli.effects.scene import Scene


class PlateGain(Effect):
    """One force channel, in the plate's own axes, shows 1 + gain times the truth."""

    name = "plate_gain"
    of_the_lab = True
    of_the_plates = True
    remedy = "weigh the person on a scale; lay a known weight on the plate"

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return tuple(f"{p} {c}" for p in loaded_plates(scene) for c in CHANNELS[:3])

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        return (Parameter("gain", "1", -0.15, 0.15, 0.03),)

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        name, channel = target.rsplit(" ", 1)
        plate = plate_of(scene, name)
        reading = in_plate(plate, np.nan_to_num(plate.wrench))
        change = np.zeros_like(reading)
        k = CHANNELS.index(channel)
        change[:, k] = reading[:, k] * values[0] / (1 + values[0])
        return in_world(plate, change)

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        name, channel = target.rsplit(" ", 1)
        order = "large" if values[0] > 0 else "small"
        return f"plate {name} reads {OF_A_PLATE[channel]} {100 * abs(values[0]):.1f} % too {order}"
