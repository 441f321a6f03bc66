"""The problem that every estimator solves: normal equations, their noise, and what comes back."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from scipy import sparse
from scipy.optimize import nnls

from bsip_cli.dynamics.base_parameters import Basis
from bsip_cli.dynamics.ground_wrench import bodies_of, move_moments, wrench_regressor
from bsip_cli.dynamics.lowpass import lowpass_operator, stride_to
from bsip_cli.identification.prior import Prior
from bsip_cli.statistics.samples import effective_samples

# --- what the instruments may do wrong, jointly with the body -------------------------------------

# A plate some millimetres aside looks like a lopsided trunk, and forces some milliseconds late like
# heavier limbs. Both are unknowns of the same equations: their spread is an option of [identify],
# and follows from the data as that of the body's parameters does (``weights``).

INSTRUMENT_GROUPS = (slice(0, 2), slice(2, 3))  # columns: where the plates are, when they read
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


_ROWS = 100  # outputs per block: some 15 MB of regressor
_OVERSAMPLING = 2.5  # samples kept per period of the cut-off


@dataclass(frozen=True, eq=False)
class Recording:
    """Motion and measured wrench of one trial.

    q (N, nq), v and a (N, nv); wrench (N, 6) about the world's origin [N, N m]; use (N,) frames
    that may enter; rate [Hz]; noise_level (N,) of the accelerations, in any unit: only its shape
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


Residual = tuple[np.ndarray, np.ndarray]
"""What a parameter vector leaves of one recording: (n, 6), and its noise level (n,)."""


def accumulate(
    model: pin.Model,
    recordings: list[Recording],
    cutoff_hz: float,
    reference_m: np.ndarray,
    weights_at: Callable[[np.ndarray], np.ndarray] | None = None,
    instruments: Instruments | None = None,
) -> NormalEquations:
    """Both sides of the equations through the same low-pass, decimated, weighted and summed.

    ``weights_at`` turns noise levels (n,) into weights (n, 6). Memory does not grow with the length
    of the trials.
    """
    size = 10 * len(bodies_of(model)) + (INSTRUMENT_COUNT if instruments else 0)
    information, right = np.zeros((6, size, size)), np.zeros((6, size))
    squares, samples, duration = np.zeros(6), 0, 0.0
    for recording in recordings:
        blocks = _filtered_blocks(model, recording, cutoff_hz, reference_m, instruments)
        for regressor, wrench, noise_level in blocks:
            root = np.ones((len(wrench), 6))
            if weights_at is not None:
                root = np.sqrt(weights_at(noise_level))
            measured = root * wrench
            for c in range(6):
                rows = root[:, c, None] * regressor[:, c]
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
) -> list[Residual]:
    """Per recording with usable frames, the filtered residual of a parameter vector."""
    series = []
    for recording in recordings:
        blocks = _filtered_blocks(model, recording, cutoff_hz, reference_m)
        left = [(measured - regressor @ phi, level) for regressor, measured, level in blocks]
        if left:
            residual, level = map(np.concatenate, zip(*left, strict=True))
            series.append((residual, level))
    return series


