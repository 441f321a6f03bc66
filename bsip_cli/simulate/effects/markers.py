"""Markers that slip, are mistaken for each other, are smoothed, or stand still.

Names that begin with ``outside_`` are outside the catalogue.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from scipy.signal import butter, sosfiltfilt

from bsip_cli.instruments.readings import Instruments
from bsip_cli.simulate.effects.base import Effect, Target, direction
from bsip_cli.simulate.numerics import frame_of, glide, rotate, runs, step

SLIP_S = 0.05
SOFT = 0.1  # of the window of a slide, in which it speeds up, and slows down
COMPANIONS = 3
CLOSE_PAIRS = 5
LEAST_FRAMES = 15  # a shorter stretch between gaps is not smoothed
BURST_FRAMES = (4, 12)


@dataclass(frozen=True, eq=False)
class MarkerShift(Effect, name="marker_shift"):
    """A marker slips along the skin, within SLIP_S, and stays there.

    along : (3,) unit vector in the frame of the three markers that keep their distance to
        it best. from_share : the part of a trial after which it slips, unless from_s is given.
    """

    marker: str
    draw_of_marker: int
    along: np.ndarray
    from_share: float
    from_s: float | None

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        number, share = int(rng.integers(1 << 16)), float(rng.uniform(0.2, 0.6))
        from_s = target.settings.get("from_s")
        return cls(size, target.name, number, direction(rng), share, from_s)

    def measured(self, instruments: Instruments) -> Instruments:
        drawn = instruments.labels[self.draw_of_marker % len(instruments.labels)]
        column = instruments.column(self.marker or drawn)
        times = instruments.frame_times_s()
        start = self.from_share * times[-1] if self.from_s is None else self.from_s
        slipped = step(times, start, start + SLIP_S)
        frame = companion_frame(instruments.points_m, column)
        points = instruments.points_m.copy()
        points[:, column] += self.size * slipped[:, None] * rotate(frame, self.along)
        return replace(instruments, points_m=points)

    def place(self) -> str:
        return self.marker


@dataclass(frozen=True, eq=False)
class MarkerSlide(Effect, name="marker_slide"):
    """A marker slides along the skin for a part of the trial, and stays there.

    along : (3,) unit vector in the frame of the three markers that keep their distance to
        it best. window_share : start and end as parts of a trial.
    """

    marker: str
    draw_of_marker: int
    along: np.ndarray
    window_share: tuple[float, float]

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        number, start = int(rng.integers(1 << 16)), float(rng.uniform(0.1, 0.4))
        share = (start, start + float(rng.uniform(0.3, 0.5)))
        return cls(size, target.name, number, direction(rng), share)

    def measured(self, instruments: Instruments) -> Instruments:
        drawn = instruments.labels[self.draw_of_marker % len(instruments.labels)]
        column = instruments.column(self.marker or drawn)
        times = instruments.frame_times_s()
        start, end = (share * times[-1] for share in self.window_share)
        way = self.size * glide(times, start, end, SOFT * (end - start))
        points = instruments.points_m.copy()
        points[:, column] += way[:, None] * rotate(companion_frame(points, column), self.along)
        return replace(instruments, points_m=points)

    def place(self) -> str:
        return self.marker


def companion_frame(points_m: np.ndarray, column: int) -> np.ndarray:
    """(F, 3, 3) axes of the markers that keep their distance to a marker best.

    NaN where one of them is lost: then that frame of the marker is lost too.
    """
    distance = np.linalg.norm(points_m - points_m[:, [column]], axis=2)
    seen = np.isfinite(distance).mean(axis=0)
    spread = np.nanstd(np.where(seen > 0.5, distance, 0.0), axis=0)
    spread = np.where(seen > 0.5, spread, np.inf)
    spread[column] = np.inf
    a, b, c = points_m[:, np.argsort(spread, kind="stable")[:COMPANIONS]].transpose(1, 0, 2)
    return frame_of(b - a, c - a)


@dataclass(frozen=True, eq=False)
class MarkerSwap(Effect, name="marker_swap"):
    """Two markers carry each other's label for `size` seconds.

    start_share : where the window lies in each trial, 0 at its start and 1 at its end,
        unless start_s is given.
    """

    first: str
    second: str
    draw_of_pair: int
    start_share: float
    start_s: float | None

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        first, _, second = target.name.partition("+")
        if bool(first) != bool(second) or (first and first == second):
            raise cls.wrong_target(target.name)
        number, share = int(rng.integers(CLOSE_PAIRS)), float(rng.uniform(0.2, 0.8))
        return cls(size, first, second, number, share, target.settings.get("start_s"))

    def _pair(self, instruments: Instruments) -> tuple[int, int]:
        """The columns of the two markers."""
        if self.first:
            return instruments.column(self.first), instruments.column(self.second)
        points = np.nanmedian(instruments.points_m, axis=0)
        distance = np.linalg.norm(points[:, None] - points[None], axis=2)
        distance[np.tril_indices(len(points))] = np.inf
        flat = np.argsort(np.nan_to_num(distance, nan=np.inf), axis=None)[self.draw_of_pair]
        a, b = np.unravel_index(flat, distance.shape)
        return int(a), int(b)

    def measured(self, instruments: Instruments) -> Instruments:
        a, b = self._pair(instruments)
        times = instruments.frame_times_s()
        free = max(times[-1] - self.size, 0.0)
        start = self.start_share * free if self.start_s is None else self.start_s
        inside = np.flatnonzero((times >= start) & (times < start + self.size))
        points = instruments.points_m.copy()
        points[inside, a], points[inside, b] = points[inside, b].copy(), points[inside, a].copy()
        return replace(instruments, points_m=points)

    def place(self) -> str:
        return f"{self.first}+{self.second}" if self.first else ""


class OverSmoothing(Effect, name="over_smoothing"):
    """The lab delivers its markers after a Butterworth low-pass (order 4, zero phase) at `size`."""

    def measured(self, instruments: Instruments) -> Instruments:
        rate = instruments.marker_hz
        if self.size >= 0.5 * rate:
            return instruments
        # two passes of order 2: the corner is raised so that both together cut at `size`
        corner = self.size / (np.sqrt(2.0) - 1.0) ** 0.25
        filters = butter(2, min(corner, 0.49 * rate), fs=rate, output="sos")
        points = instruments.points_m.copy()
        for column in range(points.shape[1]):
            for part in runs(np.isfinite(points[:, column]).all(axis=1)):
                if part.stop - part.start >= LEAST_FRAMES:
                    points[part, column] = sosfiltfilt(filters, points[part, column], axis=0)
        return replace(instruments, points_m=points)


@dataclass(frozen=True, eq=False)
class RepeatedFrames(Effect, name="outside_repeated_frames"):
    """The cameras stall: bursts of frames repeat the last one; `size` is their part."""

    seed: int

    @classmethod
    def draw(cls, size: float, target: Target, rng: np.random.Generator) -> Self:
        return cls(size, int(rng.integers(1 << 31)))

    def measured(self, instruments: Instruments) -> Instruments:
        frames = len(instruments.points_m)
        rng = np.random.default_rng([self.seed, frames])
        source = np.arange(frames)
        longest = BURST_FRAMES[1]
        while np.mean(source != np.arange(frames)) < self.size and frames > 2 * longest:
            first = int(rng.integers(1, frames - longest))
            length = int(rng.integers(BURST_FRAMES[0], longest + 1))
            source[first : first + length] = source[first - 1]
        return replace(instruments, points_m=instruments.points_m[source])
