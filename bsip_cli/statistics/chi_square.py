"""The far tail of the chi-square distribution."""

from __future__ import annotations

import numpy as np
from scipy.special import chdtrc, gammaln

_FAR = 1000.0


def minus_log_p(statistic: np.ndarray | float, degrees: int) -> np.ndarray:
    """-log of the probability of a larger value, also where that is too small for a float.

    Far out the leading terms of the incomplete gamma function's expansion serve
    (Abramowitz and Stegun 1964, 6.5.32).
    """
    x = np.maximum(np.asarray(statistic, dtype=float), 0.0)
    half = degrees / 2
    near = -np.log(chdtrc(degrees, np.minimum(x, _FAR)))
    y = np.maximum(x, _FAR) / 2
    far = y - (half - 1) * np.log(y) + gammaln(half) - np.log1p((half - 1) / y)
    return np.where(x < _FAR, near, far)
