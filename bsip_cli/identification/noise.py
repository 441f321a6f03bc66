"""How much each component of the wrench may be trusted: residual size and its memory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bsip_cli.statistics.effective_samples import effective_samples


@dataclass(frozen=True)
class Noise:
    """rms (6,) of the residual [N, N m] and its effective number of samples (6,)."""

    rms: np.ndarray
    effective: np.ndarray
    samples: int

    def weights(self) -> np.ndarray:
        """(6,) weights [1/N2, 1/(N m)2] that make the sum of squares count independent samples."""
        return self.effective / self.samples / self.rms**2


def noise_of(residuals: list[np.ndarray]) -> Noise:
    """Noise from residual series, one (n, 6) array per stretch."""
    joined = np.concatenate(residuals)
    ends = np.cumsum([len(series) for series in residuals])
    spans = [(int(end - len(s)), int(end)) for end, s in zip(ends, residuals, strict=True)]
    effective = [_effective(joined[:, c], spans) for c in range(6)]
    rms = np.sqrt((joined**2).mean(axis=0))
    return Noise(np.maximum(rms, 1e-9), np.array(effective), len(joined))


def _effective(series: np.ndarray, spans: list[tuple[int, int]]) -> float:
    count = effective_samples(series, spans)
    return float(np.clip(count, 1.0, len(series))) if np.isfinite(count) else 1.0
