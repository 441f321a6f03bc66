"""Velocities and accelerations from poses, on the manifold of the joint angles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, sosfiltfilt

from bsip_cli.body.skeleton import Skeleton
from bsip_cli.errors import BadDataError
from bsip_cli.motion.splines import SmoothSignal, smooth

# Winter: a dual-pass second-order filter has its -3 dB point lower by this factor.
_DUAL_PASS = 0.802


@dataclass(frozen=True)
class Motion:
    """q (N, nq), v (N, nv), a (N, nv) in Pinocchio's conventions, and the noise of a (N, nv)."""

    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    a_sd: np.ndarray


def smooth_motion(
    skeleton: Skeleton, q: np.ndarray, determined: np.ndarray, rate_hz: float, *, method: str,
    butterworth_cutoff_hz: float, pace_window_s: float,
) -> Motion:
    """Smooth poses and differentiate them twice.

    Quaternions are smoothed as curves in four dimensions and brought back to the unit sphere, so
    no orientation is singular; velocities follow from the curve's own derivatives.

    Parameters
    ----------
    q : (N, nq) poses; those not ``determined`` (N,) are bridged.
    method, butterworth_cutoff_hz, pace_window_s : as in configs/default.toml, [smoothing].

    Raises
    ------
    BadDataError
        Too few frames are determined.
    """
    if determined.sum() < 12:
        raise BadDataError(
            f"{int(determined.sum())} frames with a pose", expected="at least 12 to differentiate",
            remedy="check the markers of this trial",
        )
    curves = np.where(determined[:, None], _continuous(skeleton, q), np.nan)
    if method == "spline":
        smoothed = smooth(curves, rate_hz, pace_window_s)
    else:
        smoothed = _butterworth(curves, rate_hz, butterworth_cutoff_hz)
    return _on_manifold(skeleton, smoothed)


def _continuous(skeleton: Skeleton, q: np.ndarray) -> np.ndarray:
    """q with the quaternions' signs chosen so that they do not jump."""
    out = q.copy()
    for at in _quaternions(skeleton):
        x = out[:, at : at + 4]
        signs = np.sign(np.einsum("fi,fi->f", x[1:], x[:-1]))
        x[1:] *= np.cumprod(np.where(signs == 0, 1.0, signs))[:, None]
    return out


def _quaternions(skeleton: Skeleton) -> list[int]:
    offset = {"free": 3, "spherical": 0}
    return [
        start + offset[kind]
        for start, kind in zip(skeleton.q_starts, skeleton.joint_types, strict=True)
        if kind in offset
    ]


def _butterworth(curves: np.ndarray, rate_hz: float, cutoff_hz: float) -> SmoothSignal:
    """Zero-phase second-order Butterworth and central differences (Winter 2009, chapter 3)."""
    times = np.arange(len(curves))
    bridged = np.empty_like(curves)
    for k in range(curves.shape[1]):
        seen = np.isfinite(curves[:, k])
        bridged[:, k] = np.interp(times, times[seen], curves[seen, k])
    corner = min(cutoff_hz / _DUAL_PASS, 0.45 * rate_hz)
    sections = butter(2, corner, fs=rate_hz, output="sos")
    value = sosfiltfilt(sections, bridged, axis=0, padlen=min(len(curves) - 1, int(rate_hz)))
    first = np.gradient(value, 1 / rate_hz, axis=0)
    second = np.gradient(first, 1 / rate_hz, axis=0)
    noise = np.std(bridged - value, axis=0) * (2 * np.pi * cutoff_hz) ** 2 / np.sqrt(5)
    return SmoothSignal(value, first, second, np.broadcast_to(noise, value.shape).copy())


def _on_manifold(skeleton: Skeleton, s: SmoothSignal) -> Motion:
    frames = len(s.value)
    nv = len(skeleton.v_names)
    q = s.value.copy()
    v, a, sd = (np.zeros((frames, nv)) for _ in range(3))
    for at, av, kind in zip(
        skeleton.q_starts, skeleton.v_starts, skeleton.joint_types, strict=True
    ):
        if kind == "revolute":
            v[:, av], a[:, av], sd[:, av] = s.first[:, at], s.second[:, at], s.second_sd[:, at]
            continue
        turning = slice(av + 3, av + 6) if kind == "free" else slice(av, av + 3)
        quaternion = slice(at + 3, at + 7) if kind == "free" else slice(at, at + 4)
        unit, v[:, turning], a[:, turning], sd[:, turning] = _angular(s, quaternion)
        q[:, quaternion] = unit
        if kind == "free":
            v[:, av : av + 3], a[:, av : av + 3], sd[:, av : av + 3] = _linear(
                s, slice(at, at + 3), unit, v[:, turning]
            )
    return Motion(q, v, a, sd)


def _angular(s: SmoothSignal, part: slice):
    """Unit quaternion, angular velocity and acceleration in body axes, and the latter's noise.

    With x the unnormalised curve and n = |x|^2: omega = 2 Im(x* x') / n and
    omega' = 2 Im(x* x'') / n - omega n' / n.
    """
    x, dx, ddx = s.value[:, part], s.first[:, part], s.second[:, part]
    n = np.einsum("fi,fi->f", x, x)[:, None]
    omega = 2 * _imaginary(x, dx) / n
    rate = 2 * np.einsum("fi,fi->f", x, dx)[:, None] / n
    alpha = 2 * _imaginary(x, ddx) / n - omega * rate
    noise = 2 * np.sqrt((s.second_sd[:, part] ** 2).mean(axis=1, keepdims=True))
    return x / np.sqrt(n), omega, alpha, np.broadcast_to(noise, omega.shape)


def _imaginary(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """(N, 3) vector part of conj(x) * y; quaternions as x, y, z, w."""
    u, w, p, r = x[:, :3], x[:, 3:], y[:, :3], y[:, 3:]
    return w * p - r * u - np.cross(u, p)


def _linear(s: SmoothSignal, part: slice, quaternion: np.ndarray, omega: np.ndarray):
    """Velocity and acceleration of the base in its own axes (Pinocchio's spatial ones)."""
    velocity = _into_body(quaternion, s.first[:, part])
    acceleration = _into_body(quaternion, s.second[:, part]) - np.cross(omega, velocity)
    return velocity, acceleration, s.second_sd[:, part]


def _into_body(quaternion: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    u, w = -quaternion[:, :3], quaternion[:, 3:]
    t = 2 * np.cross(u, vectors)
    return vectors + w * t + np.cross(u, t)
