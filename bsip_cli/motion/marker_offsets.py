"""Markers that sit elsewhere than in the calibration, throughout a trial or from a moment on."""

from __future__ import annotations

import numpy as np

from bsip_cli.motion.level_change import two_levels
from bsip_cli.motion.marker_events import BEYOND, Kind, MarkerEvent, event
from bsip_cli.motion.marker_fit import MEDIAN_LENGTH, MarkerFit, best_source

_OFFSET = 3.0  # trusted distances, and spreads of the marker about its median
_STANDS_OUT = 5.0  # over the median of all markers' median residuals
_LEAST_SHARE = 0.1  # of the frames show the marker
_STAYS_S = 0.5  # at the calibrated place before, and elsewhere after
_IN_PLACE = 0.3  # of the later residual at most, while the marker is in its place


def offsets(fit: MarkerFit, residual: np.ndarray) -> list[MarkerEvent]:
    """Events; residuals (N, m, 3) without jumps and slips.

    The median residual of a marker must exceed ``_OFFSET`` times what it is trusted to and its
    spread, and stand out from the median residuals of the others. Marker after marker is named
    whose displacement explains most of all markers' median residuals. One that was in its place
    first has slipped: where the pose follows a slip, joint angles seem to explain it, and the
    search for slips is blind to it.
    """
    seen = np.isfinite(residual[..., 0])
    enough = seen.sum(axis=0) >= max(3, _LEAST_SHARE * len(residual))
    if not enough.any():
        return []
    mean, spread = np.full(residual.shape[1:], np.nan), np.zeros(residual.shape[1])
    mean[enough] = np.nanmedian(residual[:, enough], axis=0)
    about = np.linalg.norm(residual[:, enough] - mean[enough], axis=2)
    spread[enough] = np.nanmedian(about, axis=0) / MEDIAN_LENGTH
    usual = float(np.median(np.linalg.norm(mean[enough], axis=1)))
    limit = np.maximum(_OFFSET * np.maximum(fit.trusted_m, spread), _STANDS_OUT * usual)
    sd = np.where(enough, np.hypot(max(usual, 1e-4), spread), np.nan)
    # Where two markers make a segment's pose, it takes up most of an offset.
    least = BEYOND * fit.trusted_m
    least = np.minimum(least, np.maximum(0.5 * least, _STANDS_OUT * usual))
    events: list[MarkerEvent] = []
    for _ in range(len(mean)):
        shown = np.linalg.norm(mean, axis=1)
        candidates = [int(m) for m in np.flatnonzero(enough) if shown[m] > least[m]]
        if not candidates:
            break
        m, vector = best_source(fit.response, mean, sd, candidates)
        size = float(np.linalg.norm(vector))
        if size < limit[m]:
            break
        start = _leaves_its_place(residual[:, m], mean[m], round(_STAYS_S / fit.step_s()))
        kind: Kind = "slip" if start else "offset"
        frames = slice(start, len(residual))
        events.append(event(fit, kind, m, frames, size, float(_OFFSET * size / limit[m])))
        mean = mean - np.einsum("jak,k->ja", fit.response[:, :, m], vector)
        mean[m] = 0.0
    return events


def _leaves_its_place(residual: np.ndarray, level: np.ndarray, least: int) -> int:
    """Frame from which a marker's residual (N, 3) is at a level (3,) and not near zero; 0 where
    it never was."""
    along = residual @ level / (level @ level)
    seen = np.flatnonzero(np.isfinite(along))
    if len(seen) < 2 * least:
        return 0
    x = along[seen]
    split = two_levels(x[:, None], least, least)
    in_place = abs(x[:split].mean()) < _IN_PLACE * x[split:].mean()
    return int(seen[split]) if in_place else 0
