"""Markers that slip, slide, bear another's label, or were smoothed before they were delivered."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.special import ndtr

from bsip_cli.effects.effect import Effect, Parameter, Reported, explained_share, size_and_parts
from bsip_cli.effects.scene import Scene
from bsip_cli.motion.marker_events import two_levels
from bsip_cli.segments import mirrored

RISE_S = 0.04  # standard deviation of the ramp that smoothing leaves of a sudden change
APART_S = 0.5
BEFORE_S = 1.0
SKIN_M, MOMENT_S = 0.0015, 0.03  # to which place and moment are known: skin gives way
ASTRAY_M = 0.006  # a residual that stays, or changes its level, by this much
OWN_SHARE = 0.3  # of the marker's own squared residual that a shift must take away
SHIFT = tuple(Parameter(axis, "m", -0.15, 0.15, 0.02, known_to=SKIN_M) for axis in "xyz")
ABSORBED = Parameter("absorbed", "1", 0.0, 1.0, 0.25, (0.0, 0.5))


def step(times_s: np.ndarray, at_s: float, rise_s: float = RISE_S) -> np.ndarray:
    """(3, N) a smooth step from 0 to 1 and its first two derivatives [1/s, 1/s2]."""
    x = (times_s - at_s) / rise_s
    slope = np.exp(-0.5 * x**2) / np.sqrt(2 * np.pi) / rise_s
    return np.stack([ndtr(x), slope, -x * slope / rise_s])


def during(signal: np.ndarray, parts: np.ndarray) -> np.ndarray:
    """(N, 6, k) change of the wrench for a signal s, s', s'' (3, N)."""
    return np.einsum("dn,dnck->nck", signal, parts)


class MarkerShift(Effect):
    """A marker that slips on the skin and stays there.

    A marker sits elsewhere on its segment from a moment on, in the segment's axes.

    The pose follows it in part, which bends the simulated wrench; the rest stays as residual. A
    moment before the trial means throughout. Scaling that used the trial has put the model's marker
    between both places: ``absorbed`` is the part of the shift that it took.
    """

    def targets(self, scene: Scene) -> tuple[str, ...]:
        """Markers whose own residual asks for it."""
        if scene.residual_m is None:
            return scene.person.markers
        residual = scene.residual_m
        return scene.once("astray", lambda: _off_their_places(scene, residual))

    def agrees(self, scene: Scene, target: str, values: np.ndarray) -> bool:
        """Whether the marker's own residual follows."""
        if scene.residual_m is None:
            return True
        m = scene.person.markers.index(target)
        change = self.marker_change(scene, target, values)[:, m : m + 1]
        return explained_share(scene.residual_m[:, m : m + 1], change) > OWN_SHARE

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        """The moment: throughout, and where the marker's residual changes its level most; where
        none is known, anywhere."""
        first, last = scene.span_s
        residual, m = scene.residual_m, scene.person.markers.index(target)
        if residual is None:
            inside = [float(t) for t in np.arange(first + APART_S, last, APART_S)]
        else:
            at = scene.once(("level", m), lambda: _level_change(residual[:, m], scene.rate_hz))
            inside = [] if at is None else [float(scene.times_s[at])]
        moments, earliest = (first - BEFORE_S, *inside), first - BEFORE_S
        since = Parameter("from_time", "s", earliest, last, APART_S, moments, known_to=MOMENT_S)
        return *SHIFT, since, ABSORBED

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        m = scene.person.markers.index(target)

        def lacking() -> np.ndarray:
            """(3, N, 6, 3) what s, s' and s'' change of the simulated wrench, which lacks what the
            pose follows of an error s(t) along each axis."""
            return -scene.response.parts(scene.pose_response.of(self._directions(scene, m), [m]))

        parts = scene.once(("of a marker", m), lacking)
        return during(self.signal(scene, values), parts) @ values[:3]

    def signal(self, scene: Scene, values: np.ndarray) -> np.ndarray:
        """(3, N) the part of the shift by which the marker is off, and its derivatives."""
        signal = step(scene.times_s, values[3])
        signal[0] -= values[4]
        return signal

    def marker_change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        m = scene.person.markers.index(target)
        slipped = self.signal(scene, values)[0][:, None]
        errors = slipped * (self._directions(scene, m)[:, 0] @ values[:3])
        return scene.pose_response.left(errors[:, None, :, None], [m])[..., 0]

    def reported(self, scene: Scene, target: str, values: np.ndarray) -> Reported:
        """The slip's length and parts; one before the trial counts from its first frame."""
        since = float(max(values[3], scene.times_s[0]))
        return *size_and_parts("shift", "m", values), ("from_time", "s", since)

    def spoken(self, scene: Scene, target: str, values: np.ndarray) -> dict[str, Any]:
        late = values[3] > scene.times_s[0]
        since = f"from {values[3]:.1f} s on" if late else "throughout"
        return super().spoken(scene, target, values) | {"since": since}

    @staticmethod
    def _directions(scene: Scene, m: int) -> np.ndarray:
        """(N, 1, 3, 3) the axes of the marker's segment, world."""
        return scene.motion.rotation[:, None, scene.person.marker_segments[m]]


