"""What plates and clocks do a little wrong, beside the body, so that the body need not explain it.

A plate some millimetres aside looks like a lopsided trunk, and forces some milliseconds late like
heavier limbs. Both are unknowns of the same equations: their spread is an option of [identify],
and follows from the data as that of the body's parameters does (``weights``).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

GROUPS = (slice(0, 2), slice(2, 3))  # of the columns: where the plates are, when they read
COUNT = 3


@dataclass(frozen=True, eq=False)
class Instruments:
    """How far they err, as standard deviations, and the table's parameters phi (P,), whose wrench
    they read in the wrong place and late."""

    place_sd_m: float
    delay_sd_s: float
    phi: np.ndarray

    def columns(self, regressor: np.ndarray, rate_hz: float) -> np.ndarray:
        """(n, 6, 3) change of the measured wrench, of unit variance each: all plates moved along
        world X and Y, and all forces late. regressor (n, 6, P) of neighbouring frames."""
        wrench = regressor @ self.phi
        out = np.zeros((*wrench.shape, COUNT))
        for axis in range(2):
            out[:, 3:, axis] = self.place_sd_m * np.cross(np.eye(3)[axis], wrench[:, :3])
        if len(wrench) > 1:
            out[..., 2] = -self.delay_sd_s * rate_hz * np.gradient(wrench, axis=0)
        return out
