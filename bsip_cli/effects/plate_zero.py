"""A force plate's channel with a constant offset."""

from __future__ import annotations

import numpy as np

from bsip_cli.effects.channel_words import OF_A_PLATE, unit_of
from bsip_cli.effects.effect import Parameter
from bsip_cli.effects.plate_frame import ChannelCourse
from bsip_cli.effects.scene import Scene


class PlateZero(ChannelCourse):
    name = "plate_zero"
    of_the_lab = True
    looks = "a constant difference in one channel, with and without load"
    remedy = "step off the plate for five seconds"

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        if target.rsplit(" ", 1)[1].startswith("f"):
            return (Parameter("offset", "N", -200.0, 200.0, 10.0),)
        return (Parameter("offset", "N m", -100.0, 100.0, 5.0),)

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        name, channel = target.rsplit(" ", 1)
        return (
            f"plate {name} reads {OF_A_PLATE[channel]} with a constant offset of {values[0]:+.1f} "
            f"{unit_of(channel)}"
        )
