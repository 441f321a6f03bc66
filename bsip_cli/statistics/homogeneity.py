"""Whether several estimates may be of one size."""

from __future__ import annotations

import numpy as np

from bsip_cli.statistics.normal import Z95


def p_of_one_size(estimates: np.ndarray, widths: np.ndarray) -> float:
    """Chance that estimates (n,) of one size spread like these (Cochran's Q).

    widths : (n,) of their 95 % intervals, above zero, in the estimates' unit.
    """
    from statsmodels.stats.meta_analysis import combine_effects

    with np.errstate(divide="ignore"):  # of I squared, where all are the same
        result = combine_effects(estimates, (widths / (2 * Z95)) ** 2)
    return float(result.test_homogeneity().pvalue)
