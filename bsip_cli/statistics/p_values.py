"""P values of several tests, corrected for their number."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np


def adjusted_p_values(
    p_values: Sequence[float], method: Literal["holm", "bonferroni"] = "holm"
) -> tuple[float, ...]:
    """P values that hold for the whole family of tests.

    Bonferroni: m p. Holm 1979 (Scand. J. Stat. 6): the same guarantee, never larger. Tests that
    were not possible (nan) stay nan and do not count in m.

    Raises
    ------
    ValueError
        if a p value lies outside 0 .. 1.
    """
    p = np.array(p_values, dtype=float)
    possible = ~np.isnan(p)
    if np.any((p[possible] < 0.0) | (p[possible] > 1.0)):
        raise ValueError(f"p values outside 0..1: {p_values}")
    if possible.any():
        from statsmodels.stats.multitest import multipletests

        p[possible] = multipletests(p[possible], method=method)[1]
    return tuple(float(value) for value in p)
