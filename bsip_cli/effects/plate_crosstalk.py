"""A channel of a force plate that leaks into another."""

from __future__ import annotations

import numpy as np

from bsip_cli.effects.channel_words import OF_A_PLATE
from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.plate_frame import (
    CHANNELS,
    in_channel,
    loaded_alone_or_all,
    plates_called,
    plates_of,
    shown,
)
from bsip_cli.effects.scene import Scene

MOST = 0.08  # makers state 1 to 3 %; what leaks more is no crosstalk


class PlateCrosstalk(Effect):
    """A force channel also shows a part of another one, in one plate or, with the same amplifiers
    and no calibration, in all."""

    name = "plate_crosstalk"
    of_the_lab = True
    of_the_plates = True
    looks = (
        "one channel repeats another one, smaller: a horizontal force or a moment with "
        "the shape of the vertical force"
    )
    remedy = "load the plate with a weight at several places"

    def targets(self, scene: Scene) -> tuple[str, ...]:
        pairs = [(a, b) for a in CHANNELS[:3] for b in CHANNELS[:3] if a != b]
        return tuple(f"{p} {a}>{b}" for p in loaded_alone_or_all(scene) for a, b in pairs)

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        return (Parameter("coefficient", "1", -MOST, MOST, 0.02),)

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        name, pair = target.rsplit(" ", 1)
        source, sink = (CHANNELS.index(c) for c in pair.split(">"))
        leaks = [in_channel(p, sink, shown(p, source)) for p in plates_of(scene, name)]
        return values[0] * np.sum(leaks, axis=0)

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        name, pair = target.rsplit(" ", 1)
        source, sink = pair.split(">")
        return (
            f"{100 * values[0]:+.1f} % of {OF_A_PLATE[source]} of {plates_called(name)} leaks into "
            f"{OF_A_PLATE[sink]}"
        )
