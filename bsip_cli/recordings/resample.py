"""The plates' wrench at the marker times: anti-aliased, zero phase, any ratio of rates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import binary_dilation
from scipy.signal import upfirdn

from bsip_cli.recordings.model import Recording

_HALF_LENGTH = 8  # periods of the slower rate on each side
_CUTOFF = 0.41  # of the slower rate (-6 dB); flat to 0.32, closed from 0.5 on
_KAISER_BETA = 5.0
_TOUCHED = 0.01  # of the filter's absolute weight on unusable samples
_LEAST_WEIGHT = 0.4  # at the very ends half of the filter hangs over
_BLOCK_FRAMES = 1000


@dataclass(frozen=True, eq=False)
class FrameWrench:
    """Wrench on the body at the marker times, world frame, about the world origin."""

    names: tuple[str, ...]
    per_plate: np.ndarray  # (n_plates, n_frames, 6): fx, fy, fz [N], mx, my, mz [N m]
    plate_usable: np.ndarray  # (n_plates, n_frames) bool

    @property
    def total(self) -> np.ndarray:
        """Sum of all plates, (n_frames, 6)."""
        return self.per_plate.sum(axis=0)

    @property
    def usable(self) -> np.ndarray:
        """Frames that no unusable sample of any plate touches, (n_frames,) bool."""
        return np.asarray(self.plate_usable.all(axis=0))


def wrench_at_marker_rate(recording: Recording) -> FrameWrench:
    """Filter and sample every plate at the marker times.

    Unusable samples get no weight; frames whose filter touches them are not usable, and a
    frame without any usable sample is zero and not usable. Without plates: no rows.
    """
    n_frames = recording.n_frames
    per_plate = np.zeros((len(recording.plates), n_frames, 6))
    usable = np.zeros(per_plate.shape[:2], bool)
    for i, plate in enumerate(recording.plates):
        rates = recording.analog_rate_hz, recording.marker_rate_hz
        per_plate[i], usable[i] = sample_at_frames(plate.wrench(), plate.usable, *rates, n_frames)
    names = tuple(plate.name for plate in recording.plates)
    return FrameWrench(names, per_plate, usable)


def sample_at_frames(
    signal: np.ndarray,
    usable: np.ndarray,
    signal_rate_hz: float,
    frame_rate_hz: float,
    n_frames: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Signal (n, k) with its mask (n,) at n_frames times, both starting at the same instant.

    Returns values (n_frames, k) and usable (n_frames,). Symmetric Kaiser-windowed sinc,
    normalised over the usable samples, so constants pass exactly also at the ends.
    """
    clean = np.where(usable[:, None], signal, 0.0)
    if np.isclose(signal_rate_hz, frame_rate_hz, rtol=1e-9):
        values, good = np.zeros((n_frames, clean.shape[1])), np.zeros(n_frames, bool)
        n = min(n_frames, len(clean))
        values[:n], good[:n] = clean[:n], usable[:n]
        return values, good
    ratio = signal_rate_hz / frame_rate_hz
    if ratio > 1 and abs(ratio - round(ratio)) < 1e-9 * ratio:
        return _decimated(clean, usable, round(ratio), n_frames)
    return _interpolated(clean, usable, signal_rate_hz, frame_rate_hz, n_frames)


def silent_frames(sampled: np.ndarray, resampled: bool) -> np.ndarray:
    """(n_frames,) where a plate's wrench (n_frames, 6) at the marker times was 0 in all channels,
    as software writes it without load; a filter to another rate smears its neighbours into it."""
    silent = (sampled == 0).all(axis=1)
    return binary_dilation(silent, np.ones(2 * _HALF_LENGTH + 1)) if resampled else silent


def _decimated(
    clean: np.ndarray, usable: np.ndarray, ratio: int, n_frames: int
) -> tuple[np.ndarray, np.ndarray]:
    """A whole number of samples per frame: one symmetric filter for all frames."""
    half = _HALF_LENGTH * ratio
    distance = np.arange(-half, half + 1) / ratio
    kernel = np.sinc(2 * _CUTOFF * distance) * _kaiser(distance / (_HALF_LENGTH + 1))
    kernel /= kernel.sum()

    def every(taps: np.ndarray, signal: np.ndarray) -> np.ndarray:
        """Its output at every ratio-th sample from the first on, (n_frames, ...)."""
        n_zeros = max(half + ratio, n_frames * ratio + half - len(signal))
        padded = np.concatenate([signal, np.zeros((n_zeros, *signal.shape[1:]))])
        filtered = upfirdn(taps, padded, up=1, down=ratio, axis=0)
        return filtered[_HALF_LENGTH : _HALF_LENGTH + n_frames]

    inside = every(np.abs(kernel), np.ones(len(usable)))
    lost = every(np.abs(kernel), (~usable).astype(float)) / np.maximum(inside, 1e-12)
    return _judged(every(kernel, clean), every(kernel, usable.astype(float)), lost)


def _judged(
    weighted: np.ndarray, norm: np.ndarray, lost: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Weighted sums (n, k) over their weight, and where that can be believed."""
    enough = norm > _LEAST_WEIGHT
    values = np.where(enough[:, None], weighted / np.where(enough, norm, 1.0)[:, None], 0.0)
    return values, enough & (lost <= _TOUCHED)


def _interpolated(
    clean: np.ndarray,
    usable: np.ndarray,
    signal_rate_hz: float,
    frame_rate_hz: float,
    n_frames: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Any ratio: the filter is evaluated anew around each frame's time."""
    slower_hz = min(signal_rate_hz, frame_rate_hz)
    half = int(np.ceil(_HALF_LENGTH * signal_rate_hz / slower_hz))
    values, good = np.zeros((n_frames, clean.shape[1])), np.zeros(n_frames, bool)
    for start in range(0, n_frames, _BLOCK_FRAMES):
        frames = np.arange(start, min(start + _BLOCK_FRAMES, n_frames))
        centre = frames / frame_rate_hz * signal_rate_hz
        index = np.rint(centre).astype(int)[:, None] + np.arange(-half, half + 1)
        distance = (index - centre[:, None]) / signal_rate_hz * slower_hz  # in slower periods
        weights = np.sinc(2 * _CUTOFF * distance) * _kaiser(distance / (_HALF_LENGTH + 1))
        weights[(index < 0) | (index >= len(clean))] = 0.0
        index = np.clip(index, 0, len(clean) - 1)
        total = weights.sum(axis=1, keepdims=True)
        weights = weights / np.where(total > 0, total, 1.0)
        heard = weights * usable[index]
        lost = np.abs(weights - heard).sum(axis=1) / np.abs(weights).sum(axis=1)
        weighted = np.einsum("fj,fjk->fk", heard, clean[index])
        values[frames], good[frames] = _judged(weighted, heard.sum(axis=1), lost)
    return values, good


def _kaiser(position: np.ndarray) -> np.ndarray:
    """Kaiser window at positions -1..1, zero outside."""
    inside = np.clip(1 - position**2, 0.0, None)
    return np.where(inside > 0, np.i0(_KAISER_BETA * np.sqrt(inside)) / np.i0(_KAISER_BETA), 0.0)
