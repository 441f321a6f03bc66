"""One linear low-pass for both sides of the equations, confined to intervals of valid frames."""

from __future__ import annotations

import numpy as np
from scipy import sparse

_REACH = 4.0  # standard deviations at which the kernel ends


def valid_intervals(valid: np.ndarray) -> list[tuple[int, int]]:
    """Half-open index ranges of the runs of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], valid.astype(np.int8), [0]])))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def stride_to(rate_hz: float, enough_hz: float) -> int:
    """Every which frame is enough for a rate; rounding in the times decides nothing."""
    return max(1, int(rate_hz / enough_hz * (1 + 1e-6)))


def lowpass_operator(
    valid: np.ndarray, rate_hz: float, cutoff_hz: float, stride: int = 1
) -> tuple[sparse.csr_array, np.ndarray]:
    """Gaussian zero-phase low-pass that never reaches beyond an interval of valid frames.

    Near the end of an interval the kernel is cut and normalised. The operator is the same for any
    signal, so both sides of a linear equation stay comparable (design: like with like).

    Parameters
    ----------
    valid : (N,) frames that may enter.
    cutoff_hz : frequency at which half of the power is left.
    stride : every which valid frame gets an output.

    Returns
    -------
    Operator (n_out, N), and the frame (n_out,) that each output belongs to.
    """
    sigma = np.sqrt(np.log(2)) / (2 * np.pi * cutoff_hz) * rate_hz
    reach = int(np.ceil(_REACH * sigma))
    parts = [np.empty((0, 3), dtype=int)]
    for start, stop in valid_intervals(valid):
        own = np.arange(start + min(stride, stop - start) // 2, stop, stride)
        parts.append(np.stack([np.full_like(own, start), np.full_like(own, stop), own], axis=1))
    starts, stops, frames = np.concatenate(parts).T
    columns = frames[:, None] + np.arange(-reach, reach + 1)
    inside = (columns >= starts[:, None]) & (columns < stops[:, None])
    kernel = inside * np.exp(-0.5 * ((columns - frames[:, None]) / sigma) ** 2)
    weights = (kernel / kernel.sum(axis=1, keepdims=True))[inside]
    ends = np.concatenate([[0], np.cumsum(inside.sum(axis=1))])
    shape = (len(frames), len(valid))
    return sparse.csr_array((weights, columns[inside], ends), shape=shape), frames


def noise_left(rate_hz: float, cutoff_hz: float) -> float:
    """Part of the variance of white noise that the low-pass leaves: the sum of its squared kernel,
    1 / (2 sqrt(pi) sigma) with sigma in frames; all of it where that kernel is shorter than one."""
    sigma = np.sqrt(np.log(2)) / (2 * np.pi * cutoff_hz) * rate_hz
    return float(min(1.0, 1.0 / (2.0 * np.sqrt(np.pi) * sigma)))
