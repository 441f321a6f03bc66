"""Force plates whose forces are scaled wrongly."""

from __future__ import annotations

import numpy as np

from bsip_cli.effects.channel_words import OF_A_PLATE
from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.plate_frame import (
    CHANNELS,
    in_channel,
    loaded_alone_or_all,
    plates_of,
    plates_that,
    shown,
)
from bsip_cli.effects.scene import Scene

TYPICAL = 0.04  # a quarter of it is not told: plates of one lab differ by some tenths of a percent


class PlateGain(Effect):
    """One force channel, in the own axes of a plate or of all, shows 1 + gain times the truth."""

    name = "plate_gain"
    of_the_lab = True
    of_the_plates = True
    looks = (
        "forces of one plate or channel are too large or too small in proportion; in "
        "stance the mass is off by the same part"
    )
    remedy = "weigh the person on a scale; lay a known weight on the plate"

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return tuple(f"{p} {c}" for p in loaded_alone_or_all(scene) for c in CHANNELS[:3])

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        return (Parameter("gain", "1", -0.15, 0.15, TYPICAL),)

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        name, channel = target.rsplit(" ", 1)
        share, k = values[0] / (1 + values[0]), CHANNELS.index(channel)
        parts = [in_channel(p, k, share * shown(p, k)) for p in plates_of(scene, name)]
        return np.sum(parts, axis=0)

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        name, channel = target.rsplit(" ", 1)
        order = "large" if values[0] > 0 else "small"
        reads = plates_that(name, "reads", "read")
        return f"{reads} {OF_A_PLATE[channel]} {100 * abs(values[0]):.1f} % too {order}"
