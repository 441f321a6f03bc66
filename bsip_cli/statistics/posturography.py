"""Sway of the centre of pressure (Hansen 2017, table 3, with units and means corrected)."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan, pi, sqrt

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import chi2

from bsip_cli.statistics.stretches import Stretches, finite_stretches, joined

ELLIPSE_SHARE = 0.95
MM_PER_M = 1e3


@dataclass(frozen=True)
class Posturography:
    """Sway measures of one signal; what cannot be computed is nan and `reason` says why.

    rms_*_mm : root mean square about the mean, the usual definition of sway.
    rms_*_origin_m : about the origin of the coordinates, which only tells where the person
        stood; it is here because the printed values of Hansen 2017 fit it.
    duration_s : time between first and last sample, summed over the stretches.
    """

    rms_ap_mm: float = nan
    rms_ml_mm: float = nan
    rms_ap_origin_m: float = nan
    rms_ml_origin_m: float = nan
    mean_velocity_mm_s: float = nan
    sway_length_mm: float = nan
    ellipse_area_mm2: float = nan
    duration_s: float = nan
    n: int = 0
    reason: str = ""


def posturography(
    cop_ap_m: ArrayLike,
    cop_ml_m: ArrayLike,
    rate_hz: float,
    stretches: Stretches | None = None,
) -> Posturography:
    """RMS, mean velocity, path length and 95 % ellipse area of a centre of pressure.

    Path and time are summed within contiguous stretches only: no step across a gap. Mean
    velocity = path / time. The ellipse is the prediction ellipse, within which 95 % of a normal
    distribution of points lies: pi chi2_{2, 0.95} sqrt(det S), S the covariance with n - 1
    (Schubert and Kirchner 2014, Ellipse area calculations and their applicability in
    posturography, Gait & Posture 39; exact for long recordings, Duarte 2015, ibid. 41). It is
    not the confidence ellipse of the mean, which shrinks as the recording gets longer.

    Parameters
    ----------
    cop_ap_m, cop_ml_m : shape (n,), in m. Samples in which either is not finite are gaps.
    rate_hz : samples per second.
    stretches : half-open index pairs of the samples to use, None for all.

    Raises
    ------
    ValueError
        if rate_hz is not positive, the shapes differ or the stretches do not fit them.
    """
    if not rate_hz > 0.0:
        raise ValueError(f"rate_hz must be positive, not {rate_hz}")
    ap, ml = np.asarray(cop_ap_m, dtype=float), np.asarray(cop_ml_m, dtype=float)
    parts = finite_stretches(stretches, ap, ml)
    path = np.stack([joined(ap, parts), joined(ml, parts)])
    n = path.shape[1]
    if n == 0:
        return Posturography(reason="There is no sample with a COP.")
    rms_ap_mm, rms_ml_mm = path.std(axis=1) * MM_PER_M
    rms_ap_origin_m, rms_ml_origin_m = np.sqrt(np.mean(path**2, axis=1))
    length_m = sum(
        float(np.hypot(np.diff(ap[start:stop]), np.diff(ml[start:stop])).sum())
        for start, stop in parts
    )
    duration_s = sum(stop - start - 1 for start, stop in parts) / rate_hz
    reasons = []
    if duration_s == 0.0:
        reasons.append("No two samples follow each other: no path and no velocity.")
    if n < 3:
        reasons.append("Fewer than three samples span no ellipse.")
    return Posturography(
        rms_ap_mm=float(rms_ap_mm),
        rms_ml_mm=float(rms_ml_mm),
        rms_ap_origin_m=float(rms_ap_origin_m),
        rms_ml_origin_m=float(rms_ml_origin_m),
        mean_velocity_mm_s=length_m * MM_PER_M / duration_s if duration_s else nan,
        sway_length_mm=length_m * MM_PER_M if duration_s else nan,
        ellipse_area_mm2=_ellipse_area(path * MM_PER_M) if n >= 3 else nan,
        duration_s=duration_s,
        n=n,
        reason=" ".join(reasons),
    )


def _ellipse_area(points: np.ndarray) -> float:
    """Area of the prediction ellipse of points (2, n), in their unit squared."""
    determinant = max(float(np.linalg.det(np.cov(points))), 0.0)  # rounding may dip below 0
    return float(pi * chi2.ppf(ELLIPSE_SHARE, df=2) * sqrt(determinant))
