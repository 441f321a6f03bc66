"""Velocities and accelerations from poses, on the manifold of the joint angles."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import binary_erosion
from scipy.signal import butter, sosfiltfilt, welch

from bsip_cli.body.person import Person
from bsip_cli.body.skeleton import Skeleton
from bsip_cli.errors import BadDataError
from bsip_cli.motion.inverse_kinematics import coordinate_covariance, marker_trust, posed
from bsip_cli.motion.splines import SkinNoise, SmoothSignal, bridged, noise_level, smooth

# --- how much the skin swings against the bones, from the residuals of the inverse kinematics -----

# In recordings of two labs the residuals' power falls like 1 / f^4 from 2 Hz to where white noise
# begins, as if the skin were shaken by white accelerations; in a third lab's it falls more slowly.


# Where residuals show the skin: above the misfit of the model itself, below the white noise.
_BAND_HZ, _WINDOW_S = (2.0, 10.0), 1.28
_SEEN_SHARE = 0.5  # of the frames with a pose, for a marker to count


def skin_corner_hz(
    person: Person,
    q: np.ndarray,
    markers: np.ndarray,
    rate_hz: float,
    *,
    white_m: float,
    robust_limit_m: float,
) -> float:
    """Frequency [Hz] below which the residuals' coloured part is larger than the white noise.

    0 where there are too few markers to leave residuals.

    q : (N, nq) poses.
    markers : (N, m, 3) where they were seen [m]; NaN where not.
    white_m : the markers' white noise, each direction.
    robust_limit_m : beyond it a marker's pull on the poses fades.
    """
    residuals = posed(person, q).residuals(markers)
    trust, seen = marker_trust(residuals, robust_limit_m), np.isfinite(residuals[..., 0])
    pull = residuals * trust[..., None] / trust[seen].mean()  # as the poses feel them
    pull = pull[:, seen.sum(axis=0) > _SEEN_SHARE * seen.any(axis=1).sum()]
    coordinates = 3 * pull.shape[1]
    free = coordinates - len(person.skeleton.v_names)
    if free <= 0:
        return 0.0
    channels = bridged(pull.reshape(len(pull), coordinates))
    window = min(round(_WINDOW_S * rate_hz), len(channels))
    f, power = welch(channels, rate_hz, nperseg=window, axis=0, detrend="linear")
    power = power.sum(axis=1) / free * 0.5 * rate_hz  # as if white, of one direction
    band = (f >= _BAND_HZ[0]) & (f <= min(_BAND_HZ[1], 0.4 * rate_hz))
    band[1 + np.argmin(np.abs(f[1:] - np.mean(_BAND_HZ)))] = True  # none inside if short
    level = np.median(f[band] ** 4 * np.maximum(power[band] - white_m**2, 0.0))
    return float((level / white_m**2) ** 0.25)


# Winter: a dual-pass second-order filter has its -3 dB point lower by this factor.
_DUAL_PASS = 0.802
_NOISE_FRAMES = 12
# An angle that errs by more per metre of marker error is held by the prior, not by markers.
_LOOSE, _WEAK_PRIOR = 60.0, 200.0  # rad/m


@dataclass(frozen=True, eq=False)
class Motion:
    """q (N, nq), v (N, nv), a (N, nv) in Pinocchio's conventions, and the noise of a (N, nv).

    ``inner`` (N,) is False in gaps and near their and the trial's ends, where an acceleration
    rests on one side only; ``marker_noise_m`` is the white noise of the markers that the poses
    show; ``cutoff_hz`` (N,) is where the smoother's gain is one half.
    """

    q: np.ndarray
    v: np.ndarray
    a: np.ndarray
    a_sd: np.ndarray
    inner: np.ndarray
    marker_noise_m: float
    cutoff_hz: np.ndarray


def smooth_motion(
    person: Person,
    q: np.ndarray,
    determined: np.ndarray,
    rate_hz: float,
    *,
    markers: np.ndarray,
    robust_limit_m: float,
    method: str,
    butterworth_cutoff_hz: float,
    pace_window_s: float,
    skin_factor: float,
    skin_from_hz: float,
    edge_s: float,
) -> Motion:
    """Smooth poses and differentiate them twice.

    Quaternions are smoothed as curves in four dimensions and brought back to the unit sphere, so
    no orientation is singular; velocities follow from the curve's own derivatives.

    q : (N, nq) poses.
    determined : (N,), or (N, joints): which are to be believed; the others are bridged.
    markers : (N, m, 3) where they were seen [m]; NaN where not.
    robust_limit_m : beyond it a marker's pull on the poses fades.
    method, butterworth_cutoff_hz, pace_window_s, skin_factor, skin_from_hz, edge_s : as in
        configs/default.toml, [smoothing].

    BadDataError: too few frames are determined.
    """
    skeleton = person.skeleton
    known = determined.reshape(len(q), -1) & np.ones(len(skeleton.joints), dtype=bool)
    whole = np.asarray(known.all(axis=1))
    if whole.sum() < 12:
        is_short = len(q) < 12
        raise BadDataError(
            f"{int(whole.sum())} of {len(q)} frames with a pose",
            expected="at least 12 to differentiate",
            remedy="leave so short a trial out" if is_short else "check the markers of this trial",
        )
    joint_of_curve = np.repeat(
        np.arange(len(skeleton.joints)), np.diff([*skeleton.q_starts, q.shape[1]])
    )
    smooth_q = q.copy()
    for part in _quaternions(skeleton):  # signs chosen so that they do not jump
        x = smooth_q[:, part]
        signs = np.sign(np.einsum("fi,fi->f", x[1:], x[:-1]))
        x[1:] *= np.cumprod(np.where(signs == 0, 1.0, signs))[:, None]
    curves = np.where(known[:, joint_of_curve], smooth_q, np.nan)
    marker_noise, noise = _noise(person, curves, whole, rate_hz)
    if method == "spline":
        pose_known = np.where(whole[:, None, None], markers, np.nan)
        shown = skin_corner_hz(
            person, q, pose_known, rate_hz, white_m=marker_noise, robust_limit_m=robust_limit_m
        )
        # Power that falls like 1 / f^4: the corner goes with the root of the amplitude.
        skin = SkinNoise(np.sqrt(skin_factor) * shown, skin_from_hz)
        smoothed = smooth(curves, rate_hz, pace_window_s, noise, skin)
    else:
        smoothed = _butterworth(curves, rate_hz, butterworth_cutoff_hz, noise)
    edge = round(edge_s * rate_hz)
    inner = np.asarray(binary_erosion(whole, np.ones(2 * edge + 1)) if edge else whole)
    return _on_manifold(skeleton, smoothed, inner, marker_noise)


def _noise(
    person: Person, curves: np.ndarray, determined: np.ndarray, rate_hz: float
) -> tuple[float, np.ndarray]:
    """Noise of the markers [m], and of each curve (nq,) if all of it comes from them.

    One number for all: a joint that moves fast has power where noise is looked for, the median
    over the joints has not.
    """
    skeleton = person.skeleton
    frames = np.flatnonzero(determined)
    some = curves[frames[np.linspace(0, len(frames) - 1, _NOISE_FRAMES).astype(int)]]
    for part in _quaternions(skeleton):
        some[:, part] /= np.linalg.norm(some[:, part], axis=1, keepdims=True)
    unit = coordinate_covariance(person, some, _WEAK_PRIOR).mean(axis=0)
    seen = noise_level(curves, rate_hz)
    blocks, variance = list(_blocks(skeleton)), np.diag(unit)
    spread = [np.sqrt(variance[turning].sum() / count) / k for _, turning, count, k in blocks]
    predicted = np.array(spread)
    found = np.array([np.sqrt((seen[part] ** 2).mean()) for part, *_ in blocks])
    known = predicted < _LOOSE
    marker_noise = float(np.median(found[known] / predicted[known]))
    noise = np.empty(len(seen))
    for (part, *_), value in zip(blocks, predicted, strict=True):
        noise[part] = marker_noise * min(value, _LOOSE)
    return marker_noise, noise


def _blocks(skeleton: Skeleton) -> Iterator[tuple[slice, slice, int, float]]:
    """Curves and velocities of each joint part, over how many curves the error spreads, and by
    what it shrinks (a rotation moves the four parts of a quaternion by half of its angle)."""
    for at, av, kind in zip(
        skeleton.q_starts, skeleton.v_starts, skeleton.joint_types, strict=True
    ):
        if kind == "free":
            yield slice(at + 3, at + 7), slice(av + 3, av + 6), 4, 2.0
            yield slice(at, at + 3), slice(av, av + 3), 3, 1.0
        elif kind == "spherical":
            yield slice(at, at + 4), slice(av, av + 3), 4, 2.0
        else:
            yield slice(at, at + 1), slice(av, av + 1), 1, 1.0


def _quaternions(skeleton: Skeleton) -> list[slice]:
    return [part for part, _, count, _ in _blocks(skeleton) if count == 4]


def _butterworth(
    curves: np.ndarray, rate_hz: float, cutoff_hz: float, noise: np.ndarray
) -> SmoothSignal:
    """Zero-phase second-order Butterworth and central differences (Winter 2009, chapter 3)."""
    corner = min(cutoff_hz / _DUAL_PASS, 0.45 * rate_hz)
    sections = butter(2, corner, fs=rate_hz, output="sos")
    value = sosfiltfilt(
        sections, bridged(curves), axis=0, padlen=min(len(curves) - 1, int(rate_hz))
    )
    first = np.gradient(value, 1 / rate_hz, axis=0)
    second = np.gradient(first, 1 / rate_hz, axis=0)
    # White noise below the cut-off, differentiated twice: the integral of omega^4 up to there.
    sd = noise * np.sqrt(2 * cutoff_hz / rate_hz / 5) * (2 * np.pi * cutoff_hz) ** 2
    spread = np.broadcast_to(sd, value.shape).copy()
    # Each pass halves the power at its corner, so both together halve the amplitude there.
    return SmoothSignal(value, first, second, spread, np.full(len(value), corner))


def _on_manifold(
    skeleton: Skeleton, s: SmoothSignal, inner: np.ndarray, marker_noise_m: float
) -> Motion:
    frames = len(s.value)
    nv = len(skeleton.v_names)
    q = s.value.copy()
    v, a, sd = (np.zeros((frames, nv)) for _ in range(3))
    for part, turning, count, _ in _blocks(skeleton):
        if count == 1:
            found = [s.first[:, part], s.second[:, part], s.second_sd[:, part]]
        elif count == 4:
            q[:, part], *found = _angular(s, part)
        else:  # of the base, whose turning is there already
            # velocity and acceleration in its own axes (Pinocchio's spatial ones)
            u, w = -q[:, part.stop : part.stop + 3], q[:, part.stop + 3 : part.stop + 4]
            omega, in_body = v[:, turning.stop : turning.stop + 3], []
            for vectors in (s.first[:, part], s.second[:, part]):
                t = 2 * np.cross(u, vectors)
                in_body.append(vectors + w * t + np.cross(u, t))
            found = [in_body[0], in_body[1] - np.cross(omega, in_body[0]), s.second_sd[:, part]]
        v[:, turning], a[:, turning], sd[:, turning] = found
    return Motion(q, v, a, sd, inner, marker_noise_m, s.cutoff_hz)


def _angular(s: SmoothSignal, part: slice) -> tuple[np.ndarray, ...]:
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
