"""What a plate reads without load, when nobody can be on it (the feet are seen elsewhere), and the
plates' wrench at the marker times: anti-aliased, zero phase, any ratio of rates."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.ndimage import binary_dilation, maximum_filter1d, minimum_filter1d, uniform_filter1d
from scipy.signal import upfirdn

from bsip_cli.recordings.analog import long_runs
from bsip_cli.recordings.model import Finding, Plate, Recording
from bsip_cli.recordings.plates import LOADED_N
from bsip_cli.recordings.trunk_motion import in_flight
from bsip_cli.recordings.under_the_feet import BESIDE_M, Feet

_NOTICED_N = 1.0
_WINDOW_S = 0.2
_LEAST_S = 0.4
_LARGEST_N = 45.0
_QUIET_N = 5.0  # slow changes
_PULLED_S = 0.2  # a foot that stays on a plate does not bear the same so long
_PULL_N = -20.0
_HEAVIEST_N = 2500.0  # nobody stands on one plate so heavily
_LOW_M = 0.3  # above the plate: whoever stands on it has a marker below this height
_CLEAR_M = 0.3  # beyond the outline
_FEWEST_LOW = 2  # markers seen low in a frame: the feet are in view
_AFTER_STEP_S = 0.1  # beside a frame that is not clear


def without_zeros(
    recording: Recording,
) -> tuple[Recording, list[Finding], dict[str, list[float]]]:
    """The plates without what they read without load, and that, (6,) by plate: N and N m about the
    world's origin."""
    plates, findings, zeros = [], [], {}
    rate_hz = recording.analog_rate_hz
    if recording.plates:
        flight = in_flight(recording, len(recording.plates[0].usable))
    for plate in recording.plates:
        near = nobody_near(recording, plate), foot_rests(recording, plate)
        unloaded = unloaded_samples(plate, rate_hz, *near, flight)
        if unloaded.any():
            zeros[plate.name] = np.median(plate.wrench[unloaded], axis=0).tolist()
        zeroed, finding = subtract_zero(plate, unloaded, rate_hz)
        plates.append(zeroed)
        findings.append(finding)
    return replace(recording, plates=tuple(plates)), findings, zeros


def unloaded_samples(
    plate: Plate,
    rate_hz: float,
    surely_free: np.ndarray | None = None,
    rests: np.ndarray | None = None,
    flight: np.ndarray | None = None,
) -> np.ndarray:
    """Where a plate bears nobody, (n_analog,) bool: intervals that are long, low and quiet in the
    vertical force, as an instrument reads; without one, those of ``flight`` (n_analog,) bool in
    which it reads the same throughout.

    What it reads there is bounded unless ``surely_free`` (n_analog,) bool says that nobody is near,
    or the plate reads a steady pull: it was set to zero under the person. Where a foot ``rests``
    on it (n_analog,) bool, a light load is the foot's: of who sits, or stands on the other leg.
    """
    if (pulled := steady_pull(plate, rate_hz)).any():
        return pulled
    width = max(1, round(_WINDOW_S * rate_hz))
    mean = uniform_filter1d(np.where(plate.usable, plate.lift_N, 0.0), width)
    # Shorter zeros are noise about a software's threshold, and part of what the plate reads.
    heard = plate.usable & ~long_runs(is_silent(plate.wrench), width)
    is_quiet = heard & (np.abs(mean - uniform_filter1d(mean, width)) < _QUIET_N)
    unloaded = is_quiet & (np.abs(mean) < _LARGEST_N)
    if surely_free is not None and (free := is_quiet & surely_free).any():
        level = float(np.median(mean[free]))
        if abs(level) >= _LARGEST_N:  # it counts wherever the plate reads it while nobody is near
            unloaded = free & (np.abs(mean - level) < _LARGEST_N)
    if rests is not None:
        unloaded &= ~rests
    unloaded = long_runs(unloaded, max(2, round(_LEAST_S * rate_hz)))
    if unloaded.any() or flight is None or not (aloft := flight & heard).any():
        return unloaded
    lift = uniform_filter1d(plate.lift_N, max(1, round(_WINDOW_S / 4 * rate_hz)))[aloft]
    return aloft & bool(np.ptp(np.percentile(lift, [5, 95])) < _QUIET_N)


def subtract_zero(plate: Plate, unloaded: np.ndarray, rate_hz: float) -> tuple[Plate, Finding]:
    """The plate without what it reads ``unloaded`` (n_analog,) bool, and the line for the quality
    table."""
    found, action, level = "no quiet interval without load", "left its zero as it is", "info"
    if is_silent(plate.wrench).any():
        found = "exactly 0 without load, as software writes it"
    if unloaded.any():
        offset = np.median(plate.wrench[unloaded], axis=0)
        force = ", ".join(f"{value:.1f}" for value in offset[:3])
        found = f"({force}) N in {unloaded.sum() / rate_hz:.1f} s without load"
        action, level = "subtracted it", "corrected" if is_noticed(offset) else "info"
        plate = replace(plate, wrench=plate.wrench - offset)
    return plate, Finding("plate_zero", plate.name, found, "(0, 0, 0) N", action, level)


def is_silent(wrench: np.ndarray) -> np.ndarray:
    """(n,) where a reading (n, 6) is 0 in all channels, which no instrument reads: software wrote
    it for a plate without load, and what the plate read there is not known."""
    return np.asarray((wrench == 0).all(axis=-1))


