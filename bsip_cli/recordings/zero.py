"""What a plate reads without load, and when nobody can be on it: the feet are seen elsewhere."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d, uniform_filter1d

from bsip_cli.recordings.analog import long_runs, runs
from bsip_cli.recordings.model import Finding, Plate, Recording
from bsip_cli.recordings.plates import LOADED_N

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


@dataclass(frozen=True, eq=False)
class PlateZero:
    """A plate's reading in its unloaded intervals."""

    offset: np.ndarray  # (6,): N and N m about the world origin
    n_samples: int  # 0: the plate was never seen unloaded, the offset is zero
    stretches_s: tuple[tuple[float, float], ...]  # from the first sample

    def is_known(self) -> bool:
        return self.n_samples > 0


def plate_zero(plate: Plate, rate_hz: float, surely_free: np.ndarray | None = None) -> PlateZero:
    """Find unloaded intervals: long, low and quiet in the vertical force, as an instrument reads.

    The offset is bounded unless ``surely_free`` (n_analog,) bool says that nobody is near, or the
    plate reads a steady pull: it was set to zero under the person.
    """
    if (pulled := steady_pull(plate, rate_hz)).any():
        return _zero_of(plate, pulled, rate_hz)
    width = max(1, round(_WINDOW_S * rate_hz))
    mean = uniform_filter1d(np.where(plate.usable, plate.force_N[:, 2], 0.0), width)
    heard = plate.usable & ~is_silent(plate.wrench())
    is_quiet = heard & (np.abs(mean - uniform_filter1d(mean, width)) < _QUIET_N)
    unloaded = is_quiet & (np.abs(mean) < _LARGEST_N)
    if surely_free is not None and (free := is_quiet & surely_free).any():
        level = float(np.median(mean[free]))
        if abs(level) >= _LARGEST_N:  # it counts wherever the plate reads it while nobody is near
            unloaded = free & (np.abs(mean - level) < _LARGEST_N)
    unloaded = long_runs(unloaded, max(2, round(_LEAST_S * rate_hz)))
    if not unloaded.any():
        return PlateZero(np.zeros(6), 0, ())
    return _zero_of(plate, unloaded, rate_hz)


def without_zeros(
    recording: Recording,
) -> tuple[Recording, list[Finding], dict[str, list[float]]]:
    """The plates without what they read without load, and that, (6,) by plate: N and N m about the
    world's origin."""
    done, zeros = [], {}
    for plate in recording.plates:
        free = nobody_near(recording, plate)
        zero = plate_zero(plate, recording.analog_rate_hz, surely_free=free)
        done.append(subtract_zero(plate, zero))
        if zero.is_known():
            zeros[plate.name] = zero.offset.tolist()
    zeroed = replace(recording, plates=tuple(plate for plate, _ in done))
    return zeroed, [finding for _, finding in done], zeros


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
    mean = uniform_filter1d(np.where(plate.usable, plate.force_N[:, 2], 0.0), width)
    spread = maximum_filter1d(mean, width) - minimum_filter1d(mean, width)
    lowest = min(np.percentile(mean, 1), -_LARGEST_N)
    pulls = plate.usable & (spread < _QUIET_N) & (mean < lowest + _QUIET_N)
    return long_runs(pulls, max(2, round(_PULLED_S * rate_hz)))


def _zero_of(plate: Plate, unloaded: np.ndarray, rate_hz: float) -> PlateZero:
    samples = plate.wrench()[unloaded]
    return PlateZero(
        offset=np.median(samples, axis=0),
        n_samples=int(unloaded.sum()),
        stretches_s=tuple((a / rate_hz, b / rate_hz) for a, b in runs(unloaded)),
    )


def subtract_zero(plate: Plate, zero: PlateZero) -> tuple[Plate, Finding]:
    """The plate without its offset, and the line for the quality table."""
    found, action, level = "no quiet interval without load", "left its zero as it is", "info"
    if is_silent(plate.wrench()).any():
        found = "exactly 0 without load, as software writes it"
    if zero.is_known():
        seconds = sum(stop - start for start, stop in zero.stretches_s)
        force = ", ".join(f"{value:.1f}" for value in zero.offset[:3])
        found, action = f"({force}) N in {seconds:.1f} s without load", "subtracted it"
        level = "corrected" if is_noticed(zero.offset) else "info"
        force_N, moment_Nm = plate.force_N - zero.offset[:3], plate.moment_Nm - zero.offset[3:]
        plate = replace(plate, force_N=force_N, moment_Nm=moment_Nm)
    return plate, Finding("plate_zero", plate.name, found, "(0, 0, 0) N", action, level)


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
    ratio = recording.marker_rate_hz / recording.analog_rate_hz
    frames = np.rint(np.arange(len(plate.usable)) * ratio).astype(int)
    return clear[np.clip(frames, 0, len(clear) - 1)] & (frames < len(clear))
