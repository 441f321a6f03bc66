"""How the trunk moves up and down: what the plates' vertical force has to carry, and when nothing
can be on them."""

from __future__ import annotations

import numpy as np
from scipy.signal import butter, sosfiltfilt

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.recordings.analog import long_runs
from bsip_cli.recordings.model import Recording
from bsip_cli.recordings.scene import by_segment
from bsip_cli.segments import TRUNK

FALLS = 0.2  # of gravity: less is flight
_CUTOFF_HZ = 6.0
# A jump's flight lasts 0.3 s and longer; before it, and in swings of a golf club for 0.08 s, the
# trunk falls with the feet on the ground.
_FLIGHT_S, _ENDS_S = 0.2, 0.1


def in_flight(recording: Recording, n: int) -> np.ndarray:
    """Analog samples in which the trunk surely falls freely, (n,) bool: whole flights but for their
    ends; none without markers on it."""
    rate_hz = recording.marker_rate_hz
    if (reach := trunk_reach_m_s2(recording)) is None:
        return np.zeros(n, bool)
    flight = long_runs(reach < FALLS * GRAVITY_M_S2, round((_FLIGHT_S + _ENDS_S) * rate_hz))
    width = 2 * round(_ENDS_S * rate_hz) + 1
    sure = np.convolve(~flight, np.ones(width), mode="same") <= 0
    frames = np.rint(np.arange(n) * rate_hz / recording.analog_rate_hz).astype(int)
    return sure[frames.clip(0, len(sure) - 1)] & (frames < len(sure))


def trunk_reach_m_s2(recording: Recording) -> np.ndarray | None:
    """`reach_m_s2` of the markers that the labels put on the trunk; None without any."""
    segments = by_segment(recording.labels, recording.markers_m)
    trunk = [segments[name] for name in TRUNK if name in segments]
    return reach_m_s2(np.concatenate(trunk, axis=1), recording.marker_rate_hz) if trunk else None


def reach_m_s2(trunk_markers_m: np.ndarray, rate_hz: float) -> np.ndarray | None:
    """Gravity and the vertical acceleration of the markers' mean (n_frames, k, 3), low-passed,
    (n_frames,)."""
    height = mean_path(trunk_markers_m[..., 2])
    return None if height is None else path_reach_m_s2(height, rate_hz)


def path_reach_m_s2(height: np.ndarray, rate_hz: float) -> np.ndarray:
    """The same of a path's heights (n_frames,)."""
    velocity = np.gradient(low_pass(height, rate_hz)) * rate_hz
    return GRAVITY_M_S2 + np.gradient(velocity) * rate_hz


def mean_path(height: np.ndarray) -> np.ndarray | None:
    """Mean of one coordinate (n_frames, k) of the markers seen nearly always, gaps interpolated,
    (n_frames,); None without such a marker."""
    known = np.isfinite(height)
    if not height.size or len(height) < 10:
        return None
    often = np.flatnonzero(known.mean(axis=0) > 0.9)
    if not len(often):
        return None
    frames = np.arange(len(height))
    filled = [np.interp(frames, frames[known[:, i]], height[known[:, i], i]) for i in often]
    return np.mean(filled, axis=0)


def low_pass(signal: np.ndarray, rate_hz: float) -> np.ndarray:
    """Zero phase, order 4."""
    cutoff = min(_CUTOFF_HZ, 0.45 * rate_hz)
    sections = butter(2, cutoff, fs=rate_hz, output="sos")
    pad = min(len(signal) - 1, round(rate_hz))
    return sosfiltfilt(sections, np.asarray(signal), padlen=pad)