def is_noticed(offset: np.ndarray) -> bool:
    """Whether what a plate reads without load, (6,), is more than rounding and noise."""
    return bool(np.abs(offset[:3]).max() > _NOTICED_N)


def steady_pull(plate: Plate, rate_hz: float) -> np.ndarray:
    """Samples at which it pulls most, and hardly changes for long, (n_analog,) bool."""
    width = max(1, round(0.25 * _PULLED_S * rate_hz))
    mean = uniform_filter1d(np.where(plate.usable, plate.lift_N, 0.0), width)
    spread = maximum_filter1d(mean, width) - minimum_filter1d(mean, width)
    lowest = min(np.percentile(mean, 1), -_LARGEST_N)
    pulls = plate.usable & (spread < _QUIET_N) & (mean < lowest + _QUIET_N)
    return long_runs(pulls, max(2, round(_PULLED_S * rate_hz)))


def lost_baseline(
    lift_N: np.ndarray, plate: str, good: np.ndarray, baseline: slice | None
) -> Finding | None:
    """Said, and to be subtracted, if the mean of the ZERO samples is a pull, which no person makes.

    Where the plate never pushes, and pulls no more than a person weighs, somebody stood on it from
    the first and its sign is the other one.
    """
    if baseline is None or not good[baseline].all():
        return None
    level = lift_N[baseline].mean()
    rest = (lift_N - level)[good]
    is_loaded_above = np.percentile(rest, 95) > LOADED_N and np.percentile(rest, 2) > _PULL_N
    is_reversed = level > -_HEAVIEST_N and level + np.percentile(rest, 98) < -_PULL_N
    if level > _PULL_N or not is_loaded_above or is_reversed:
        return None
    found = f"{level:.0f} N in the samples of FORCE_PLATFORM:ZERO, a pull"
    expected, action = "0 N without load", "subtracted that baseline from all channels"
    return Finding("plate_zero", plate, found, expected, action, "corrected")


def nobody_near(recording: Recording, plate: Plate) -> np.ndarray:
    """Samples at which all low markers are in view and far from the plate, (n_analog,) bool.

    Nowhere if the plate's outline is unknown or fewer than two markers are ever low.
    """
    if plate.corners_m is None or not recording.labels:
        return np.zeros(len(plate.usable), bool)
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
    width = 2 * round(_AFTER_STEP_S * recording.marker_rate_hz) + 1
    clear = np.convolve(~clear, np.ones(width), mode="same") <= 0
    frames = _frame_of_sample(recording, len(plate.usable))
    return clear[np.clip(frames, 0, len(clear) - 1)] & (frames < len(clear))


def foot_rests(recording: Recording, plate: Plate) -> np.ndarray:
    """Samples at which the plate is pressed where a foot stands whose markers are all on the
    ground, (n_analog,) bool: an offset would have its centre of pressure anywhere."""
    n, n_frames = len(plate.usable), len(recording.markers_m)
    if not recording.labels or not n or not n_frames:
        return np.zeros(n, bool)
    ratio = recording.analog_rate_hz / recording.marker_rate_hz
    at = np.minimum(np.rint(np.arange(n_frames) * ratio).astype(int), n - 1)  # of each frame
    surface_m = 0.0 if plate.corners_m is None else float(plate.corners_m[:, 2].mean())
    feet = Feet.of(recording.labels, recording.markers_m, np.arange(n_frames), [surface_m])
    cop_m, rests = plate.cop_m()[at], np.zeros(n_frames, bool)
    for side in set(feet.sides):
        mine = feet.of_side(side)
        on = mine.distance_m(cop_m, np.zeros(n_frames, bool)) < BESIDE_M
        rests |= on & np.all(np.isfinite(mine.points_m), axis=(1, 2))
    rests &= plate.lift_N[at] > _QUIET_N  # by less nothing is pressed
    frames = _frame_of_sample(recording, n)
    return rests[np.minimum(frames, n_frames - 1)] & (frames < n_frames)


def _frame_of_sample(recording: Recording, n: int) -> np.ndarray:
    """Of n analog samples, the nearest marker frame."""
    ratio = recording.marker_rate_hz / recording.analog_rate_hz
    return np.rint(np.arange(n) * ratio).astype(int)


# --- at the marker times --------------------------------------------------------------------------


_HALF_LENGTH = 8  # periods of the slower rate on each side
_CUTOFF = 0.41  # of the slower rate (-6 dB); flat to 0.32, closed from 0.5 on
_KAISER_BETA = 5.0
_TOUCHED = 0.01  # of the filter's absolute weight on unusable samples
_LEAST_WEIGHT = 0.4  # at the very ends half of the filter hangs over
_BLOCK_FRAMES = 1000


def plates_at_marker_rate(recording: Recording) -> tuple[Plate, ...]:
    """Every plate filtered and sampled at the marker times.

    Unusable samples get no weight; frames whose filter touches them are not usable, and a
    frame without any usable sample is zero and not usable.
    """
    how, found = (recording.analog_rate_hz, recording.marker_rate_hz, recording.n_frames), []
    for plate in recording.plates:
        values, good = sample_at_frames(plate.wrench, plate.usable, *how)
        found.append(replace(plate, wrench=values, usable=good))
    return tuple(found)


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
    silent = is_silent(sampled)
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
