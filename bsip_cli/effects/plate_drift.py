"""A force plate's channel that drifts through the trial."""

from __future__ import annotations

import numpy as np

from bsip_cli.effects.channel_words import OF_A_PLATE, unit_of
from bsip_cli.effects.effect import Parameter
from bsip_cli.effects.plate_frame import ChannelCourse
from bsip_cli.effects.scene import Scene


class PlateDrift(ChannelCourse):
    """Linear, zero where the trial begins."""

    name = "plate_drift"
    of_the_lab = False
    looks = "a difference in one channel that grows evenly with time"
    remedy = "step off the plate at the beginning and at the end"

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        duration = float(np.ptp(scene.times_s))
        if target.rsplit(" ", 1)[1].startswith("f"):
            return (Parameter("drift", "N/s", -20.0, 20.0, 15.0 / duration),)
        return (Parameter("drift", "N m/s", -10.0, 10.0, 7.0 / duration),)

    def course(self, scene: Scene) -> np.ndarray:
        return scene.times_s - scene.times_s[0]

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        name, channel = target.rsplit(" ", 1)
        return (
            f"plate {name} reads {OF_A_PLATE[channel]} with a drift of {values[0]:+.2f} "
            f"{unit_of(channel)} per second"
        )