def _off_their_places(scene: Scene, residual_m: np.ndarray) -> tuple[str, ...]:
    """Markers whose residual stays, or changes its level, by ASTRAY_M."""
    found = []
    for m, name in enumerate(scene.person.markers):
        own = residual_m[:, m]
        if np.isfinite(own).all(axis=1).any():
            sizes, at = [np.nanmean(own, axis=0)], _level_change(own, scene.rate_hz)
            if at is not None:  # and the jump
                sizes.append(np.nanmean(own[at:], axis=0) - np.nanmean(own[:at], axis=0))
            if max(map(np.linalg.norm, sizes)) > ASTRAY_M:
                found.append(name)
    return tuple(found)


def _level_change(residual_m: np.ndarray, rate_hz: float) -> int | None:
    """Frame at which a residual (N, 3) splits into the two most different levels, if any can."""
    seen = np.flatnonzero(np.isfinite(residual_m).all(axis=1))
    least = round(APART_S * rate_hz)
    if len(seen) < 2 * least + 1:
        return None
    return int(seen[two_levels(residual_m[seen], least + 1, least)])


LEAST_S = 1.0  # what is faster is a slip
SPREAD = 1 / np.sqrt(12)  # standard deviation of an even ramp, part of its length
KNOTS = 17  # of the trial, between which it may slide
EDGE_S = 0.5  # to which its beginning and its end are known


class MarkerSlide(MarkerShift):
    """A marker that slides slowly along the skin.

    A marker leaves its place over a window and stays there, in the segment's axes.

    As in ``marker_shift``, but for the ramp: its middle and length.
    """

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        """The ramp is that which the marker's residual follows best."""
        first, last = scene.span_s
        residual, m = scene.residual_m, scene.person.markers.index(target)
        if residual is None:
            middle, length = 0.5 * (first + last), max(0.5 * (last - first), LEAST_S)
        else:
            key = ("slide", m)
            start, end = scene.once(key, lambda: ramp_of(scene.times_s, residual[:, m]))
            middle, length = 0.5 * (start + end), end - start
        longest, at, of = max(last - first, 2 * LEAST_S), EDGE_S / np.sqrt(2), EDGE_S * np.sqrt(2)
        return (
            *SHIFT,
            Parameter("middle", "s", first, last, 1.0, (middle,), known_to=at),
            Parameter("length", "s", LEAST_S, longest, 2.0, (length,), known_to=of),
            ABSORBED,
        )

    def signal(self, scene: Scene, values: np.ndarray) -> np.ndarray:
        """A ramp with round ends, of the same spread in time as an even one."""
        signal = step(scene.times_s, values[3], SPREAD * values[4])
        signal[0] -= values[5]
        return signal

    def reported(self, scene: Scene, target: str, values: np.ndarray) -> Reported:
        """The way's length and parts, and when it begins and ends."""
        start, end = (float(values[3] + side * values[4] / 2) for side in (-1, 1))
        return *size_and_parts("way", "m", values), ("start", "s", start), ("end", "s", end)


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
    """(N,) from 0 to 1, as of :meth:`MarkerSlide.signal`."""
    return step(times_s, 0.5 * (start_s + end_s), SPREAD * (end_s - start_s))[0]


NEARER = 0.5  # distance to the other's place over that to the own
SWAPPED_M = 0.03  # from the own place, at least
SWAPPED_S = 0.05  # at least


class MarkerSwap(Effect):
    """Two markers that bear each other's labels for a while.

    The labels of two markers are exchanged between two moments; ``share`` is 1 if they are.

    Only pairs that can be mistaken (one segment, or a left and a right one) and that for a while
    lie at least twice as near to the other's place in the model as to their own.
    """

    def targets(self, scene: Scene) -> tuple[str, ...]:
        return tuple(_mistaken(scene))

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        first, last = scene.span_s
        start, end = _mistaken(scene)[target]
        return (
            Parameter("share", "1", 0.0, 1.5, 1.0),
            Parameter("start", "s", first, last, 0.1, (start,)),
            Parameter("end", "s", first, last, 0.1, (end,)),
        )

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """The simulated wrench lacks what the pose follows of exchanged labels."""
        start, end = float(values[1]), float(values[2])

        def lacking() -> np.ndarray:
            return -scene.response.of(_pulled(scene, _pair(scene, target), start, end)[1])[..., 0]

        return values[0] * scene.once((self.name, target, start, end), lacking)

    def marker_change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        pair = _pair(scene, target)
        errors, moved = _pulled(scene, pair, float(values[1]), float(values[2]))
        return values[0] * scene.pose_response.left(errors, pair, moved)[..., 0]

    def possible(self, scene: Scene, target: str, values: np.ndarray) -> bool:
        least = self.least_named["share"]
        return bool(least <= values[0] < 1.5 and values[1] < values[2])

    def reported(self, scene: Scene, target: str, values: np.ndarray) -> Reported:
        return (("start", "s", float(values[1])), ("end", "s", float(values[2])))

    def spoken(self, scene: Scene, target: str, values: np.ndarray) -> dict[str, Any]:
        pair = dict(zip(("first", "second"), target.split("+"), strict=True))
        return super().spoken(scene, target, values) | pair


