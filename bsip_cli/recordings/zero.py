"""What a plate reads without load."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from bsip_cli.recordings.analog import long_runs, runs
from bsip_cli.recordings.model import Finding, Plate
from bsip_cli.recordings.plates import LOADED_N, LocalWrench

_WINDOW_S = 0.2
_PULL_N = -20.0


@dataclass(frozen=True, eq=False)
class PlateZero:
    """A plate's reading in its unloaded stretches."""

    offset: np.ndarray  # (6,): N and N m about the world origin
    spread: np.ndarray  # (6,): standard deviation of the single samples
    n_samples: int  # 0: the plate was never seen unloaded, the offset is zero
    stretches_s: tuple[tuple[float, float], ...]  # from the first sample

    def is_known(self) -> bool:
        return self.n_samples > 0


def plate_zero(
    plate: Plate,
    rate_hz: float,
    may_be_loaded: np.ndarray | None = None,
    surely_free: np.ndarray | None = None,
    least_s: float = 0.4,
    largest_N: float = 45.0,
    quiet_N: float = 5.0,
) -> PlateZero:
    """Find unloaded stretches: long, low and quiet in the vertical force.

    ``may_be_loaded`` (n_analog,) bool excludes samples at which a foot is on the plate;
    ``largest_N`` bounds the offset where ``surely_free`` (n_analog,) bool does not say that
    nobody is near; ``quiet_N`` bounds its slow changes within 0.2 s.
    """
    mean, is_quiet = _slow_force(plate, rate_hz, quiet_N)
    unloaded = is_quiet & (np.abs(mean) < largest_N)
    if surely_free is not None:
        unloaded = _where_free(unloaded, mean, is_quiet & surely_free, largest_N)
    if may_be_loaded is not None:
        unloaded &= ~may_be_loaded
    unloaded = long_runs(unloaded, max(2, round(least_s * rate_hz)))
    if not unloaded.any():
        return PlateZero(np.zeros(6), np.zeros(6), 0, ())
    samples = plate.wrench()[unloaded]
    return PlateZero(
        offset=np.median(samples, axis=0),
        spread=samples.std(axis=0),
        n_samples=int(unloaded.sum()),
        stretches_s=tuple((a / rate_hz, b / rate_hz) for a, b in runs(unloaded)),
    )


def subtract_zero(plate: Plate, zero: PlateZero) -> tuple[Plate, Finding]:
    """The plate without its offset, and the line for the quality table."""
    if not zero.is_known():
        return plate, _finding(
            plate, "no quiet stretch without load", "left its zero as it is", "info"
        )
    seconds = sum(stop - start for start, stop in zero.stretches_s)
    force = ", ".join(f"{value:.1f}" for value in zero.offset[:3])
    found = f"({force}) N in {seconds:.1f} s without load"
    corrected = replace(
        plate,
        force_N=plate.force_N - zero.offset[:3],
        moment_Nm=plate.moment_Nm - zero.offset[3:],
    )
    level = "corrected" if np.abs(zero.offset[:3]).max() > 1.0 else "info"
    return corrected, _finding(plate, found, "subtracted it", level)


def _slow_force(plate: Plate, rate_hz: float, quiet_N: float) -> tuple[np.ndarray, np.ndarray]:
    """Mean vertical force over 0.2 s, and where it hardly changes, (n_analog,) each."""
    width = max(1, round(_WINDOW_S * rate_hz))
    force = np.where(plate.usable, plate.force_N[:, 2], 0.0)
    mean = uniform_filter1d(force, width)
    slow = uniform_filter1d(mean, width)
    return mean, plate.usable & (np.abs(mean - slow) < quiet_N)


def _where_free(
    unloaded: np.ndarray, mean: np.ndarray, free: np.ndarray, largest_N: float
) -> np.ndarray:
    """A zero beyond the bound, seen while nobody is near, counts wherever the plate reads it."""
    if not free.any():
        return unloaded
    level = float(np.median(mean[free]))
    if abs(level) < largest_N:
        return unloaded
    return free & (np.abs(mean - level) < largest_N)


def _finding(plate: Plate, found: str, action: str, level: str) -> Finding:
    return Finding("plate_zero", plate.name, found, "(0, 0, 0) N", action, level)


def without_baseline(
    wrench: LocalWrench,
    plate: str,
    down_sign: float,
    good: np.ndarray,
    baseline: slice | None,
) -> tuple[LocalWrench, list[Finding]]:
    """Subtract the mean of the ZERO samples if it is a pull, which no person can do."""
    if baseline is None or not good[baseline].all():
        return wrench, []
    level_force = wrench.force_N[baseline].mean(axis=0)
    level_moment = wrench.moment_Nm[baseline].mean(axis=0)
    level = down_sign * level_force[2]
    rest = (down_sign * wrench.force_N[:, 2] - level)[good]
    is_loaded_above = np.percentile(rest, 95) > LOADED_N and np.percentile(rest, 2) > _PULL_N
    if level > _PULL_N or not is_loaded_above:
        return wrench, []
    finding = Finding(
        check="plate_zero",
        subject=plate,
        found=f"{level:.0f} N in the samples of FORCE_PLATFORM:ZERO, a pull",
        expected="0 N without load",
        action="subtracted that baseline from all channels",
        level="corrected",
    )
    return LocalWrench(wrench.force_N - level_force, wrench.moment_Nm - level_moment), [finding]
