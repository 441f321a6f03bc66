"""A marker whose tape gives way slowly."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from bsip_cli.simulate.curves import glide
from bsip_cli.simulate.effects.base import Effect, Target, direction
from bsip_cli.simulate.effects.marker_errors import companion_frame
from bsip_cli.simulate.instruments import Instruments
from bsip_cli.simulate.rotations import rotate

SOFT = 0.1  # of the window, in which it speeds up, and slows down


@dataclass(frozen=True, eq=False)
class MarkerSlide(Effect):
    """A marker slides along the skin for a part of the trial, and stays there.

    along : (3,) unit vector in the frame of the three markers that keep their distance to
        it best. window_share : start and end as parts of a trial.
    """

    marker: str
    draw_of_marker: int
    along: np.ndarray
    window_share: tuple[float, float]

    name = "marker_slide"
    unit = "m"
    least, most = 0.0, 0.15
    targets = "a marker's label (else drawn)"
    spares_static = True
    injectable = True

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        number, start = int(rng.integers(1 << 16)), float(rng.uniform(0.1, 0.4))
        share = (start, start + float(rng.uniform(0.3, 0.5)))
        return cls(size, target.name, number, direction(rng), share)

    def label(self, instruments: Instruments) -> str:
        """The marker that slides."""
        return self.marker or instruments.labels[self.draw_of_marker % len(instruments.labels)]

    def measured(self, instruments: Instruments) -> Instruments:
        column = instruments.column(self.label(instruments))
        times = instruments.frame_times_s()
        start, end = (share * times[-1] for share in self.window_share)
        way = self.size * glide(times, start, end, SOFT * (end - start))
        points = instruments.points_m.copy()
        points[:, column] += way[:, None] * rotate(companion_frame(points, column), self.along)
        return instruments.with_points(points)

    def place(self) -> str:
        return self.marker
