"""How well a computed signal follows a measured one (Hansen 2014, section 2.4)."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, hypot, nan, pi

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bsip_cli.statistics.effective_samples import MINIMUM_SAMPLES, effective_samples_of_pair
from bsip_cli.statistics.samples import is_constant
from bsip_cli.statistics.stretches import Stretches, finite_stretches, joined


@dataclass(frozen=True)
class FitMeasures:
    """Agreement of a computed with a measured signal. What cannot be computed is nan.

    rmse is in the unit of the signals, rmse_percent_bw in percent of the body weight (nan
    without one), all others without unit. schwer_p lies in 0 .. 1, schwer_m in -1 .. infinity:
    both are 0 for equal signals. n counts the samples compared, n_effective the independent
    pairs they are worth for the correlation. `reason` says in sentences why numbers are nan; it
    is empty when none had to be left out.
    """

    rmse: float = nan
    rmse_percent_bw: float = nan
    pearson_r: float = nan
    schwer_m: float = nan
    schwer_p: float = nan
    schwer_c: float = nan
    n: int = 0
    n_effective: float = nan
    reason: str = ""


def fit_measures(
    measured: ArrayLike,
    computed: ArrayLike,
    stretches: Stretches | None = None,
    body_weight_N: float | None = None,
) -> FitMeasures:
    """RMSE, Pearson's r and the Sprague-Geers metric of two signals over the given stretches.

    With theta_ab the mean of a b: M = sqrt(theta_cc / theta_mm) - 1, P = arccos(theta_mc /
    sqrt(theta_mm theta_cc)) / pi, C = sqrt(M^2 + P^2) (Sprague and Geers, as in Schwer 2007,
    Validation metrics for response histories, Engineering with Computers 23). They are not
    centred: for a signal with a large mean, such as the vertical force, P stays small whatever
    the phase.

    Parameters
    ----------
    measured, computed : shape (n,), one unit. Rows in which either is not finite are left out.
    stretches : half-open index pairs of the samples to compare, None for all.
    body_weight_N : mass times g; None if the signals are no forces.

    Raises
    ------
    ValueError
        if the shapes differ or the stretches do not fit them.
    """
    measured, computed = np.asarray(measured, dtype=float), np.asarray(computed, dtype=float)
    parts = finite_stretches(stretches, measured, computed)
    m, c = joined(measured, parts), joined(computed, parts)
    if len(m) == 0:
        return FitMeasures(reason="There is no sample with both signals.")
    rmse = float(np.sqrt(np.mean((c - m) ** 2)))
    percent = 100.0 * rmse / body_weight_N if body_weight_N else nan
    r, why_no_r = _pearson(m, c)
    magnitude, phase, why_no_metric = _magnitude_and_phase(m, c)
    few = f"Under {MINIMUM_SAMPLES} samples there is no effective number."
    why_no_number = few if len(m) < MINIMUM_SAMPLES else ""
    return FitMeasures(
        rmse=rmse,
        rmse_percent_bw=percent,
        pearson_r=r,
        schwer_m=magnitude,
        schwer_p=phase,
        schwer_c=hypot(magnitude, phase),
        n=len(m),
        n_effective=effective_samples_of_pair(measured, computed, parts),
        reason=" ".join(filter(None, [why_no_r, why_no_metric, why_no_number])),
    )


def _pearson(m: NDArray[np.float64], c: NDArray[np.float64]) -> tuple[float, str]:
    if len(m) < 2:
        return nan, "One sample has no correlation."
    constant = [name for name, s in (("measured", m), ("computed", c)) if is_constant(s)]
    if constant:
        verb = "signals are" if len(constant) > 1 else "signal is"
        return nan, f"The {' and the '.join(constant)} {verb} constant: no correlation."
    return float(np.clip(np.corrcoef(m, c)[0, 1], -1.0, 1.0)), ""


def _magnitude_and_phase(
    m: NDArray[np.float64], c: NDArray[np.float64]
) -> tuple[float, float, str]:
    size_m, size_c = float(np.linalg.norm(m)), float(np.linalg.norm(c))
    if size_m == 0.0:
        return nan, nan, "The measured signal is zero: no magnitude and no phase error."
    if size_c == 0.0:
        return -1.0, nan, "The computed signal is zero: no phase error."
    u, v = m / size_m, c / size_c
    # the arccos of Schwer's P, in the form that keeps its digits near 0 and pi (Kahan 2006)
    angle = 2.0 * atan2(float(np.linalg.norm(u - v)), float(np.linalg.norm(u + v)))
    return size_c / size_m - 1.0, angle / pi, ""
