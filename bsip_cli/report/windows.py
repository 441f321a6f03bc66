"""Which stretch of a recording a figure shows."""

from __future__ import annotations

import numpy as np

from bsip_cli.report.figures.canvas import runs


def middle_of_longest(time_s: np.ndarray, flags: np.ndarray, seconds: float) -> slice:
    """Up to ``seconds`` from the middle of the longest stretch where ``flags`` holds."""
    stretches = runs(flags)
    if not stretches:
        return slice(0, 0)
    first, end = max(stretches, key=lambda pair: pair[1] - pair[0])
    spare = time_s[end - 1] - time_s[first] - seconds
    if spare <= 0.0:
        return slice(first, end)
    start = int(np.searchsorted(time_s, time_s[first] + spare / 2.0))
    return slice(start, int(np.searchsorted(time_s, time_s[start] + seconds, side="right")))


def hull_of(flags: np.ndarray, room: int) -> slice:
    """From the first to the last sample where ``flags`` holds, with ``room`` samples around."""
    places = np.flatnonzero(flags)
    if len(places) == 0:
        return slice(0, 0)
    return slice(max(0, places[0] - room), min(len(flags), places[-1] + 1 + room))
