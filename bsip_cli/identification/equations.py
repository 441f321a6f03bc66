"""The identification's normal equations, accumulated in blocks over trials."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from scipy import sparse

from bsip_cli.dynamics.lowpass import lowpass_operator, stride_to
from bsip_cli.dynamics.pinocchio_model import bodies_of
from bsip_cli.dynamics.regressor import move_moments, wrench_regressor

# --- what the instruments may do wrong, beside the body -------------------------------------------

# A plate some millimetres aside looks like a lopsided trunk, and forces some milliseconds late like
# heavier limbs. Both are unknowns of the same equations: their spread is an option of [identify],
# and follows from the data as that of the body's parameters does (``weights``).

INSTRUMENT_GROUPS = (
    slice(0, 2),
    slice(2, 3),
)  # of the columns: where the plates are, when they read
INSTRUMENT_COUNT = 3


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
        out = np.zeros((*wrench.shape, INSTRUMENT_COUNT))
        for axis in range(2):
            out[:, 3:, axis] = self.place_sd_m * np.cross(np.eye(3)[axis], wrench[:, :3])
        if len(wrench) > 1:
            out[..., 2] = -self.delay_sd_s * rate_hz * np.gradient(wrench, axis=0)
        return out


# --------------------------------------------------------------------------------------------------


_ROWS = 100  # outputs per block: some 15 MB of regressor
_OVERSAMPLING = 2.5  # samples kept per period of the cut-off


def _alike(noise_level: np.ndarray) -> np.ndarray:
    return np.ones((len(noise_level), 6))


@dataclass(frozen=True, eq=False)
class Recording:
    """Motion and measured wrench of one trial.

    q (N, nq), v and a (N, nv); wrench (N, 6) about the world's origin [N, N m]; use (N,) frames
    that may enter; rate [Hz]; noise_level (N,) of the accelerations, in any unit: only its course
    counts.
    """

    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    wrench: np.ndarray
    use: np.ndarray
    rate_hz: float
    noise_level: np.ndarray


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """Sums over samples of the wrench equation, one set per component c of the wrench.

    information (6, P, P) = sum w Y_c^T Y_c, right (6, P) = sum w Y_c^T F_c, squares (6,) = sum w
    F_c^2 with weights w of mean 1; ``samples`` per component, ``duration_s`` of motion behind them.
    Columns of the instruments, where they are asked for, follow the body's parameters.
    """

    information: np.ndarray
    right: np.ndarray
    squares: np.ndarray
    samples: int
    duration_s: float

    def of_the_body(self, size: int) -> NormalEquations:
        """The same, instruments without fault: the first ``size`` columns."""
        return replace(
            self, information=self.information[:, :size, :size], right=self.right[:, :size]
        )

    def weighted(self, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Information (P, P) and right side (P,) with a weight (6,) per component."""
        return (
            np.einsum("c,cij->ij", weights, self.information),
            np.einsum("c,ci->i", weights, self.right),
        )

    def with_known(self, phi: np.ndarray, known: np.ndarray) -> NormalEquations:
        """The equations of the other parameters, once some (P,) have the values in ``phi`` (P,).

        The known ones' wrench is taken off the measured one; nothing more is said about them.
        Columns beyond the parameters stay free.
        """
        beyond = self.right.shape[1] - len(phi)
        phi, known = np.pad(phi, (0, beyond)), np.pad(known, (0, beyond))
        part = np.where(known, phi, 0.0)
        moved = self.information @ part
        squares = self.squares - 2 * self.right @ part + moved @ part
        free = ~known
        return replace(
            self,
            information=self.information * np.outer(free, free),
            right=(self.right - moved) * free,
            squares=squares,
        )

    def residual_rms(self, phi: np.ndarray) -> np.ndarray:
        """(6,) root-mean-square residual [N, N m], weighted, of a parameter vector (P,)."""
        fitted = np.einsum("i,cij,j->c", phi, self.information, phi)
        squares = self.squares - 2 * self.right @ phi + fitted
        return np.sqrt(np.maximum(squares, 0.0) / self.samples)


