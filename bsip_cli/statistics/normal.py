"""The normal distribution."""

from __future__ import annotations

Z95 = 1.959964  # standard deviations to either side that hold 95 %
