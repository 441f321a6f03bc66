"""Skin markers of a trial: soft-tissue motion, noise, gaps."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter1d

from bsip_cli.simulate.landmarks import Marker, Swing, kind_of
from bsip_cli.simulate.numerics import response, rotate, transpose, unskew
from bsip_cli.simulate.options import Richness
from bsip_cli.simulate.people import Person
from bsip_cli.simulate.plan import Poses

LAG_SMOOTHING_S = 0.02
DRIFT_SMOOTHING_S = 0.3
GAP_FRAMES = (5, 40)
GAPS_PER_TRIAL = 1.5  # beyond the first one
GAPS_PER_SECOND = 0.12
LONGEST_GAP_SHARE = 0.15  # of a trial
# The bones whose turning against a marker's bone moves the skin over it; * is the marker's side.
NEIGHBOURS = {
    "lower_torso": ("thigh_l", "thigh_r"),
    "thorax": ("lower_torso", "head"),
    "head": ("thorax", "thorax"),
    "clavicle": ("thorax", "upper_arm*"),
    "upper_arm": ("thorax", "forearm*"),
    "forearm": ("upper_arm*", "hand*"),
    "hand": ("forearm*", "forearm*"),
    "thigh": ("lower_torso", "shank*"),
    "shank": ("thigh*", "foot*"),
    "foot": ("shank*", "shank*"),
}
MOVED_BY_THE_ARM = {"RAC": "upper_arm_r", "LAC": "upper_arm_l", "RSCAP": "upper_arm_r"}


def rigid_paths(person: Person, poses: Poses) -> dict[str, np.ndarray]:
    """(T, 3) path of every marker if it were fixed to its bone."""
    return {
        label: poses.point(marker.body, marker.position_m)
        for label, marker in person.markers.items()
    }


def marker_paths(
    person: Person, poses: Poses, rate_hz: float, richness: Richness, rng: np.random.Generator
) -> dict[str, np.ndarray]:
    """(T, 3) measured path of every marker; NaN where it is lost. Poses at the marker rate."""
    paths = rigid_paths(person, poses)
    for label, path in paths.items():
        marker = person.markers[label]
        if richness.soft_tissue:
            segment = "upper_torso" if marker.body == "thorax" else marker.body
            late = _late(marker, person.tissue.get(segment), path, rate_hz)
            path = path + _skin_travel(label, marker, poses) + late
        white = richness.marker_noise_m * rng.standard_normal(path.shape)
        width = DRIFT_SMOOTHING_S * rate_hz
        slow = gaussian_filter1d(rng.standard_normal(path.shape), width, axis=0, mode="reflect")
        # a Gaussian filter of width s leaves 1 / sqrt(2 s sqrt(pi)) of white noise's deviation
        gain = np.sqrt(2.0 * DRIFT_SMOOTHING_S * rate_hz * np.sqrt(np.pi))
        paths[label] = path + (white + richness.marker_drift_m * gain * slow)
    return _with_gaps(paths, rate_hz, rng) if richness.gaps else paths


def _skin_travel(label: str, marker: Marker, poses: Poses) -> np.ndarray:
    """(T, 3) travel of a marker over its bone, a smooth function of the nearby joints."""
    own, side = poses.rotation[marker.body], marker.body[-2:]
    first, second = (name.replace("*", side) for name in NEIGHBOURS[kind_of(marker.body)])
    bodies = (first, MOVED_BY_THE_ARM.get(label, second))
    turns = [unskew(transpose(own) @ poses.rotation[body]) for body in bodies]
    sines = np.concatenate(turns, axis=1)
    return rotate(own, np.hstack([sines, sines**2]) @ marker.skin_gain_m.T)


def _late(marker: Marker, swing: Swing | None, path: np.ndarray, rate_hz: float) -> np.ndarray:
    """(T, 3) soft tissue stays behind when the bone accelerates, or shares a swing driven by it."""
    if swing is None and len(path) < 5:
        return np.zeros_like(path)
    acceleration = np.gradient(np.gradient(path, 1.0 / rate_hz, axis=0), 1.0 / rate_hz, axis=0)
    if swing is None:
        width = LAG_SMOOTHING_S * rate_hz
        return -marker.lag_s2 * gaussian_filter1d(acceleration, width, axis=0, mode="nearest")
    w, z = 2.0 * np.pi * swing.frequency_hz, swing.damping_ratio
    denominator = [1.0, 2.0 * z * w, w * w]
    return marker.swing_share * response([-1.0], denominator, acceleration, 1.0 / rate_hz)


def _with_gaps(
    paths: dict[str, np.ndarray], rate_hz: float, rng: np.random.Generator
) -> dict[str, np.ndarray]:
    """Lose a few markers for a short while each."""
    labels = sorted(paths)
    frames = len(paths[labels[0]])
    longest = min(GAP_FRAMES[1], int(LONGEST_GAP_SHARE * frames))
    if longest <= GAP_FRAMES[0]:
        return paths
    count = 1 + rng.poisson(GAPS_PER_TRIAL + GAPS_PER_SECOND * frames / rate_hz)
    for label in rng.choice(labels, size=min(count, len(labels)), replace=False):
        length = int(rng.integers(GAP_FRAMES[0], longest + 1))
        start = int(rng.integers(0, frames - length))
        paths[label][start : start + length] = np.nan
    return paths
