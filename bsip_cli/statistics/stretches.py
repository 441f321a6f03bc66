"""Contiguous stretches of a sampled signal: half-open index pairs (start, stop) into it."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

Stretches = Sequence[tuple[int, int]]
"""(start, stop) pairs, stop excluded, in samples. Time breaks between one and the next."""


def stretches_of(valid: ArrayLike) -> list[tuple[int, int]]:
    """The runs of True in a (n,) boolean array, in order."""
    flags = np.asarray(valid, dtype=bool)
    if flags.ndim != 1:
        raise ValueError(f"valid must be one-dimensional, not of shape {flags.shape}")
    edges = np.flatnonzero(np.diff(flags.astype(np.int8), prepend=0, append=0))
    return [(int(start), int(stop)) for start, stop in edges.reshape(-1, 2)]


def finite_stretches(
    stretches: Stretches | None, *signals: NDArray[np.float64]
) -> list[tuple[int, int]]:
    """The given stretches, split where any of the signals is not finite.

    Parameters
    ----------
    stretches : half-open index pairs, or None for the whole signals.
    signals : one or more arrays of the same shape (n,).

    Raises
    ------
    ValueError
        if the signals differ in shape, or the stretches overlap, run backwards or leave the
        signals: a mistake of the caller, not of the data.
    """
    n = len(signals[0])
    if any(signal.shape != (n,) for signal in signals):
        raise ValueError(f"signals must share one shape (n,): {[s.shape for s in signals]}")
    ordered = sorted((int(start), int(stop)) for start, stop in stretches or [(0, n)])
    if stretches is not None and len(stretches) == 0:
        return []
    for start, stop in ordered:
        if not 0 <= start <= stop <= n:
            raise ValueError(f"stretch ({start}, {stop}) does not lie within 0..{n}")
    for (_, stop), (start, _) in pairwise(ordered):
        if start < stop:
            raise ValueError(f"stretches overlap at sample {start}")
    finite = np.logical_and.reduce([np.isfinite(signal) for signal in signals])
    return [
        (start + first, start + last)
        for start, stop in ordered
        for first, last in stretches_of(finite[start:stop])
    ]


def joined(signal: NDArray[np.float64], stretches: Stretches) -> NDArray[np.float64]:
    """The samples of all stretches, one after the other."""
    if not stretches:
        return signal[:0]
    return np.concatenate([signal[start:stop] for start, stop in stretches])
