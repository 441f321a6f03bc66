"""One linear low-pass for both sides of the equations, confined to stretches of valid frames."""

from __future__ import annotations

import numpy as np
from scipy import sparse

_REACH = 4.0  # standard deviations at which the kernel ends


def stretches(valid: np.ndarray) -> list[tuple[int, int]]:
    """Half-open index ranges of the runs of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], valid.astype(np.int8), [0]])))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def lowpass_operator(
    valid: np.ndarray, rate_hz: float, cutoff_hz: float, stride: int = 1
) -> tuple[sparse.csr_array, np.ndarray]:
    """Gaussian zero-phase low-pass that never reaches beyond a stretch of valid frames.

    Near the end of a stretch the kernel is cut and normalised. The operator is the same for any
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
    rows, columns, weights = [], [], []
    frames: list[int] = []
    for start, stop in stretches(valid):
        for frame in range(start + min(stride, stop - start) // 2, stop, stride):
            around = np.arange(max(start, frame - reach), min(stop, frame + reach + 1))
            kernel = np.exp(-0.5 * ((around - frame) / sigma) ** 2)
            rows.append(np.full(len(around), len(frames)))
            columns.append(around)
            weights.append(kernel / kernel.sum())
            frames.append(frame)
    if not frames:
        return sparse.csr_array((0, len(valid))), np.empty(0, dtype=int)
    entries = (np.concatenate(weights), (np.concatenate(rows), np.concatenate(columns)))
    return sparse.csr_array(entries, shape=(len(frames), len(valid))), np.array(frames)
