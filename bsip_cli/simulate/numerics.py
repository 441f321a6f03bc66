"""Rotations, derivatives and smooth functions of time, out of which movements are made.

Shapes: times, angles (T,), vectors (T, 3), rotation matrices (T, 3, 3); times in s, angles in rad.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.polynomial.polynomial import polyint, polyval
from scipy.interpolate import make_interp_spline
from scipy.signal import cont2discrete, lfilter
from scipy.special import ndtr

CENTRAL_8 = (4 / 5, -1 / 5, 4 / 105, -1 / 280)  # weights of +1..+4 samples
HALF_WIDTH = 4
STEP = np.array([0, 0, 0, 0, 0, 126.0, -420.0, 540.0, -315.0, 70.0])
STEP_INTEGRAL = polyint(STEP)


# --- rotations ------------------------------------------------------------------------------------


def skew(vectors: np.ndarray) -> np.ndarray:
    """Cross-product matrices (..., 3, 3) of vectors (..., 3)."""
    x, y, z = np.moveaxis(np.asarray(vectors, dtype=float), -1, 0)
    zero = np.zeros_like(x)
    rows = [[zero, -z, y], [z, zero, -x], [-y, x, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def unskew(m: np.ndarray) -> np.ndarray:
    """Axis vectors (..., 3) of the antisymmetric part of matrices (..., 3, 3)."""
    entries = [m[..., i, j] - m[..., j, i] for i, j in ((2, 1), (0, 2), (1, 0))]
    return 0.5 * np.stack(entries, axis=-1)


def about_axis(axis: np.ndarray, angle_rad: np.ndarray) -> np.ndarray:
    """Rotations by angles about one fixed unit axis (3,) (Rodrigues)."""
    K = skew(axis)
    angle = np.asarray(angle_rad, dtype=float)[..., None, None]
    return np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * (K @ K)


about_x, about_y, about_z = (partial(about_axis, axis) for axis in np.eye(3))


def euler_zxy(angles_rad: np.ndarray) -> np.ndarray:
    """Rz(a) Rx(b) Ry(c) of angles (T, 3): flexion, side bending, axial rotation."""
    a, b, c = np.moveaxis(np.asarray(angles_rad, dtype=float), -1, 0)
    return about_z(a) @ about_x(b) @ about_y(c)


def from_rotation_vector(vectors_rad: np.ndarray) -> np.ndarray:
    """Rotations (..., 3, 3) of rotation vectors (..., 3)."""
    vectors = np.asarray(vectors_rad, dtype=float)
    angle = np.linalg.norm(vectors, axis=-1)[..., None, None]
    K = skew(vectors)
    first, second = np.sinc(angle / np.pi), 0.5 * np.sinc(angle / (2.0 * np.pi)) ** 2
    return np.eye(3) + first * K + second * (K @ K)


def transpose(matrices: np.ndarray) -> np.ndarray:
    """Of matrices (..., m, n): (..., n, m), a view."""
    return np.swapaxes(matrices, -1, -2)


def rotate(matrices: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Apply (T, 3, 3) to vectors (T, 3) or to one vector (3,)."""
    return np.einsum("...ij,...j->...i", matrices, vectors)


