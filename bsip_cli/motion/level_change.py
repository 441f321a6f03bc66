"""One change of level in an autocorrelated signal that also follows known columns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_ROUNDS = 4
_LARGEST_CORRELATION = 0.98
# Columns are angles [rad]: skin travels some 30 mm a radian, so 0.3 mm for this.
_MOVING = 0.01


@dataclass(frozen=True)
class LevelChange:
    """The most likely change of level of a signal.

    Attributes
    ----------
    at : index of the first sample at the new level.
    step : (d,) new level less old one, in the signal's unit.
    step_sd : standard deviation of the step, each direction.
    spread : standard deviation of what neither columns nor step explain, each direction.
    z : how unlikely the gain in likelihood is by chance at one place: the length of a normal
        vector of d directions that is as unlikely (so it counts the samples, which F does).
    """

    at: int
    step: np.ndarray
    step_sd: float
    spread: float
    z: float


def find_level_change(
    y: np.ndarray, columns: np.ndarray, least: int, at: int | None = None
) -> LevelChange | None:
    """Generalised least squares of y (n, d) on a constant, columns (n, k) and one step.

    The error is autoregressive of order one; its correlation is estimated with the step in the
    model, or a step would look like correlation. A step that the columns could make as well gets
    a large standard deviation and no significance.

    Parameters
    ----------
    least : samples at least on each side of the step.
    at : where the step is, or None to look for the place with the largest gain.

    Returns
    -------
    None where there are too few samples for the columns.
    """
    n, d = y.shape
    X = np.concatenate([np.ones((n, 1)), _scaled(columns)], axis=1)
    places = np.arange(least, n - least + 1) if at is None else np.array([at])
    places = places[(places > 0) & (places < n)]
    if len(places) == 0 or n - X.shape[1] - 2 < max(10, n // 4):
        return None
    correlation, found = 0.0, None
    for _ in range(_ROUNDS):
        found = _best(y, X, places, correlation)
        if found is None:
            return None
        correlation = _correlation(y, X, found.at, found.step)
    return _best(y, X, places, correlation)


def _best(
    y: np.ndarray, X: np.ndarray, places: np.ndarray, correlation: float
) -> LevelChange | None:
    n, d = y.shape
    Q, _ = np.linalg.qr(_whitened(X, correlation))
    white = _whitened(y, correlation)
    free = white - Q @ (Q.T @ white)
    # A step whitened is 1 at its place and 1 - correlation after it.
    rest = (1.0 - correlation) * _after(free) + free
    shadow = (1.0 - correlation) * _after(Q) + Q
    length = 1.0 + (1.0 - correlation) ** 2 * (n - 1 - np.arange(n))
    own = length - (shadow**2).sum(axis=1)
    usable = own[places] > 1e-3 * length[places]
    if not usable.any():
        return None
    places = places[usable]
    gain = (rest[places] ** 2).sum(axis=1) / own[places]
    best = int(np.argmax(gain))
    freedom = d * (n - Q.shape[1] - 1)
    variance = max(((free**2).sum() - gain[best]) / freedom, 1e-18)
    k = int(places[best])
    return LevelChange(
        k,
        rest[k] / own[k],
        float(np.sqrt(variance / own[k])),
        float(np.sqrt(variance / (1.0 - correlation**2))),
        _as_normal(float(gain[best] / variance), d, freedom),
    )


def _as_normal(gain: float, d: int, freedom: int) -> float:
    from scipy.stats import chi2, f

    return float(np.sqrt(chi2.isf(max(f.sf(gain / d, d, freedom), 1e-300), d)))


def _correlation(y: np.ndarray, X: np.ndarray, at: int, step: np.ndarray) -> float:
    stepped = y - (np.arange(len(y)) >= at)[:, None] * step
    Q, _ = np.linalg.qr(X)
    left = stepped - Q @ (Q.T @ stepped)
    power = float((left[:-1] ** 2).sum())
    value = float((left[1:] * left[:-1]).sum()) / power if power > 0 else 0.0
    return float(np.clip(value, 0.0, _LARGEST_CORRELATION))


def _whitened(x: np.ndarray, correlation: float) -> np.ndarray:
    white = x.copy()
    white[1:] -= correlation * x[:-1]
    white[0] *= np.sqrt(1.0 - correlation**2)
    return white


def _after(x: np.ndarray) -> np.ndarray:
    """Sum of all later rows, for each row."""
    total = np.cumsum(x[::-1], axis=0)[::-1]
    return total - x


def _scaled(columns: np.ndarray) -> np.ndarray:
    """Columns about their mean, with unit spread; those that stand still are left out."""
    centred = columns - columns.mean(axis=0)
    spread = centred.std(axis=0)
    moving = spread > _MOVING
    return centred[:, moving] / spread[moving]
