"""How much the skin swings against the bones, from the residuals of the inverse kinematics.

In recordings of two labs the residuals' power falls like 1 / f^4 from 2 Hz to where white noise
begins, as if the skin were shaken by white accelerations; in a third lab's it falls more slowly.
"""

from __future__ import annotations

import numpy as np
from scipy.signal import welch

from bsip_cli.body.person import Person
from bsip_cli.motion.jacobian import marker_residuals
from bsip_cli.motion.splines import bridged

# Where residuals show the skin: above the misfit of the model itself, below the white noise.
_BAND_HZ, _WINDOW_S = (2.0, 10.0), 1.28
_SEEN_SHARE = 0.5  # of the frames with a pose, for a marker to count


def skin_corner_hz(
    person: Person,
    q: np.ndarray,
    markers: np.ndarray,
    rate_hz: float,
    *,
    white_m: float,
    robust_limit_m: float,
) -> float:
    """Frequency [Hz] below which the residuals' coloured part is larger than the white noise.

    0 where there are too few markers to leave residuals.

    Parameters
    ----------
    q : (N, nq) poses.
    markers : (N, m, 3) where they were seen [m]; NaN where not.
    white_m : the markers' white noise, each direction.
    robust_limit_m : beyond it a marker's pull on the poses fades.
    """
    pull = _pulls(marker_residuals(person, q, markers), robust_limit_m)
    seen = np.isfinite(pull[..., 0])
    pull = pull[:, seen.sum(axis=0) > _SEEN_SHARE * seen.any(axis=1).sum()]
    coordinates = 3 * pull.shape[1]
    free = coordinates - len(person.skeleton.v_names)
    if free <= 0:
        return 0.0
    channels = bridged(pull.reshape(len(pull), coordinates))
    window = min(round(_WINDOW_S * rate_hz), len(channels))
    f, power = welch(channels, rate_hz, nperseg=window, axis=0, detrend="linear")
    power = power.sum(axis=1) / free * 0.5 * rate_hz  # as if white, of one direction
    band = (f >= _BAND_HZ[0]) & (f <= min(_BAND_HZ[1], 0.4 * rate_hz))
    band[1 + np.argmin(np.abs(f[1:] - np.mean(_BAND_HZ)))] = True  # none inside if short
    level = np.median(f[band] ** 4 * np.maximum(power[band] - white_m**2, 0.0))
    return float((level / white_m**2) ** 0.25)


def _pulls(residuals: np.ndarray, robust_limit_m: float) -> np.ndarray:
    """Residuals as the poses feel them: with the weights of the robust loss, their mean one."""
    distance = np.linalg.norm(residuals, axis=2, keepdims=True)
    weight = np.minimum(1.0, robust_limit_m / np.maximum(distance, 1e-12)) ** 2
    return residuals * weight / np.nanmean(weight)
