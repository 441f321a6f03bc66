"""What decides how a session's numbers are understood."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class GateLimits:
    """Options of `ingest`; their reasons are in configs/default.toml, whose values these are."""

    believed_percent: float = 85.0
    corrected_percent: float = 95.0
    balance_median_m: float = 0.024
    complete_percent: float = 15.0
    marker_noise_m: float = 0.001
    independent_numbers: float = 12.0


USUAL = GateLimits()
