"""What decides how a session's numbers are understood."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_T3_MEDIAN = 0.7649  # of the size of Student's t with three degrees of freedom


@dataclass(frozen=True)
class GateLimits:
    """Options of `ingest`; their reasons are in configs/default.toml, whose values these are."""

    believed_percent: float = 90.0
    corrected_percent: float = 95.0
    balance_median_m: float = 0.024
    complete_percent: float = 15.0
    marker_noise_m: float = 0.001
    independent_numbers: float = 12.0

    def balance_scale_m(self) -> float:
        """Where the density (1 + (gap / scale)^2)^-2, Student's, begins to fall."""
        return float(np.sqrt(3.0) / _T3_MEDIAN) * self.balance_median_m


USUAL = GateLimits()
