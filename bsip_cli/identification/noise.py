"""How much each component of the wrench may be trusted: residual size, its course, its memory.

What a fit leaves has two parts: one that is always there (sensors, the model), and one that grows
with the noise of the accelerations, which is large where the motion is fast. Both are estimated
from the residual itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from bsip_cli.identification.equations import ResidualSeries
from bsip_cli.statistics.samples import effective_samples

_ROUNDS = 8
_QUIETEST = 0.1  # of the root-mean-square: no frame is trusted more than ten times the average


@dataclass(frozen=True, eq=False)
class Noise:
    """Of each component of the wrench [N, N m].

    rms (6,) : the residual's size, frames counted by their weights.
    effective (6,) : independent samples among ``samples``.
    steady (6,), with_level (6,) : standard deviation that is always there, and per unit of the
    accelerations' noise level.
    """

    rms: np.ndarray
    effective: np.ndarray
    samples: int
    steady: np.ndarray
    with_level: np.ndarray

    def weights(self) -> np.ndarray:
        """(6,) weights [1/N2, 1/(N m)2] that make the sum of squares count independent samples."""
        return self.effective / self.samples / self.rms**2

    def weights_at(self, noise_level: np.ndarray) -> np.ndarray:
        """(n, 6) weights of frames by their noise level (n,), about 1 in the mean."""
        return self.rms**2 / _variances(self.steady, self.with_level, noise_level)


def even_noise(rms: np.ndarray, samples: int) -> Noise:
    """Noise (6,) of the same size in all frames, each of them independent."""
    return Noise(rms, np.full(6, float(samples)), samples, rms, np.zeros(6))


def noise_of(series: list[ResidualSeries]) -> Noise:
    """Noise from what a fit leaves, one series per recording."""
    residual = np.concatenate([one.residual for one in series])
    level = np.concatenate([one.noise_level for one in series])
    fits = [_course(residual[:, c], level) for c in range(6)]
    steady, with_level = np.array(fits).T
    spread = np.sqrt(_variances(steady, with_level, level))
    ends = np.cumsum([len(one.residual) for one in series])
    spans = [(int(e - len(s.residual)), int(e)) for e, s in zip(ends, series, strict=True)]
    effective = [_effective(residual[:, c] / spread[:, c], spans) for c in range(6)]
    rms = 1 / np.sqrt((1 / spread**2).mean(axis=0))
    return Noise(rms, np.array(effective), len(residual), steady, with_level)


def _course(residual: np.ndarray, level: np.ndarray) -> tuple[float, float]:
    """Standard deviations (steady, per level) of likely Gaussian residuals (n,)."""
    square = residual**2
    mean = max(float(square.mean()), 1e-18)
    terms = np.stack([np.ones_like(level), level**2], axis=1)
    scale = np.maximum(terms.mean(axis=0), 1e-300)
    variance = np.full_like(square, mean)
    parts = np.array([mean, 0.0])
    for _ in range(_ROUNDS):
        parts, _ = nnls(terms / scale / variance[:, None], square / variance)
        parts[0] = max(parts[0], _QUIETEST**2 * mean)
        variance = terms / scale @ parts
    return float(np.sqrt(parts[0])), float(np.sqrt(parts[1] / scale[1]))


def _variances(steady: np.ndarray, with_level: np.ndarray, level: np.ndarray) -> np.ndarray:
    return steady**2 + with_level**2 * level[:, None] ** 2


def _effective(series: np.ndarray, spans: list[tuple[int, int]]) -> float:
    count = effective_samples(series, spans)
    return float(np.clip(count, 1.0, len(series))) if np.isfinite(count) else 1.0
