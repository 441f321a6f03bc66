"""What the benchmarks share: a person who moves."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pinocchio as pin

from benchmarks.measure import ROOT
from bsip_cli.body.markersets import load_marker_set
from bsip_cli.body.person import Person
from bsip_cli.body.skeleton import load_skeleton
from bsip_cli.dynamics.ground_wrench import pinocchio_model
from bsip_cli.motion.calibration import calibrate
from bsip_cli.motion.inverse_kinematics import neutral, posed
from bsip_cli.recordings.read import read_recording

_STATIC = ROOT / "sample_data" / "sub-01" / "sub-01_task-static.c3d"
_HEIGHT_M = 1.77
_FREQUENCIES_HZ = np.array([0.3, 0.7, 1.1])
_TILT_RAD = 0.08


@cache
def sample_person() -> Person:
    """The first person of the sample study, from the static trial; all markers weigh the same.

    The hinges lean a little, so that nothing is easier than in a refined skeleton.
    """
    recording = read_recording(_STATIC)
    places = dict(zip(recording.labels, np.nanmean(recording.markers_m, axis=0), strict=True))
    skeleton = load_skeleton("hansen2017")
    person = calibrate(skeleton, load_marker_set("hansen2017"), places, "M", _HEIGHT_M).person
    hinges = np.array([kind == "revolute" for kind in skeleton.joint_types])
    lean = np.random.default_rng(1).normal(0, _TILT_RAD, (2, len(hinges)))
    return replace(
        person,
        parent_tilt_rad=np.where(hinges, lean[0], 0.0),
        child_tilt_rad=np.where(hinges, lean[1], 0.0),
        marker_weights=np.ones(len(person.markers)),
    )


def standing(person: Person) -> np.ndarray:
    """(nq,) upright, facing world X, elbows and knees a little bent."""
    q = neutral(person)
    q[2] = 1.0
    q[3:7] = np.array([1.0, 0.0, 0.0, 1.0]) / np.sqrt(2)  # the segments' Y axes point up
    for start, kind, joint in zip(
        person.skeleton.q_starts, person.skeleton.joint_types, person.skeleton.joints, strict=True
    ):
        if kind == "revolute":
            q[start] = 0.6 if joint.startswith("elbow") else -0.4
    return q


def movement(
    person: Person, frames: int, rate_hz: float, seed: int = 1, amplitude_rad: float = 0.4
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Sums of sines in all coordinates about standing: q (N, nq) and their rates (N, nv), twice.

    The base translates by a third of the amplitude [m]. The rates are those of the coordinates on
    the manifold: Pinocchio's v and a up to second order in the angles, which no benchmark needs.
    """
    model, rng = pinocchio_model(person), np.random.default_rng(seed)
    shape = (len(_FREQUENCIES_HZ), model.nv)
    omega = 2 * np.pi * _FREQUENCIES_HZ[:, None] * rng.uniform(0.8, 1.2, shape)
    size = amplitude_rad / len(_FREQUENCIES_HZ) * rng.uniform(0.5, 1.5, shape)
    size[:, :3] /= 3
    phase = omega * (np.arange(frames) / rate_hz)[:, None, None] + rng.uniform(0, 2 * np.pi, shape)
    x, v, a = (
        (size * omega**order * np.sin(phase + order * np.pi / 2)).sum(axis=1) for order in range(3)
    )
    start = standing(person)
    return np.stack([pin.integrate(model, start, one) for one in x]), v, a


def noisy_markers(person: Person, q: np.ndarray, noise_m: float, seed: int = 2) -> np.ndarray:
    """(N, m, 3) markers of the poses with white noise per axis."""
    markers = posed(person, q).markers_m
    return markers + np.random.default_rng(seed).normal(0, noise_m, markers.shape)