def frame_of(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Right-handed frames (..., 3, 3): column 0 along `first`, column 2 near `second`."""
    x = first / np.linalg.norm(first, axis=-1, keepdims=True)
    z = second - np.sum(second * x, axis=-1, keepdims=True) * x
    z = z / np.linalg.norm(z, axis=-1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], axis=-1)


# --- over time ------------------------------------------------------------------------------------


def derivative(values: np.ndarray, step_s: float) -> np.ndarray:
    """First derivative along axis 0: eighth-order central differences.

    The four samples at either end use second-order differences; callers simulate a margin.
    """
    values, w = np.asarray(values, dtype=float), HALF_WIDTH
    slope = np.gradient(values, step_s, axis=0)
    n = len(values)
    if n <= 2 * w:
        return slope
    inner = np.zeros_like(values[w : n - w])
    for k, weight in enumerate(CENTRAL_8, start=1):
        inner += weight * (values[w + k : n - w + k] - values[w - k : n - w - k])
    slope[w : n - w] = inner / step_s
    return slope


def second_derivative(values: np.ndarray, step_s: float) -> np.ndarray:
    """`derivative` twice."""
    return derivative(derivative(values, step_s), step_s)


def integral(values: np.ndarray, step_s: float) -> np.ndarray:
    """Integral along axis 0 from the first sample (quintic spline)."""
    t = np.arange(len(values)) * step_s
    return make_interp_spline(t, values, k=5).antiderivative()(t)


def swung(
    frequency_hz: float, damping_ratio: float, acceleration: np.ndarray, step_s: float
) -> tuple[np.ndarray, np.ndarray]:
    """Of a mass that hangs on a spring and a damper at a point with this acceleration (T, 3),
    linear between samples: its displacement (T, 3) against the point, and its own acceleration.

    The displacement u obeys u'' + 2 z w u' + w^2 u = -r'' from rest.
    """
    w, z = 2.0 * np.pi * frequency_hz, damping_ratio
    found = []
    for numerator in ([-1.0], [2.0 * z * w, w * w]):
        system = numerator, [1.0, 2.0 * z * w, w * w]
        b, a, _ = cont2discrete(system, step_s, method="foh")
        found.append(lfilter(np.ravel(b), a, acceleration, axis=0))
    return found[0], found[1]


def runs(mask: np.ndarray) -> list[slice]:
    """The intervals of samples where the mask (T,) holds."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(int), [0]])))
    return [slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def bridge(start: np.ndarray, end: np.ndarray, duration_s: float, t_s: np.ndarray) -> np.ndarray:
    """(T,) septic polynomial, at times since its start, from one state to another after duration_s.

    start, end : (4,) value, first, second and third derivative.
    """
    scale = duration_s ** np.arange(4)[:, None]
    a, b = start[:, None] * scale, end[:, None] * scale
    low = a / np.array([1.0, 1.0, 2.0, 6.0])[:, None]
    n = np.arange(4, 8)
    at_one = np.stack([np.ones(4), n, n * (n - 1), n * (n - 1) * (n - 2)])
    of_low = np.array([[1, 1, 1, 1], [0, 1, 2, 3], [0, 0, 2, 6], [0, 0, 0, 6]], dtype=float)
    high = np.linalg.solve(at_one, b - of_low @ low)
    return polyval(np.asarray(t_s) / duration_s, np.vstack([low, high])[:, 0])


# --- curves ---------------------------------------------------------------------------------------


def step(t_s: np.ndarray, start_s: float, end_s: float) -> np.ndarray:
    """0 before start, 1 after end, four continuous derivatives between."""
    return polyval(np.clip((t_s - start_s) / (end_s - start_s), 0.0, 1.0), STEP)


def window(t_s: np.ndarray, start_s: float, end_s: float, ramp_s: float) -> np.ndarray:
    """0 outside, 1 inside, with smooth ramps of ramp_s at both ends."""
    ramp = min(ramp_s, 0.5 * (end_s - start_s))
    return step(t_s, start_s, start_s + ramp) - step(t_s, end_s - ramp, end_s)


def glide(
    t_s: np.ndarray, start_s: float, end_s: float, rise_s: float, fall_s: float | None = None
) -> np.ndarray:
    """0 to 1 at constant speed, with a smooth starting and a smooth stopping ramp."""

    def travel(since_s: np.ndarray, ramp_s: float) -> np.ndarray:  # the integral of a `step`
        inside = ramp_s * polyval(np.clip(since_s / ramp_s, 0.0, 1.0), STEP_INTEGRAL)
        return inside + np.maximum(since_s - ramp_s, 0.0)

    fall_s = rise_s if fall_s is None else fall_s
    travelled = travel(t_s - start_s, rise_s) - travel(t_s - (end_s - fall_s), fall_s)
    return travelled / (end_s - start_s - 0.5 * (rise_s + fall_s))


def soft_polyline(
    t_s: np.ndarray, times_s: np.ndarray, values: np.ndarray, softness_s: float
) -> np.ndarray:
    """Straight lines between key frames, convolved with a Gaussian of sd softness_s.

    Constant outside the key frames. Infinitely smooth and without overshoot.
    """
    slopes = np.diff(values) / np.diff(times_s)
    result = np.full(np.shape(t_s), values[0])
    for time, bend in zip(times_s, np.diff(slopes, prepend=0.0, append=0.0), strict=True):
        x = (t_s - time) / softness_s
        density = np.exp(-0.5 * x**2) / np.sqrt(2.0 * np.pi)
        result = result + bend * softness_s * (x * ndtr(x) + density)
    return result


def slow_drift(
    t_s: np.ndarray, rng: np.random.Generator, size: float, lowest_hz: float, highest_hz: float
) -> np.ndarray:
    """Random slow signal of standard deviation `size`: a sum of eight sinusoids."""
    frequencies = np.exp(rng.uniform(np.log(lowest_hz), np.log(highest_hz), 8))
    phases = rng.uniform(0.0, 2.0 * np.pi, 8)
    waves = np.sin(2.0 * np.pi * frequencies * np.asarray(t_s)[:, None] + phases)
    return size * waves.sum(axis=1) / 2.0
