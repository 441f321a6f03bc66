"""Smooth functions of time out of which movements are made. All take times (T,) in s."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr

_STEP = np.array([0, 0, 0, 0, 0, 126.0, -420.0, 540.0, -315.0, 70.0])
_STEP_INTEGRAL = np.polynomial.polynomial.polyint(_STEP)


def step(t_s: np.ndarray, start_s: float, end_s: float) -> np.ndarray:
    """0 before start, 1 after end, four continuous derivatives between."""
    s = np.clip((t_s - start_s) / (end_s - start_s), 0.0, 1.0)
    return np.polynomial.polynomial.polyval(s, _STEP)


def window(t_s: np.ndarray, start_s: float, end_s: float, ramp_s: float) -> np.ndarray:
    """0 outside, 1 inside, with smooth ramps of ramp_s at both ends."""
    ramp = min(ramp_s, 0.5 * (end_s - start_s))
    return step(t_s, start_s, start_s + ramp) - step(t_s, end_s - ramp, end_s)


def _ramp(t_s: np.ndarray, start_s: float, rise_s: float) -> np.ndarray:
    """Integral of `step`: 0 before start, slope 1 after start + rise."""
    s = np.clip((t_s - start_s) / rise_s, 0.0, 1.0)
    inside = rise_s * np.polynomial.polynomial.polyval(s, _STEP_INTEGRAL)
    return inside + np.maximum(t_s - start_s - rise_s, 0.0)


def glide(
    t_s: np.ndarray, start_s: float, end_s: float, rise_s: float, fall_s: float | None = None
) -> np.ndarray:
    """0 to 1 at constant speed, with a smooth starting and a smooth stopping ramp."""
    fall_s = rise_s if fall_s is None else fall_s
    travelled = _ramp(t_s, start_s, rise_s) - _ramp(t_s, end_s - fall_s, fall_s)
    return travelled / (end_s - start_s - 0.5 * (rise_s + fall_s))


def soft_polyline(
    t_s: np.ndarray, times_s: np.ndarray, values: np.ndarray, softness_s: float
) -> np.ndarray:
    """Straight lines between key frames, convolved with a Gaussian of sd softness_s.

    Constant outside the key frames. Infinitely smooth and without overshoot.
    """
    times, values = np.asarray(times_s, dtype=float), np.asarray(values, dtype=float)
    slopes = np.diff(values) / np.diff(times)
    bends = np.diff(np.concatenate([[0.0], slopes, [0.0]]))
    result = np.full(np.shape(t_s), values[0])
    for time, bend in zip(times, bends, strict=True):
        x = (t_s - time) / softness_s
        density = np.exp(-0.5 * x**2) / np.sqrt(2.0 * np.pi)
        result = result + bend * softness_s * (x * ndtr(x) + density)
    return result


def wander(
    t_s: np.ndarray, rng: np.random.Generator, size: float, lowest_hz: float, highest_hz: float
) -> np.ndarray:
    """Random slow signal of standard deviation `size`: a sum of eight sinusoids."""
    frequencies = np.exp(rng.uniform(np.log(lowest_hz), np.log(highest_hz), 8))
    phases = rng.uniform(0.0, 2.0 * np.pi, 8)
    waves = np.sin(2.0 * np.pi * frequencies * np.asarray(t_s)[:, None] + phases)
    return size * waves.sum(axis=1) / 2.0
