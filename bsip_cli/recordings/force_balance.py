"""Does the plates' vertical force carry the motion of the trunk?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, sosfiltfilt

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.recordings.analog import long_runs


@dataclass(frozen=True)
class ContactLimits:
    """The thresholds of the contact logic."""

    touch_height_m: float = 0.035  # above a marker's own standing height
    sole_height_m: float = 0.06  # markers this low belong to the footprint
    touch_speed_m_s: float = 0.6
    roll_height_m: float = 0.09  # of the lowest marker while only the toes touch
    roll_speed_m_s: float = 1.2
    roll_s: float = 0.2  # a step is pushed off within this time
    outline_tolerance_m: float = 0.03
    loaded_N: float = 20.0
    cop_distance_m: float = 0.35
    mismatch_share: float = 0.35  # of body weight, and of the force's own departure from it
    mismatch_s: float = 0.1
    blink_s: float = 0.06  # shorter touches without load are no touch
    least_window_s: float = 0.1
    trunk_cutoff_hz: float = 6.0


def force_mismatch(
    total_force_z_N: np.ndarray,
    trunk_markers_m: np.ndarray,
    mass_kg: float,
    rate_hz: float,
    limits: ContactLimits,
) -> np.ndarray:
    """Frames in which the trunk's motion needs another vertical force than measured."""
    velocity = trunk_velocity_m_s(trunk_markers_m, rate_hz, limits)
    if velocity is None:
        return np.zeros(len(trunk_markers_m), bool)
    acceleration = np.gradient(velocity) * rate_hz
    needed = mass_kg * (GRAVITY_M_S2 + acceleration)
    measured = low_pass(total_force_z_N, rate_hz, limits)
    weight = mass_kg * GRAVITY_M_S2
    allowed = limits.mismatch_share * (weight + np.abs(needed - weight))
    different = np.abs(measured - needed) > allowed
    return long_runs(different, max(2, round(limits.mismatch_s * rate_hz)))


def trunk_velocity_m_s(
    trunk_markers_m: np.ndarray, rate_hz: float, limits: ContactLimits | None = None
) -> np.ndarray | None:
    """Vertical velocity of the markers' mean (n_frames, k, 3), low-passed, (n_frames,)."""
    height = mean_path(trunk_markers_m[..., 2])
    if height is None:
        return None
    return np.gradient(low_pass(height, rate_hz, limits)) * rate_hz


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


def low_pass(signal: np.ndarray, rate_hz: float, limits: ContactLimits | None = None) -> np.ndarray:
    """Zero phase, order 4."""
    cutoff = min((limits or ContactLimits()).trunk_cutoff_hz, 0.45 * rate_hz)
    sections = butter(2, cutoff, fs=rate_hz, output="sos")
    pad = min(len(signal) - 1, round(rate_hz))
    return sosfiltfilt(sections, np.asarray(signal), padlen=pad)


def agreeing_mass(
    total_force_z_N: np.ndarray,
    trunk_markers_m: np.ndarray,
    frames: np.ndarray,
    rate_hz: float,
    limits: ContactLimits | None = None,
) -> float | None:
    """The largest mass [kg] with which the force goes with the trunk's motion in many of the
    ``frames`` (n_frames,) bool: in half as many as with any other.

    Only good enough to find frames in which something else bears the person; the largest, because
    what bears a person takes weight off the plates. None without load or trunk markers.
    """
    limits = limits or ContactLimits()
    velocity = trunk_velocity_m_s(trunk_markers_m, rate_hz, limits)
    if velocity is None:
        return None
    reach = GRAVITY_M_S2 + np.gradient(velocity) * rate_hz
    measured = low_pass(total_force_z_N, rate_hz, limits)
    loaded = frames & (measured > 5 * limits.loaded_N) & (reach > GRAVITY_M_S2 / 2)
    if not loaded.any():
        return None
    masses = np.sort(measured[loaded] / reach[loaded])
    near = 1.0 + limits.mismatch_share / 2
    count = np.searchsorted(masses, masses * near, side="right") - np.searchsorted(
        masses, masses / near
    )
    return float(masses[count >= count.max() / 2].max()) / np.sqrt(near)
