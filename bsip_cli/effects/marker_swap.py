"""Two markers that bear each other's labels for a while."""

from __future__ import annotations

from itertools import combinations
from types import MappingProxyType

import numpy as np
from scipy.ndimage import gaussian_filter1d

from bsip_cli.body.names import mirrored
from bsip_cli.effects.effect import Effect, Parameter
from bsip_cli.effects.marker_course import RISE_S
from bsip_cli.effects.scene import Scene

NEARER = 0.5  # distance to the other's place over that to the own
ASTRAY_M = 0.03  # from the own place, at least
LEAST_S = 0.05


class MarkerSwap(Effect):
    """The labels of two markers are exchanged between two moments; ``share`` is 1 if they are.

    Only pairs that can be mistaken (one segment, or a left and a right one) and that for a while
    lie at least twice as near to the other's place in the model as to their own.
    """

    name = "marker_swap"
    of_the_lab = False
    least_named = MappingProxyType({"share": 0.5})  # labels are exchanged or not
    looks = "residuals of two markers jump by their distance, and jump back at the end"
    remedy = "look at the labels of the two markers in the recording and exchange them"

    def targets(self, scene: Scene) -> tuple[str, ...]:
        if scene.residual_m is None:
            return ()
        return tuple(scene.once(self.name, lambda: _suspects(scene)))

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        first, last = float(scene.times_s[0]), float(scene.times_s[-1])
        start, end = scene.once(self.name, lambda: _suspects(scene))[target]
        return (
            Parameter("share", "1", 0.0, 1.5, 1.0),
            Parameter("start", "s", first, last, 0.1, (start,)),
            Parameter("end", "s", first, last, 0.1, (end,)),
        )

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        start, end = float(values[1]), float(values[2])
        key = (self.name, target, start, end)
        return values[0] * scene.once(key, lambda: _wrench(scene, _pair(scene, target), start, end))

    def marker_change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        pair = _pair(scene, target)
        errors, moved = _pulled(scene, pair, float(values[1]), float(values[2]))
        return values[0] * scene.pose_response.left(errors, pair, moved)[..., 0]

    def possible(self, scene: Scene, target: str, values: np.ndarray) -> bool:
        least = self.least_named["share"]
        return bool(least <= values[0] < 1.5 and values[1] < values[2])

    def reported(
        self, scene: Scene, target: str, values: np.ndarray
    ) -> tuple[tuple[str, str, float], ...]:
        return (("start", "s", float(values[1])), ("end", "s", float(values[2])))

    def sentence(self, scene: Scene, target: str, values: np.ndarray) -> str:
        first, second = target.split("+")
        return (
            f"markers {first} and {second} bear each other's labels from {values[1]:.2f} to "
            f"{values[2]:.2f} s"
        )


def _pair(scene: Scene, target: str) -> tuple[int, int]:
    first, second = target.split("+")
    return scene.person.markers.index(first), scene.person.markers.index(second)


def _wrench(scene: Scene, pair: tuple[int, int], start_s: float, end_s: float) -> np.ndarray:
    """(N, 6) what the simulated wrench lacks when the pose follows exchanged labels."""
    _, moved = _pulled(scene, pair, start_s, end_s)
    return -scene.response.of(moved)[..., 0]


def _pulled(
    scene: Scene, pair: tuple[int, int], start_s: float, end_s: float
) -> tuple[np.ndarray, np.ndarray]:
    """Errors (N, 2, 3, 1) of the two markers, world, and what the pose follows of them (N, nv, 1).

    An error is from where the marker is to where its label was seen. A marker so far off pulls
    with the trust of its frame, not with the mean over neighbours that are not exchanged.
    """
    inside = (scene.times_s >= start_s) & (scene.times_s <= end_s)
    apart = scene.markers_m[:, pair[0]] - scene.markers_m[:, pair[1]]
    errors = (inside[:, None, None] * np.stack([apart, -apart], axis=1))[..., None]
    weights = scene.trust[:, pair] * scene.person.marker_weights[list(pair)]
    pull = weights / np.maximum(scene.pose_response.weights[:, pair], 1e-9)
    moved = scene.pose_response.of(pull[..., None, None] * errors, pair)
    return errors, gaussian_filter1d(moved, RISE_S * scene.rate_hz, axis=0, mode="nearest")


def _suspects(scene: Scene) -> dict[str, tuple[float, float]]:
    """Pairs and their windows [s]."""
    assert scene.residual_m is not None
    names, segments = scene.person.markers, scene.person.skeleton.segments
    own = np.linalg.norm(scene.residual_m, axis=2)
    found = {}
    for a, b in combinations(range(len(names)), 2):
        home, other = (segments[scene.person.marker_segments[k]] for k in (a, b))
        if other not in (home, mirrored(home)):
            continue
        hit = np.ones(len(own), dtype=bool)
        for k, j in ((a, b), (b, a)):
            across = np.linalg.norm(scene.markers_m[:, k] - scene.model_markers_m[:, j], axis=1)
            hit &= (own[:, k] > ASTRAY_M) & (across < NEARER * own[:, k])
        if hit.sum() >= max(2, LEAST_S * scene.rate_hz):
            times = scene.times_s[hit]
            half = 0.5 / scene.rate_hz
            found[f"{names[a]}+{names[b]}"] = (float(times[0]) - half, float(times[-1]) + half)
    return found
