"""One low-pass for everything that a trial's forces are compared in."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy import sparse

from bsip_cli.dynamics.lowpass import lowpass_operator, stride_to
from bsip_cli.effects.scene import Scene, standing_place_m

ENOUGH_HZ = 50.0
_OVERSAMPLING = 2.5


@dataclass(frozen=True, eq=False)
class Filter:
    """One low-pass for everything: operator (n, N), frames (n,), spans of neighbouring samples."""

    operator: sparse.csr_array
    frames: np.ndarray
    spans: tuple[tuple[int, int], ...]
    reference_m: np.ndarray
    rate_hz: float

    def __call__(self, wrench: np.ndarray) -> np.ndarray:
        """(n, 6, k) of world wrenches (N, 6, k) about the origin: moments about the reference."""
        flat = self.operator @ wrench.reshape(len(wrench), -1)
        filtered = flat.reshape(len(self.frames), 6, -1)
        filtered[:, 3:] -= np.cross(self.reference_m, filtered[:, :3], axisb=1, axisc=1)
        return filtered

    def one(self, wrench: np.ndarray) -> np.ndarray:
        """(n, 6) of one world wrench (N, 6)."""
        return self(wrench[..., None])[..., 0]


def filter_of(scene: Scene, cutoff_hz: float) -> Filter:
    """Low-pass and decimation inside the valid stretches, moments about where the person stands."""
    stride = stride_to(scene.rate_hz, _OVERSAMPLING * cutoff_hz)
    operator, frames = lowpass_operator(scene.valid, scene.rate_hz, cutoff_hz, stride)
    cuts = np.flatnonzero(np.diff(frames) != stride) + 1
    edges = [0, *cuts.tolist(), len(frames)]
    place, rate_hz = standing_place_m(scene), scene.rate_hz / stride
    return Filter(operator, frames, tuple(pairwise(edges)), place, rate_hz)


def at_full_rate(filter_: Filter, scene: Scene, cutoff_hz: float) -> Filter:
    """The filter of a slower trial for courses of the whole one, with the same samples."""
    operator, frames = lowpass_operator(scene.valid, scene.rate_hz, cutoff_hz)
    stride = round(scene.rate_hz / slow(scene).rate_hz)
    return replace(filter_, operator=operator[np.searchsorted(frames, filter_.frames * stride)])


def slow(scene: Scene) -> Scene:
    """The trial at the rate at which nuisances and signatures, smooth as they are, are computed."""
    return scene.once("slow", lambda: scene.every(stride_to(scene.rate_hz, ENOUGH_HZ)))