@dataclass(frozen=True, eq=False)
class Samples:
    """Filtered and decimated equations of some frames: regressor (n, 6, P) and measured wrench
    (n, 6) about the reference, and the accelerations' noise level (n,)."""

    regressor: np.ndarray
    measured: np.ndarray
    noise_level: np.ndarray


@dataclass(frozen=True, eq=False)
class ResidualSeries:
    """What a parameter vector leaves of one recording: residual (n, 6), noise level (n,)."""

    residual: np.ndarray
    noise_level: np.ndarray


def accumulate(
    model: pin.Model,
    recordings: list[Recording],
    cutoff_hz: float,
    reference_m: np.ndarray,
    weights_at: Callable[[np.ndarray], np.ndarray] = _alike,
    beside: Instruments | None = None,
) -> NormalEquations:
    """Both sides of the equations through the same low-pass, decimated, weighted and summed.

    ``weights_at`` turns noise levels (n,) into weights (n, 6). Memory does not grow with the length
    of the trials.
    """
    size = 10 * len(bodies_of(model)) + (INSTRUMENT_COUNT if beside else 0)
    information, right = np.zeros((6, size, size)), np.zeros((6, size))
    squares, samples, duration = np.zeros(6), 0, 0.0
    for recording in recordings:
        for block in _filtered_blocks(model, recording, cutoff_hz, reference_m, beside):
            root = np.sqrt(weights_at(block.noise_level))
            measured = root * block.measured
            for c in range(6):
                rows = root[:, c, None] * block.regressor[:, c]
                information[c] += rows.T @ rows
                right[c] += rows.T @ measured[:, c]
            squares += (measured**2).sum(axis=0)
            samples += len(measured)
        duration += recording.use.sum() / recording.rate_hz
    return NormalEquations(information, right, squares, samples, duration)


def residual_series(
    model: pin.Model,
    recordings: list[Recording],
    cutoff_hz: float,
    reference_m: np.ndarray,
    phi: np.ndarray,
) -> list[ResidualSeries]:
    """Per recording with usable frames, the filtered residual of a parameter vector."""
    series = []
    for recording in recordings:
        blocks = list(_left_over(model, recording, cutoff_hz, reference_m, phi))
        if blocks:
            residuals, levels = zip(*blocks, strict=True)
            series.append(ResidualSeries(np.concatenate(residuals), np.concatenate(levels)))
    return series


def _left_over(model, recording, cutoff_hz, reference_m, phi):
    for block in _filtered_blocks(model, recording, cutoff_hz, reference_m):
        yield block.measured - block.regressor @ phi, block.noise_level


def _filtered_blocks(
    model: pin.Model,
    recording: Recording,
    cutoff_hz: float,
    reference_m: np.ndarray,
    beside: Instruments | None = None,
) -> Iterator[Samples]:
    stride = stride_to(recording.rate_hz, _OVERSAMPLING * cutoff_hz)
    operator, frames = lowpass_operator(recording.use, recording.rate_hz, cutoff_hz, stride)
    measured = operator @ np.where(
        recording.use[:, None], move_moments(recording.wrench, reference_m), 0.0
    )
    data = model.createData()
    for start in range(0, operator.shape[0], _ROWS):
        rows: sparse.csr_array = operator[start : start + _ROWS]
        first, last = int(rows.indices.min()), int(rows.indices.max()) + 1
        part = slice(first, last)
        regressor = wrench_regressor(
            model, data, recording.q[part], recording.v[part], recording.a[part], reference_m
        )
        if beside:
            columns = beside.columns(regressor, recording.rate_hz)
            regressor = np.concatenate([regressor, columns], axis=2)
        filtered = rows[:, part] @ regressor.reshape(last - first, -1)
        yield Samples(
            filtered.reshape(rows.shape[0], 6, -1),
            measured[start : start + _ROWS],
            recording.noise_level[frames[start : start + _ROWS]],
        )
