"""The mass that the plates carry: quiet standing, or the balance of momentum."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from bsip_cli.body.gravity import GRAVITY_M_S2
from bsip_cli.recordings.analog import runs
from bsip_cli.recordings.force_balance import trunk_velocity_m_s
from bsip_cli.recordings.model import Finding

_NOISE_S = 0.1  # shorter changes of the force are noise
_STILL_SHARE = 0.03  # of the mean force: departure within a still stretch
_LEAST_STILL_S = 0.8
_LEAST_MOVING_S = 2.0
_LEAST_N = 100.0
_STILL_ERROR_M_S = 0.1  # standing still, as far as the force tells
_MOVING_ERROR_M_S = 0.2  # the trunk stands for the centre of mass
_UNSEEN_ERROR_M_S = 0.4  # of a stretch of movement of which the force alone is known
_PERCENT = 100.0


@dataclass(frozen=True)
class PlateMass:
    """What the plates carried, for how long it was seen, and how.

    error_m_s : of the change of the centre of mass's velocity meanwhile.
    """

    mass_kg: float
    seconds: float
    manner: str
    error_m_s: float

    @property
    def uncertainty_percent(self) -> float:
        """By the change of velocity that nobody sees."""
        return _PERCENT * self.error_m_s / (GRAVITY_M_S2 * self.seconds)

    def words(self) -> str:
        return f"{self.mass_kg:.2f} kg in {self.seconds:.1f} s of {self.manner}"


def plate_mass(
    force_z_N: np.ndarray, valid: np.ndarray, trunk_markers_m: np.ndarray, rate_hz: float
) -> PlateMass | None:
    """Mass from the vertical force (n_frames,) where ``valid`` (n_frames,) bool.

    In quiet standing the mean force over g. Over the longest valid stretch the mean force over
    g plus the mean acceleration of the trunk (n_frames, k, 3). The surer of the two; None
    without either.
    """
    still = still_frames(force_z_N, valid, rate_hz)
    found = [_by_momentum(force_z_N, valid, trunk_markers_m, rate_hz)]
    if still.any():
        mass_kg = float(force_z_N[still].mean()) / GRAVITY_M_S2
        seconds = still.sum() / rate_hz
        found.append(PlateMass(mass_kg, seconds, "quiet standing", _STILL_ERROR_M_S))
    known = [one for one in found if one is not None]
    return min(known, key=lambda one: one.uncertainty_percent, default=None)


def rough_mass(force_z_N: np.ndarray, valid: np.ndarray, rate_hz: float) -> PlateMass | None:
    """The mean force over g in all valid frames: where nothing better tells a mass."""
    pieces = len(runs(valid))
    mean_N = float(force_z_N[valid].mean()) if pieces else 0.0
    if mean_N < _LEAST_N:
        return None
    error_m_s = _UNSEEN_ERROR_M_S * float(np.sqrt(pieces))
    return PlateMass(
        mean_N / GRAVITY_M_S2, valid.sum() / rate_hz, "movement (mean force)", error_m_s
    )


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


def still_frames(force_z_N: np.ndarray, valid: np.ndarray, rate_hz: float) -> np.ndarray:
    """The longest valid stretch in which the force stays near its own mean, (n_frames,) bool.

    No frame if that is shorter than 0.8 s.
    """
    smooth = uniform_filter1d(np.nan_to_num(force_z_N), max(1, round(_NOISE_S * rate_hz)))
    still = np.zeros(len(valid), bool)
    for start, stop in runs(valid & (smooth > _LEAST_N)):
        first, last = _calmest(smooth[start:stop])
        if last - first > max(still.sum(), _LEAST_STILL_S * rate_hz - 1):
            still[:] = False
            still[start + first : start + last] = True
    return still


def _calmest(force_N: np.ndarray) -> tuple[int, int]:
    """Start and stop of the longest stretch whose range is twice the allowed departure."""
    best, start = (0, 0), 0
    lows: deque[int] = deque()
    highs: deque[int] = deque()
    for stop, value in enumerate(force_N):
        while lows and force_N[lows[-1]] >= value:
            lows.pop()
        while highs and force_N[highs[-1]] <= value:
            highs.pop()
        lows.append(stop)
        highs.append(stop)
        while force_N[highs[0]] - force_N[lows[0]] > 2 * _STILL_SHARE * force_N[highs[0]]:
            start += 1
            for queue in (lows, highs):
                if queue[0] < start:
                    queue.popleft()
        if stop + 1 - start > best[1] - best[0]:
            best = (start, stop + 1)
    return best


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
    mass_kg = mean_N / (GRAVITY_M_S2 + acceleration)
    return PlateMass(mass_kg, seconds, "movement (balance of momentum)", _MOVING_ERROR_M_S)


def _finding(carried: PlateMass, expected: str, action: str, level: str) -> Finding:
    return Finding("plate_mass", "", carried.words(), expected, action, level)
