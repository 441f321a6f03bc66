"""Is a sample normal enough for a t test?"""

from __future__ import annotations

from dataclasses import dataclass
from math import nan

from numpy.typing import ArrayLike

from bsip_cli.statistics.samples import finite_values, is_constant

MINIMUM_FOR_LILLIEFORS = 4
"""The simulated table of critical values starts here."""


@dataclass(frozen=True)
class NormalityTest:
    """Lilliefors' test. `normal` is None where the test is not possible: `reason` says why.

    `normal` means only that normality was not rejected; small samples rarely reject anything.
    """

    n: int
    statistic: float = nan
    p_value: float = nan
    normal: bool | None = None
    reason: str = ""


def lilliefors_test(x: ArrayLike, alpha: float = 0.05) -> NormalityTest:
    """Kolmogorov-Smirnov test of normality with estimated mean and variance.

    Lilliefors 1967 (J. Am. Stat. Assoc. 62), as in Hansen 2017 (Statistical analyses); p from
    the simulated table of statsmodels, which ends at 0.001 and 0.99.

    Parameters
    ----------
    x : shape (n,), any unit; for a paired t test the differences. Values that are not finite
        are dropped; n says how many are left.
    alpha : level at which `normal` turns False.
    """
    values = finite_values(x)
    n = len(values)
    if n < MINIMUM_FOR_LILLIEFORS:
        reason = f"Lilliefors' test needs {MINIMUM_FOR_LILLIEFORS} values, there are {n}."
        return NormalityTest(n, reason=reason)
    if is_constant(values):
        reason = "All values are equal, so there is no distribution to test."
        return NormalityTest(n, reason=reason)
    from statsmodels.stats.diagnostic import lilliefors

    statistic, p_value = lilliefors(values, dist="norm", pvalmethod="table")
    return NormalityTest(n, float(statistic), float(p_value), bool(p_value >= alpha))
