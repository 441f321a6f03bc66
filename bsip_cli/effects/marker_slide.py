"""A marker that slides slowly along the skin."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from bsip_cli.effects.effect import Parameter
from bsip_cli.effects.marker_course import step
from bsip_cli.effects.marker_shift import ABSORBED, SKIN_M, MarkerShift
from bsip_cli.effects.scene import Scene

LEAST_S = 1.0  # what is faster is a slip
SPREAD = 1 / np.sqrt(12)  # standard deviation of an even ramp, part of its length
KNOTS = 17  # of the trial, between which it may slide
EDGE_S = 0.5  # to which its beginning and its end are known


class MarkerSlide(MarkerShift):
    """A marker leaves its place over a window and stays there, in the segment's axes.

    As in ``marker_shift``, but for the ramp: its middle and length.
    """

    name = "marker_slide"
    looks = "one marker's residual grows steadily for some seconds and stays"
    remedy = "fasten the marker on dry skin and record the trial again"

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        first, last = float(scene.times_s[0]), float(scene.times_s[-1])
        middle, length = self._window(scene, target)
        longest = max(last - first, 2 * LEAST_S)
        return (
            *(Parameter(axis, "m", -0.15, 0.15, 0.02, known_to=SKIN_M) for axis in "xyz"),
            Parameter("middle", "s", first, last, 1.0, (middle,), known_to=EDGE_S / np.sqrt(2)),
            Parameter(
                "length", "s", LEAST_S, longest, 2.0, (length,), known_to=EDGE_S * np.sqrt(2)
            ),
            Parameter("absorbed", "1", 0.0, 1.0, 0.25, ABSORBED),
        )

    def course(self, scene: Scene, values: np.ndarray) -> np.ndarray:
        """A ramp with round ends, of the same spread in time as an even one."""
        course = step(scene.times_s, values[3], SPREAD * values[4])
        course[0] -= values[5]
        return course

    def reported(
        self, scene: Scene, target: str, values: np.ndarray
    ) -> tuple[tuple[str, str, float], ...]:
        """The way's length and parts, and when it begins and ends."""
        parts = tuple((f"way_{c}", "m", float(x)) for c, x in zip("xyz", values, strict=False))
        start, end = (float(values[3] + side * values[4] / 2) for side in (-1, 1))
        way = float(np.linalg.norm(values[:3]))
        return (("way", "m", way), *parts, ("start", "s", start), ("end", "s", end))

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        size, half = 1000 * np.linalg.norm(values[:3]), values[4] / 2
        return (
            f"marker {target} slides {size:.0f} mm along its segment from {values[3] - half:.1f} "
            f"to {values[3] + half:.1f} s"
        )

    @staticmethod
    def _window(scene: Scene, target: str) -> tuple[float, float]:
        """Middle and length of the ramp that the marker's residual follows best."""
        residual = scene.residual_m
        if residual is None:
            first, last = float(scene.times_s[0]), float(scene.times_s[-1])
            return 0.5 * (first + last), max(0.5 * (last - first), LEAST_S)
        m = scene.person.markers.index(target)
        key = ("slide", m)
        start, end = scene.once(key, lambda: ramp_of(scene.times_s, residual[:, m]))
        return 0.5 * (start + end), end - start


def ramp_of(times_s: np.ndarray, residual_m: np.ndarray) -> tuple[float, float]:
    """Start and end of the ramp that a residual (N, 3) follows best, by least squares."""
    seen = np.isfinite(residual_m).all(axis=1)
    knots = np.linspace(times_s[0], times_s[-1], KNOTS)
    pairs = [pair for pair in combinations(knots, 2) if pair[1] - pair[0] >= LEAST_S]
    if not pairs or not seen.any():
        return float(times_s[0]), float(times_s[0]) + LEAST_S
    ramps = np.stack([ramp(times_s[seen], *pair) for pair in pairs])
    ramps -= ramps.mean(axis=1, keepdims=True)
    own = residual_m[seen] - residual_m[seen].mean(axis=0)
    squares = np.maximum((ramps**2).sum(axis=1), 1e-12)
    start, end = pairs[int(np.argmax(((ramps @ own) ** 2).sum(axis=1) / squares))]
    return float(start), float(end)


def ramp(times_s: np.ndarray, start_s: float, end_s: float) -> np.ndarray:
    """(N,) from 0 to 1, as of :meth:`MarkerSlide.course`."""
    return step(times_s, 0.5 * (start_s + end_s), SPREAD * (end_s - start_s))[0]
