"""Markers that sit elsewhere than in the calibration throughout a trial."""

from __future__ import annotations

import numpy as np

from bsip_cli.motion.marker_events import BEYOND, MarkerEvent, event
from bsip_cli.motion.marker_fit import MarkerFit, best_source

_OFFSET = 3.0  # trusted distances, and spreads of the marker about its median
_STANDS_OUT = 5.0  # over the median of all markers' median residuals
_LEAST_SHARE = 0.1  # of the frames show the marker
_MEDIAN_LENGTH = 1.538


def offsets(fit: MarkerFit, residual: np.ndarray) -> list[MarkerEvent]:
    """Events; residuals (N, m, 3) without jumps and slips.

    The median residual of a marker must exceed ``_OFFSET`` times what it is trusted to and its
    spread, and stand out from the median residuals of the others. Marker after marker is named
    whose displacement explains most of all markers' median residuals.
    """
    seen = np.isfinite(residual[..., 0])
    enough = seen.sum(axis=0) >= max(3, _LEAST_SHARE * len(residual))
    if not enough.any():
        return []
    mean, spread = np.full(residual.shape[1:], np.nan), np.zeros(residual.shape[1])
    mean[enough] = np.nanmedian(residual[:, enough], axis=0)
    about = np.linalg.norm(residual[:, enough] - mean[enough], axis=2)
    spread[enough] = np.nanmedian(about, axis=0) / _MEDIAN_LENGTH
    usual = float(np.median(np.linalg.norm(mean[enough], axis=1)))
    limit = np.maximum(_OFFSET * np.maximum(fit.trusted_m, spread), _STANDS_OUT * usual)
    sd = np.where(enough, np.hypot(max(usual, 1e-4), spread), np.nan)
    events: list[MarkerEvent] = []
    for _ in range(len(mean)):
        shown = np.linalg.norm(mean, axis=1)
        candidates = [
            int(m) for m in np.flatnonzero(enough) if shown[m] > BEYOND * fit.trusted_m[m]
        ]
        if not candidates:
            break
        m, vector = best_source(fit.response, mean, sd, candidates)
        size = float(np.linalg.norm(vector))
        if size < limit[m]:
            break
        whole = slice(0, len(residual))
        events.append(event(fit, "offset", m, whole, size, _OFFSET * size / limit[m]))
        mean = mean - np.einsum("jak,k->ja", fit.response[:, :, m], vector)
        mean[m] = 0.0
    return events
