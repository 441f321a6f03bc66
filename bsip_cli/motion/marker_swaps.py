"""Markers that bear each other's labels."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from bsip_cli.motion.marker_events import MarkerEvent, event, pieces
from bsip_cli.motion.marker_fit import MarkerFit

Refit = Callable[[np.ndarray, np.ndarray], MarkerFit]

_FAR = 3.0  # own residual over the trusted distance and over the trial's median residual
_NEARER = 0.5  # distance to the other's place over that to the own
_BRIDGE_S = 0.1  # breaks within one swap
_UNSEEN_S = 0.25  # a reversal is looked for over gaps up to this long
_ARM, _LEG = ("upper_arm", "forearm", "hand"), ("thigh", "shank", "foot")
_LIMBS = (_ARM, ("upper_torso", *_ARM), _LEG)  # the shoulders' labels may go with the arms'
_LATERAL_M = 0.05  # a marker of the trunk this far beside its middle belongs to a side
_MIRRORED_M = 0.1  # the places of a pair are mirrored to this
_LIMB_FRAMES = 24
_MOST = 12
_LARGEST_M = 0.2  # a marker farther off says no more


@dataclass(frozen=True)
class _Pair:
    """Two markers, the frames (N,) in which they may be exchanged, and how sharp the signs are."""

    a: int
    b: int
    hit: np.ndarray
    ratio: float
    reverses: bool


def swaps(fit: MarkerFit, refit: Refit) -> tuple[list[MarkerEvent], MarkerFit]:
    """Events of pairs, and the fit with their labels put right.

    Two signs, and either is enough. The path's: the line between the two reverses from one frame
    to the next, which no segment does; it shows also where the pose follows the labels. The
    model's: both markers are far from their own places and at least twice as near to the other's.
    One wrong pair may turn a whole limb of the model over, so pairs are put right one at a time,
    and one after which the poses fit no better is none.
    """
    events: list[MarkerEvent] = []
    refused: set[tuple[int, int]] = set()
    for _ in range(_MOST):
        pairs = [one for one in _suspects(fit) if (one.a, one.b) not in refused]
        if not pairs:
            break
        pair = max(pairs, key=lambda one: (one.reverses, one.ratio * one.hit.sum()))
        refused.add((pair.a, pair.b))
        unseen = ~np.isfinite(_line(fit, pair.a, pair.b)[:, 0])
        found = pieces(pair.hit, unseen, 1 + round(_BRIDGE_S / fit.step_s()))
        order = np.tile(np.arange(len(fit.labels)), (len(fit.times_s), 1))
        for piece in found:
            order[piece, pair.a], order[piece, pair.b] = pair.b, pair.a
        again = refit(exchanged(fit.measured_m, order), fit.times_s)
        if not _misfit_m(again.distance_m()) < _misfit_m(fit.distance_m()):
            continue
        for piece in found:
            apart = float(np.nanmedian(np.linalg.norm(_line(fit, pair.a, pair.b)[piece], axis=1)))
            events.append(event(fit, "swap", pair.a, piece, apart, pair.ratio, partner=pair.b))
        fit = again
    return events, fit


def _suspects(fit: MarkerFit) -> list[_Pair]:
    own = fit.distance_m()
    usual = float(np.nanmedian(own)) if np.isfinite(own).any() else 0.0
    far = _FAR * max(float(fit.trusted_m.min()), usual)
    found = []
    for a, b in _pairs(fit.segments):
        pair = own[:, [a, b]]
        across = np.linalg.norm(fit.measured_m[:, [a, b]] - fit.model_m[:, [b, a]], axis=2)
        with np.errstate(invalid="ignore"):
            hit = (pair > far).all(axis=1) & (across < _NEARER * pair).all(axis=1)
        hit, sharp = _between_reversals(fit, a, b, hit, far)
        if hit.any():
            ratio = float(np.nanmedian(pair[hit] / np.maximum(across[hit], 1e-4)))
            found.append(_Pair(a, b, hit, max(ratio, sharp), sharp > 0))
    return found


def exchanged(markers: np.ndarray, order: np.ndarray) -> np.ndarray:
    """Markers (N, m, 3) with, under each label, the one that ``order`` (N, m) says."""
    return np.take_along_axis(markers, order[..., None], axis=1)


def swapped_limbs(fit: MarkerFit, refit: Refit) -> tuple[list[MarkerEvent], np.ndarray]:
    """Both arms or both legs exchanged throughout: events, and order (N, m).

    All markers of one limb pull the other limb's model over, or turn the trunk round, so single
    pairs need not show it. Where the markers fit badly, the poses are fitted again to some frames
    with the limbs exchanged; if that at least halves the residual of all markers, they are.
    """
    frames = np.unique(np.linspace(0, len(fit.times_s) - 1, _LIMB_FRAMES).astype(int))
    before = _misfit_m(fit.distance_m()[frames])
    same = np.tile(np.arange(len(fit.labels)), (len(fit.times_s), 1))
    if not before > _FAR * fit.trusted_m.min():
        return [], same
    tried = []
    for limb in _LIMBS:
        pairs, order = _mirrored_pairs(fit, limb), same.copy()
        for a, b in pairs:
            order[:, [a, b]] = order[:, [b, a]]
        again = refit(exchanged(fit.measured_m, order)[frames], fit.times_s[frames])
        tried.append((_misfit_m(again.distance_m()), pairs, order))
    after, pairs, order = min(tried, key=lambda one: one[0])
    if not after < _NEARER * before:
        return [], same
    whole, events = slice(0, len(fit.times_s)), []
    for a, b in pairs:
        apart = float(np.nanmedian(np.linalg.norm(_line(fit, a, b), axis=1)))
        events.append(event(fit, "swap", a, whole, apart, before / after, partner=b))
    return events, order


def _misfit_m(distance: np.ndarray) -> float:
    near = np.minimum(distance[np.isfinite(distance)], _LARGEST_M)
    return float(np.sqrt(np.mean(near**2))) if len(near) else 0.0


def _pairs(segments: tuple[str, ...]) -> Iterator[tuple[int, int]]:
    for a, first in enumerate(segments):
        for b in range(a + 1, len(segments)):
            if segments[b] in (first, _mirrored(first)):
                yield a, b


def _mirrored(segment: str) -> str:
    other = {"_l": "_r", "_r": "_l"}.get(segment[-2:])
    return segment[:-2] + other if other else segment


def _mirrored_pairs(fit: MarkerFit, limb: tuple[str, ...]) -> list[tuple[int, int]]:
    """Markers of the right side of some segments and those that lie mirrored on the left one."""
    side = np.array(
        [
            {"_r": 1, "_l": -1}.get(name[-2:], int(np.sign(z)) * (abs(z) > _LATERAL_M))
            for name, z in zip(fit.segments, fit.place_m[:, 2], strict=True)
        ]
    )
    near = sorted(
        (float(np.linalg.norm(fit.place_m[a] * [1.0, 1.0, -1.0] - fit.place_m[b])), a, b)
        for a, segment in enumerate(fit.segments)
        for b, other in enumerate(fit.segments)
        if segment.removesuffix("_r") in limb and other == _mirrored(segment)
        if side[a] == 1 and side[b] == -1 and np.isfinite(_line(fit, a, b)).any()
    )
    pairs: list[tuple[int, int]] = []
    for apart, a, b in near:
        if apart < _MIRRORED_M and not {a, b} & {k for pair in pairs for k in pair}:
            pairs.append((a, b))
    return pairs


def _line(fit: MarkerFit, a: int, b: int) -> np.ndarray:
    return fit.measured_m[:, a] - fit.measured_m[:, b]


def _between_reversals(
    fit: MarkerFit, a: int, b: int, hit: np.ndarray, far: float
) -> tuple[np.ndarray, float]:
    """The hits; where the line between two markers reverses, all frames between reversals.

    Also its length over what it lacks of an exact reversal, 0 where there is none.
    """
    line = _line(fit, a, b)
    seen = np.flatnonzero(np.isfinite(line[:, 0]))
    if len(seen) < 4:
        return hit, 0.0
    d, length = line[seen], np.linalg.norm(line[seen], axis=1)
    change = np.linalg.norm(np.diff(d, axis=0), axis=1)
    lacking = np.linalg.norm(d[1:] + d[:-1], axis=1)
    turned = lacking < 0.5 * length[1:]
    turned &= (length[1:] > far) & (np.diff(fit.times_s[seen]) < _UNSEEN_S)
    calm = np.ones(len(turned), dtype=bool)  # the line moves little before it reverses
    calm[1:] = (change[:-1] < 0.5 * length[1:-1]) | turned[:-1]
    flips = np.flatnonzero(turned & calm) + 1
    if not len(flips):
        return hit, 0.0
    state = np.zeros(len(seen), dtype=int)
    state[flips] = 1
    state = np.cumsum(state) % 2
    own = fit.distance_m()[seen][:, [a, b]].sum(axis=1)
    shares = [float(hit[seen[state == k]].mean()) for k in (0, 1)]
    means = [float(own[state == k].mean()) for k in (0, 1)]
    if max(shares) > 0.1:
        wrong = int(np.argmax(shares))
    elif max(means) > 1.5 * min(means):
        wrong = int(np.argmax(means))
    else:
        wrong = int((state == 1).mean() < 0.5)
    between = np.zeros(len(hit), dtype=bool)
    between[seen[state == wrong]] = True
    sharp = float(np.median(length[flips] / np.maximum(lacking[flips - 1], 1e-4)))
    return between, sharp
