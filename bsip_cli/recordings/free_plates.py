"""When nobody can be on a plate, by the markers: the feet are seen elsewhere."""

from __future__ import annotations

import numpy as np

from bsip_cli.recordings.model import Plate, Recording

_LOW_M = 0.3  # above the plate: whoever stands on it has a marker below this height
_CLEAR_M = 0.3  # beyond the outline
_FEWEST_LOW = 2  # markers seen low in a frame: the feet are in view
_AFTER_STEP_S = 0.1  # beside a frame that is not clear


def nobody_near(recording: Recording, plate: Plate) -> np.ndarray:
    """Samples at which all low markers are in view and far from the plate, (n_analog,) bool.

    Nowhere if the plate's outline is unknown or fewer than two markers are ever low.
    """
    n_analog = len(plate.usable)
    if plate.corners_m is None or not recording.labels:
        return np.zeros(n_analog, bool)
    centre = plate.corners_m.mean(axis=0)
    reach = np.linalg.norm(plate.corners_m - centre, axis=1).max() + _CLEAR_M
    seen = np.isfinite(recording.markers_m).all(axis=-1)
    height = np.nan_to_num(recording.markers_m[..., 2], nan=np.inf) - centre[2]
    low = seen & (height < _LOW_M)
    always_low = low.sum(axis=0) >= 0.9 * len(seen)  # seen low nearly throughout: feet
    offset = recording.markers_m[..., :2] - centre[:2]
    distance = np.nan_to_num(np.linalg.norm(offset, axis=-1), nan=np.inf)
    feet_seen = low[:, always_low].all(axis=1) & (low.sum(axis=1) >= _FEWEST_LOW)
    clear = feet_seen & ~(low & (distance < reach)).any(axis=1)
    return _at_samples(_shrunk(clear, recording.marker_rate_hz), recording, n_analog)


def _shrunk(mask: np.ndarray, rate_hz: float) -> np.ndarray:
    """The mask without a short time at both ends of each stretch."""
    width = 2 * round(_AFTER_STEP_S * rate_hz) + 1
    blocked = np.convolve(~mask, np.ones(width), mode="same") > 0
    return np.asarray(~blocked)


def _at_samples(mask: np.ndarray, recording: Recording, n_analog: int) -> np.ndarray:
    ratio = recording.marker_rate_hz / recording.analog_rate_hz
    frames = np.rint(np.arange(n_analog) * ratio).astype(int)
    return mask[np.clip(frames, 0, len(mask) - 1)] & (frames < len(mask))
