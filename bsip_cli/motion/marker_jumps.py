"""Markers that leave their place for a moment: ghosts, flickers, badly filled gaps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter

from bsip_cli.motion.marker_events import BEYOND, MarkerEvent, event, pieces
from bsip_cli.motion.marker_fit import MEDIAN_LENGTH, MarkerFit, best_source

_WINDOW_S = 0.5  # of the running median: a jump lasts at most half of it
_JUMP = 8.0  # spreads
_LEAST_FRAMES = 5
_SAME = 0.7  # a jump that another one explains to 30 % is the pose's


@dataclass(frozen=True)
class _Jump:
    m: int
    frames: slice


def jumps(
    fit: MarkerFit, residual: np.ndarray, filled: np.ndarray | None
) -> tuple[list[MarkerEvent], np.ndarray]:
    """Events, and (N, m) frames in which a marker is astray.

    A jump exceeds ``_JUMP`` spreads of the marker about its running median, of all markers in the
    same frame (at an impact all shake), and of the noise; half of it comes or goes within two
    frames, and the measured path shows it.
    """
    away = _away(residual, 2 * max(2, round(0.5 * _WINDOW_S / fit.step_s())) + 1)
    distance = np.linalg.norm(away, axis=2)
    astray = np.zeros(distance.shape, dtype=bool)
    if not np.isfinite(distance).any():
        return [], astray
    own = _median(distance, 0)[None] / MEDIAN_LENGTH
    frame = _median(distance, 1)[:, None] / MEDIAN_LENGTH
    spread = np.maximum(np.maximum(own, frame), fit.noise_m())
    with np.errstate(invalid="ignore"):
        beyond = distance > np.maximum(_JUMP * spread, BEYOND * fit.trusted_m)
    longest = round(0.5 * _WINDOW_S / fit.step_s())
    found = []
    for m in range(len(fit.labels)):
        for piece in pieces(beyond[:, m], ~np.isfinite(distance[:, m]), 2):
            if piece.stop - piece.start <= longest and _is_own(fit, m, piece, distance[:, m]):
                found.append(_Jump(m, piece))
                astray[piece, m] = True
    events = []
    for jump, size in _own(fit, away, spread, found):
        m, piece = jump.m, jump.frames
        gap = filled is not None and filled[piece, m].mean() > 0.5
        note = ", where a gap was filled" if gap else ""
        statistic = float(np.nanmax(distance[piece, m]) / spread[piece, m].max())
        events.append(event(fit, "jump", m, piece, size, statistic, note=note))
    return events, astray


def _own(
    fit: MarkerFit, away: np.ndarray, spread: np.ndarray, found: list[_Jump]
) -> list[tuple[_Jump, float]]:
    """The jumps without those that another one at the same time drags along, and their sizes."""
    distance = np.linalg.norm(away, axis=2)
    left = sorted(found, key=lambda one: -float(np.nanmax(distance[one.frames, one.m])))
    own: list[tuple[_Jump, float]] = []
    while left:
        first = left[0]
        together = [one for one in left if one is first or _overlap(one.frames, first.frames)]
        peak = first.frames.start + int(np.nanargmax(distance[first.frames, first.m]))
        sd = np.hypot(spread[peak], 0.1 * distance[peak, first.m])
        candidates = [one.m for one in together if np.isfinite(distance[peak, one.m])]
        m, vector = best_source(fit.response, away[peak], sd, candidates)
        made = np.einsum("jak,k->ja", fit.response[:, :, m], vector)
        missed = np.linalg.norm(away[peak] - made, axis=1)
        source = next(one for one in together if one.m == m)
        size = max(float(np.linalg.norm(vector)), float(np.nanmax(distance[source.frames, m])))
        own.append((source, size))
        dragged = [one for one in together if not missed[one.m] > _SAME * distance[peak, one.m]]
        left = [one for one in left if one is not source and one not in dragged]
    return own


def _overlap(a: slice, b: slice) -> bool:
    return a.start < b.stop + 1 and b.start < a.stop + 1


def _away(residual: np.ndarray, width: int) -> np.ndarray:
    """Residual less its running median over the visible frames, NaN where missing."""
    away = np.full(residual.shape, np.nan)
    for m in range(residual.shape[1]):
        seen = np.flatnonzero(np.isfinite(residual[:, m, 0]))
        if len(seen) >= _LEAST_FRAMES:
            size = min(width, len(seen) | 1)
            for axis in range(residual.shape[2]):  # one-dimensional, it costs a tenth
                own = residual[seen, m, axis]
                away[seen, m, axis] = own - median_filter(own, size=size, mode="nearest")
    return away


def _median(distance: np.ndarray, axis: int) -> np.ndarray:
    seen = np.isfinite(distance).any(axis=axis)
    out = np.zeros(len(seen))
    kept = distance[:, seen] if axis == 0 else distance[seen]
    out[seen] = np.nanmedian(kept, axis=axis)
    return out


def _is_own(fit: MarkerFit, m: int, piece: slice, distance: np.ndarray) -> bool:
    """Half of the jump comes or goes within two frames, and the measured path shows it.

    The path is compared with the straight line through the two frames before: a pose that another
    marker bends leaves it smooth.
    """
    seen = np.flatnonzero(np.isfinite(fit.measured_m[:, m, 0]))
    path, model = fit.measured_m[seen, m], fit.model_m[seen, m]
    first, last = np.searchsorted(seen, [piece.start, piece.stop - 1])
    half = 0.5 * float(np.nanmax(distance[piece]))
    for edge, back in ((first, -1), (last, 1)):
        before, earlier = edge + back, edge + 2 * back
        if min(before, earlier) < 0 or max(before, earlier) >= len(seen):
            continue
        for k in {edge, min(max(edge - back, first), last)}:
            step = (path[k] - model[k]) - (path[before] - model[before])
            length = float(np.linalg.norm(step))
            straight = path[before] + (path[before] - path[earlier]) * abs(k - before)
            if length > half and (path[k] - straight) @ step > 0.5 * length**2:
                return True
    return False
