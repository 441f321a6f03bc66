"""Does one computed signal correlate better with the measured one than another does?

Frames are not independent: pass the effective number of samples as n (it need not be whole). A
test that is not possible has nan numbers and a sentence in `reason`.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atanh, isnan, nan, sqrt

from scipy import stats

MINIMUM_SAMPLES = 4.0
"""Both tests divide by n - 3."""

SMALLEST_DETERMINANT = 1e-12


@dataclass(frozen=True)
class DependentCorrelations:
    """Williams' t test of r_mc1 = r_mc2, two-sided."""

    n: float
    difference: float
    t: float = nan
    df: float = nan
    p: float = nan
    reason: str = ""


@dataclass(frozen=True)
class IndependentCorrelations:
    """Fisher's z test of r1 = r2, two-sided; z_difference = atanh r1 - atanh r2."""

    n1: float
    n2: float
    difference: float
    z_difference: float = nan
    z: float = nan
    p: float = nan
    reason: str = ""


def williams_t(r_mc1: float, r_mc2: float, r_c1c2: float, n: float) -> DependentCorrelations:
    """Test of two correlations that share one signal: measured with c1, measured with c2.

    t = (r_mc1 - r_mc2) sqrt((n - 1)(1 + r_c1c2) / (2 (n - 1)/(n - 3) |R| + rbar^2
    (1 - r_c1c2)^3)) with n - 3 degrees of freedom, |R| the determinant of the three
    correlations (Williams 1959; Steiger 1980, Psychological Bulletin 87, eq. 7).

    Parameters
    ----------
    r_mc1, r_mc2 : correlation of the measured with each computed signal.
    r_c1c2 : correlation of the two computed signals.
    n : independent samples; of two effective numbers the smaller.
    """
    difference = r_mc1 - r_mc2
    determinant = 1.0 - r_mc1**2 - r_mc2**2 - r_c1c2**2 + 2.0 * r_mc1 * r_mc2 * r_c1c2
    reason = _why_not(n, r_mc1, r_mc2, r_c1c2)
    if not reason and determinant < -SMALLEST_DETERMINANT:
        reason = (
            f"No three signals can have the correlations {r_mc1:.6g}, {r_mc2:.6g} and {r_c1c2:.6g}."
        )
    if reason:
        return DependentCorrelations(n, difference, reason=reason)
    mean = (r_mc1 + r_mc2) / 2.0
    spread = 2.0 * (n - 1.0) / (n - 3.0) * max(determinant, 0.0) + mean**2 * (1.0 - r_c1c2) ** 3
    if spread < SMALLEST_DETERMINANT * (1.0 - r_c1c2):
        reason = "The three signals are linearly dependent, so the difference has no spread."
        return DependentCorrelations(n, difference, reason=reason)
    t = difference * sqrt((n - 1.0) * (1.0 + r_c1c2) / spread)
    df = n - 3.0
    return DependentCorrelations(n, difference, t, df, 2.0 * float(stats.t.sf(abs(t), df)))


def fisher_z_difference(r1: float, n1: float, r2: float, n2: float) -> IndependentCorrelations:
    """Test of two correlations from independent samples (Fisher 1921; Hansen 2014, 2.4).

    z = (atanh r1 - atanh r2) / sqrt(1/(n1 - 3) + 1/(n2 - 3)). For two correlations with the same
    measured signal it is too timid: `williams_t` is the test for them.
    """
    reason = _why_not(min(n1, n2), r1, r2) if not (isnan(n1) or isnan(n2)) else _why_not(nan)
    if reason:
        return IndependentCorrelations(n1, n2, r1 - r2, reason=reason)
    z_difference = atanh(r1) - atanh(r2)
    z = z_difference / sqrt(1.0 / (n1 - 3.0) + 1.0 / (n2 - 3.0))
    p = 2.0 * float(stats.norm.sf(abs(z)))
    return IndependentCorrelations(n1, n2, r1 - r2, z_difference, z, p)


def _why_not(n: float, *correlations: float) -> str:
    if isnan(n) or n < MINIMUM_SAMPLES:
        count = "an unknown number" if isnan(n) else f"{n:.3g}"
        return f"The test needs {MINIMUM_SAMPLES:.0f} independent samples, there are {count}."
    if any(isnan(r) for r in correlations):
        return "A correlation is unknown, because one of the signals is constant or empty."
    if any(abs(r) > 1.0 for r in correlations):
        return f"A correlation lies outside -1..1: {', '.join(f'{r:.6g}' for r in correlations)}."
    if any(abs(r) > 1.0 - 1e-12 for r in correlations):
        return "A correlation is perfect, so its sampling error is zero."
    return ""
