"""Of a trial's signals: how well one follows another (Hansen 2014, section 2.4), and sway."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, hypot, nan, pi, sqrt

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import chi2

from bsip_cli.dynamics.lowpass import valid_intervals
from bsip_cli.statistics import samples

ELLIPSE_SHARE = 0.95
MM_PER_M = 1e3


@dataclass(frozen=True)
class FitMeasures:
    """Agreement of a computed with a measured signal. What cannot be computed is nan.

    rmse is in the unit of the signals, rmse_percent_bw in percent of the body weight (nan
    without one), all others without unit. schwer_p lies in 0 .. 1, schwer_m in -1 .. infinity:
    both are 0 for equal signals. n counts the samples compared, n_effective the independent
    pairs they are worth for the correlation.
    """

    rmse: float = nan
    rmse_percent_bw: float = nan
    pearson_r: float = nan
    schwer_m: float = nan
    schwer_p: float = nan
    schwer_c: float = nan
    n: int = 0
    n_effective: float = nan


def fit_measures(
    measured: ArrayLike,
    computed: ArrayLike,
    body_weight_N: float | None = None,
) -> FitMeasures:
    """RMSE, Pearson's r and the Sprague-Geers metric of two signals.

    With theta_ab the mean of a b: M = sqrt(theta_cc / theta_mm) - 1, P = arccos(theta_mc /
    sqrt(theta_mm theta_cc)) / pi, C = sqrt(M^2 + P^2) (Sprague and Geers, as in Schwer 2007,
    Validation metrics for response histories, Engineering with Computers 23). They are not
    centred: for a signal with a large mean, such as the vertical force, P stays small whatever
    the phase.

    measured, computed : shape (n,), one unit. Rows in which either is not finite are left out.
    body_weight_N : mass times g; None if the signals are no forces.
    ValueError: if the shapes differ.
    """
    m, c = samples.finite_pairs(measured, computed)
    if len(m) == 0:
        return FitMeasures()
    rmse = float(np.sqrt(np.mean((c - m) ** 2)))
    percent = 100.0 * rmse / body_weight_N if body_weight_N else nan
    size_m, size_c = float(np.linalg.norm(m)), float(np.linalg.norm(c))
    # no magnitude and no phase error of a measured signal that is zero, no phase of a computed
    magnitude, phase = nan if size_m == 0.0 else -1.0, nan
    if size_m > 0.0 and size_c > 0.0:
        u, v = m / size_m, c / size_c
        # the arccos of Schwer's P, in the form that keeps its digits near 0 and pi (Kahan 2006)
        angle = 2.0 * atan2(float(np.linalg.norm(u - v)), float(np.linalg.norm(u + v)))
        magnitude, phase = size_c / size_m - 1.0, angle / pi
    schwer = magnitude, phase, hypot(magnitude, phase)
    n_effective = samples.effective_samples_of_pair(measured, computed)
    return FitMeasures(rmse, percent, _pearson(m, c), *schwer, len(m), n_effective)


def correlation(x: ArrayLike, y: ArrayLike) -> float:
    """Pearson's r of two signals, as in `fit_measures`."""
    return _pearson(*samples.finite_pairs(x, y))


def _pearson(m: NDArray[np.float64], c: NDArray[np.float64]) -> float:
    if len(m) < 2 or samples.is_constant(m) or samples.is_constant(c):
        return nan
    return float(np.clip(np.corrcoef(m, c)[0, 1], -1.0, 1.0))


# --- sway of the centre of pressure (Hansen 2017, table 3, with units and means corrected) --------


@dataclass(frozen=True)
class Posturography:
    """Sway measures of one signal; what cannot be computed is nan.

    rms_*_mm : root mean square about the mean, the usual definition of sway.
    rms_*_origin_m : about the origin of the coordinates, which only shows where the person
        stood; it is here because the printed values of Hansen 2017 fit it.
    duration_s : time between first and last sample of each interval, summed.
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


def posturography(cop_ap_m: ArrayLike, cop_ml_m: ArrayLike, rate_hz: float) -> Posturography:
    """RMS, mean velocity, path length and 95 % ellipse area of a centre of pressure.

    Path and time are summed within contiguous intervals only: no step across a gap. Mean
    velocity = path / time. The ellipse is the prediction ellipse, within which 95 % of a normal
    distribution of points lies: pi chi2_{2, 0.95} sqrt(det S), S the covariance with n - 1
    (Schubert and Kirchner 2014, Ellipse area calculations and their applicability in
    posturography, Gait & Posture 39; exact for long recordings, Duarte 2015, ibid. 41). It is
    not the confidence ellipse of the mean, which shrinks as the recording gets longer.

    cop_ap_m, cop_ml_m : shape (n,), in m. Samples in which either is not finite are gaps.
    rate_hz : samples per second.
    ValueError: if rate_hz is not positive or the shapes differ.
    """
    if not rate_hz > 0.0:
        raise ValueError(f"rate_hz must be positive, not {rate_hz}")
    ap, ml = np.asarray(cop_ap_m, dtype=float), np.asarray(cop_ml_m, dtype=float)
    path = np.stack(samples.finite_pairs(ap, ml))
    parts = valid_intervals(np.isfinite(ap) & np.isfinite(ml))
    n = path.shape[1]
    if n == 0:
        return Posturography()
    ap_mm, ml_mm = (path.std(axis=1) * MM_PER_M).tolist()
    ap_origin_m, ml_origin_m = np.sqrt(np.mean(path**2, axis=1)).tolist()
    length_m = sum(
        float(np.hypot(np.diff(ap[start:stop]), np.diff(ml[start:stop])).sum())
        for start, stop in parts
    )
    duration_s = sum(stop - start - 1 for start, stop in parts) / rate_hz
    area = nan
    if n >= 3:
        determinant = max(float(np.linalg.det(np.cov(path * MM_PER_M))), 0.0)  # rounding: below 0
        area = float(pi * chi2.ppf(ELLIPSE_SHARE, df=2) * sqrt(determinant))
    length_mm = length_m * MM_PER_M if duration_s else nan
    velocity_mm_s = length_m * MM_PER_M / duration_s if duration_s else nan
    rms = ap_mm, ml_mm, ap_origin_m, ml_origin_m
    return Posturography(*rms, velocity_mm_s, length_mm, area, duration_s, n)