def _pair(scene: Scene, target: str) -> tuple[int, int]:
    first, second = target.split("+")
    return scene.person.markers.index(first), scene.person.markers.index(second)


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


def _mistaken(scene: Scene) -> dict[str, tuple[float, float]]:
    """Pairs and their windows [s]."""
    residual = scene.residual_m
    if residual is None:
        return {}

    def pairs() -> dict[str, tuple[float, float]]:
        names, segments = scene.person.markers, scene.person.skeleton.segments
        own = np.linalg.norm(residual, axis=2)
        found = {}
        for a, b in combinations(range(len(names)), 2):
            home, other = (segments[scene.person.marker_segments[k]] for k in (a, b))
            if other not in (home, mirrored(home)):
                continue
            hit = np.ones(len(own), dtype=bool)
            for k, j in ((a, b), (b, a)):
                across = np.linalg.norm(scene.markers_m[:, k] - scene.model_markers_m[:, j], axis=1)
                hit &= (own[:, k] > SWAPPED_M) & (across < NEARER * own[:, k])
            if hit.sum() >= max(2, SWAPPED_S * scene.rate_hz):
                first, *_, last = scene.times_s[hit]
                half = 0.5 / scene.rate_hz
                found[f"{names[a]}+{names[b]}"] = (float(first) - half, float(last) + half)
        return found

    return scene.once(MarkerSwap.name, pairs)


CUTOFFS_HZ = (1.0, 1.3, 1.6, 2.0, 2.5, 3.0, 3.7, 4.5, 5.5, 7.0, 9.0)
FILTERS_HZ = 0.08  # to which a cut-off says what a filter does: labs use more kinds than one
ROUNDS = 4  # of restoring what a low-pass took; more restore what is no longer there
# Two passes of order two: each cuts at this multiple of where both together pass 1/sqrt(2).
CORNER = (np.sqrt(2.0) - 1.0) ** -0.25


class OverSmoothing(Effect):
    """Markers that were low-passed before they were delivered.

    The markers went through a zero-phase Butterworth of order four, and the pose with them.

    ``share`` is 1 where the cut-off is right.
    """

    def parameters(self, scene: Scene, target: str) -> tuple[Parameter, ...]:
        cutoffs = tuple(f for f in CUTOFFS_HZ if CORNER * f < 0.4 * scene.rate_hz)
        most = min(12.0, 0.45 * scene.rate_hz / CORNER)
        return (
            Parameter("share", "1", 0.0, 2.0, 1.0),
            Parameter("cutoff", "Hz", 0.5, most, 0.5, cutoffs, known_to=FILTERS_HZ),
        )

    def change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """The simulated wrench lacks what the filter took."""
        share, cutoff = float(values[0]), float(values[1])
        scanned = self.parameters(scene, target)[1].scan
        # All that are scanned cost little more than one.
        cutoffs = scanned if cutoff in scanned else (cutoff,)

        def lacking() -> np.ndarray:
            lost = np.stack([_lost_m(scene, one) for one in cutoffs], axis=-1)
            return scene.response.of(scene.pose_response.of(lost))

        return share * scene.once((self.name, cutoffs), lacking)[..., cutoffs.index(cutoff)]

    def marker_change(self, scene: Scene, target: str, values: np.ndarray) -> np.ndarray:
        """The filter bends the body: markers that move on circles come nearer to the centre."""
        errors = -values[0] * _lost_m(scene, float(values[1]))[..., None]
        return scene.pose_response.left(errors)[..., 0]

    def reported(self, scene: Scene, target: str, values: np.ndarray) -> Reported:
        """The cut-off whose loss is the share: at low frequencies it falls like the fourth
        power."""
        return (("cutoff", "Hz", float(values[1] * max(values[0], 1e-6) ** -0.25)),)


def _lost_m(scene: Scene, cutoff_hz: float) -> np.ndarray:
    """(N, m, 3) what the filter took from the markers, of the model's own, which have no noise."""
    from scipy.signal import butter, sosfiltfilt  # heavy

    sections = butter(2, CORNER * cutoff_hz, fs=scene.rate_hz, output="sos")
    padding = min(len(scene.q) - 1, round(2 * scene.rate_hz / cutoff_hz))
    left, lost = scene.model_markers_m, np.zeros_like(scene.model_markers_m)
    # Van Cittert: (1 - L) + (1 - L)^2 + ... is 1/L - 1, what the low-pass L took.
    for _ in range(ROUNDS):
        left = left - sosfiltfilt(sections, left, axis=0, padlen=padding)
        lost = lost + left
    return lost
