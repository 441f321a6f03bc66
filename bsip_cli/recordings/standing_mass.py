"""The mass that the plates carry: quiet standing, or the balance of momentum."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.recordings.analog import runs
from bsip_cli.recordings.force_balance import trunk_velocity_m_s
from bsip_cli.recordings.model import Finding

_STILL_S = 0.5
_STILL_SHARE = 0.02  # of the weight: departure of the force from its mean
_LEAST_STILL_S = 1.0
_LEAST_MOVING_S = 2.0
_LEAST_N = 100.0
_VELOCITY_ERROR_M_S = 0.2
_PERCENT = 100.0


@dataclass(frozen=True)
class PlateMass:
    """What the plates carried, and for how long it was seen."""

    mass_kg: float
    seconds: float
    is_still: bool

    @property
    def uncertainty_percent(self) -> float:
        """In movement the trunk's velocity stands for the centre of mass's."""
        if self.is_still:
            return 0.0
        return _PERCENT * _VELOCITY_ERROR_M_S / (GRAVITY_M_S2 * self.seconds)

    def words(self) -> str:
        how = "quiet standing" if self.is_still else "movement (balance of momentum)"
        return f"{self.mass_kg:.2f} kg in {self.seconds:.1f} s of {how}"


def plate_mass(
    force_z_N: np.ndarray, valid: np.ndarray, trunk_markers_m: np.ndarray, rate_hz: float
) -> PlateMass | None:
    """Mass from the vertical force (n_frames,) where ``valid`` (n_frames,) bool.

    In quiet standing the mean force over g. Else, over the longest valid stretch, the mean
    force over g plus the mean acceleration of the trunk (n_frames, k, 3). None without either.
    """
    still = _still(force_z_N, valid, rate_hz)
    if still.any():
        mass_kg = float(force_z_N[still].mean()) / GRAVITY_M_S2
        return PlateMass(mass_kg, still.sum() / rate_hz, True)
    return _by_momentum(force_z_N, valid, trunk_markers_m, rate_hz)


def about_mass(
    carried: PlateMass | None, stated_kg: float | None, tolerance_percent: float
) -> Finding | None:
    """The line for the quality table: the plates against the stated mass with known loads."""
    if carried is None:
        return None
    if stated_kg is None:
        return _finding(carried, "no mass is stated", "", "info")
    difference = _PERCENT * (carried.mass_kg / stated_kg - 1)
    expected = f"the stated {stated_kg:.2f} kg within {tolerance_percent:g} %"
    bad = abs(difference) > tolerance_percent + carried.uncertainty_percent
    action = f"left both as they are ({difference:+.1f} %)"
    return _finding(carried, expected, action, "warning" if bad else "info")


def _still(force_z_N: np.ndarray, valid: np.ndarray, rate_hz: float) -> np.ndarray:
    """Frames of stretches in which the force hardly leaves its own mean, (n_frames,) bool."""
    width = max(2, round(_STILL_S * rate_hz))
    mean = uniform_filter1d(force_z_N, width)
    calm = valid & (force_z_N > _LEAST_N) & (np.abs(force_z_N - mean) < _STILL_SHARE * mean)
    still = np.zeros(len(valid), bool)
    for start, stop in runs(calm):
        part = force_z_N[start:stop]
        if (stop - start) / rate_hz >= _LEAST_STILL_S and np.ptp(part) < 4 * _STILL_SHARE * mean[
            start
        ]:
            still[start:stop] = True
    return still


def _by_momentum(
    force_z_N: np.ndarray, valid: np.ndarray, trunk_markers_m: np.ndarray, rate_hz: float
) -> PlateMass | None:
    stretches = runs(valid)
    velocity = trunk_velocity_m_s(trunk_markers_m, rate_hz)
    if not len(stretches) or velocity is None:
        return None
    start, stop = stretches[np.argmax(np.diff(stretches, axis=1)[:, 0])]
    seconds = (stop - start) / rate_hz
    mean_N = float(force_z_N[start:stop].mean())
    if seconds < _LEAST_MOVING_S or mean_N < _LEAST_N:
        return None
    acceleration = float(velocity[stop - 1] - velocity[start]) / seconds
    return PlateMass(mean_N / (GRAVITY_M_S2 + acceleration), seconds, False)


def _finding(carried: PlateMass, expected: str, action: str, level: str) -> Finding:
    return Finding("plate_mass", "", carried.words(), expected, action, level)