def _filtered_blocks(
    model: pin.Model,
    recording: Recording,
    cutoff_hz: float,
    reference_m: np.ndarray,
    instruments: Instruments | None = None,
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Filtered and decimated equations of some frames: regressor (n, 6, P) and measured wrench
    (n, 6) about the reference, and the accelerations' noise level (n,)."""
    stride = stride_to(recording.rate_hz, _OVERSAMPLING * cutoff_hz)
    operator, frames = lowpass_operator(recording.use, recording.rate_hz, cutoff_hz, stride)
    measured = operator @ np.where(
        recording.use[:, None], move_moments(recording.wrench, reference_m), 0.0
    )
    for start in range(0, operator.shape[0], _ROWS):
        rows: sparse.csr_array = operator[start : start + _ROWS]
        first, last = int(rows.indices.min()), int(rows.indices.max()) + 1
        part = slice(first, last)
        regressor = wrench_regressor(
            model, recording.q[part], recording.v[part], recording.a[part], reference_m
        )
        if instruments:
            columns = instruments.columns(regressor, recording.rate_hz)
            regressor = np.concatenate([regressor, columns], axis=2)
        filtered = rows[:, part] @ regressor.reshape(last - first, -1)
        mine = slice(start, start + _ROWS)
        level = recording.noise_level[frames[mine]]
        yield filtered.reshape(rows.shape[0], 6, -1), measured[mine], level


# --- how much each component of the wrench may be trusted: residual size, its shape, its memory ---

# What a fit leaves has two parts: one that is always there (sensors, the model), and one that grows
# with the noise of the accelerations, which is large where the motion is fast. Both are estimated
# from the residual itself.

_NOISE_ROUNDS = 8
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


def noise_of(series: list[Residual]) -> Noise:
    """Noise from what a fit leaves, one series per recording."""
    residual, level = map(np.concatenate, zip(*series, strict=True))
    # standard deviations, steady and per level, of likely Gaussian residuals
    terms = np.stack([np.ones_like(level), level**2], axis=1)
    scale = np.maximum(terms.mean(axis=0), 1e-300)
    terms, parts = terms / scale, np.empty((6, 2))
    for c in range(6):
        square = residual[:, c] ** 2
        mean = max(float(square.mean()), 1e-18)
        variance = np.full_like(square, mean)
        for _ in range(_NOISE_ROUNDS):
            parts[c], _ = nnls(terms / variance[:, None], square / variance)
            parts[c, 0] = max(parts[c, 0], _QUIETEST**2 * mean)
            variance = terms @ parts[c]
    steady, with_level = np.sqrt(parts / [1.0, scale[1]]).T
    spread = np.sqrt(_variances(steady, with_level, level))
    counts = [effective_samples(own) for own in (residual / spread).T]
    effective = np.clip(np.nan_to_num(counts, nan=1.0), 1.0, len(residual))
    rms = 1 / np.sqrt((1 / spread**2).mean(axis=0))
    return Noise(rms, effective, len(residual), steady, with_level)


def _variances(steady: np.ndarray, with_level: np.ndarray, level: np.ndarray) -> np.ndarray:
    return steady**2 + with_level**2 * level[:, None] ** 2


# --- the interface of the estimators and what they return -----------------------------------------


@dataclass(frozen=True)
class Problem:
    """Everything an estimator may use.

    The next three are options of [identify]: how many times worse the data are than they look; the
    sigma% below which a base parameter counts; and how many deviations as large as [prior] says
    count with this person's own. ``whole``: the equations before the wrench of segments that keep
    the table's values was taken off; None where no segment does. ``jointly``: the equations with
    the instruments' columns after the parameters.
    """

    equations: NormalEquations
    noise: Noise
    prior: Prior
    basis: Basis
    trust_ratio: float
    sigma_percent_limit: float = 5.0
    spread_weight: float = 4.0
    whole: NormalEquations | None = None
    jointly: NormalEquations | None = None

    def every_equation(self) -> NormalEquations:
        """Those of all segments' parameters."""
        return self.equations if self.whole is None else self.whole

    def trusted_equations(self) -> tuple[np.ndarray, np.ndarray]:
        """Information (P, P) and right side (P,), each component in its noise as it is trusted."""
        return self.equations.weighted(self.noise.weights() / self.trust_ratio**2)


@dataclass(frozen=True, eq=False)
class Estimate:
    """Parameters (P,) about the joint centres, their covariance (P, P), and a note for people.

    ``prior_covariance`` (P, P) where the estimator weighs the prior itself: what the data share is
    counted from. ``decided``: how many of the parameters the data decide, where that is known.
    """

    phi: np.ndarray
    covariance: np.ndarray
    note: str
    prior_covariance: np.ndarray | None = None
    decided: float = float("nan")

    def residual_rms(self, problem: Problem) -> np.ndarray:
        """(6,) residual [N, N m] that the estimate leaves in its own data."""
        return problem.every_equation().residual_rms(self.phi)
