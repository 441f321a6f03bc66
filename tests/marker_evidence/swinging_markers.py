"""Markers of a person who swings all joints, with noise and skin that follows the joints."""

from __future__ import annotations

from functools import cache

import numpy as np

from bsip_cli.dynamics.ground_wrench import pinocchio_model
from bsip_cli.motion.inverse_kinematics import solve_trial
from bsip_cli.motion.marker_evidence import Evidence, marker_evidence
from bsip_cli.motion.marker_fit import MarkerFit, marker_fit
from tests.body.standing_person import Swing, joint_frames, markers_of, standing

PERSON = standing().person
RATE_HZ, DURATION_S = 50.0, 8.0
SCALES = {"marker_sd_m": 0.005, "robust_limit_m": 0.025}
NOISE_M = 0.0003
MARKERS = list(PERSON.markers)


@cache
def recording(seed: int, skin_m: float = 0.015) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times (N,), markers (N, m, 3) and the orientation of each marker's segment (N, m, 3, 3).

    Skin travels up to ``skin_m`` with the tanh and the cosine of the angles about its segment:
    not the law that the search takes out.
    """
    rng = np.random.default_rng(seed)
    swing = Swing(pinocchio_model(PERSON), standing().q, seed, amplitude=0.6)
    times = np.arange(round(DURATION_S * RATE_HZ)) / RATE_HZ
    q = np.stack([swing.q(t) for t in times])
    x = np.stack([swing._x(t, 0) for t in times])
    turns = joint_frames(PERSON, q)[0][:, PERSON.marker_segments]
    markers = markers_of(PERSON, q)
    for m, segment in enumerate(PERSON.marker_segments):
        angles = x[:, _angles_about(int(segment))]
        gains = rng.normal(size=(2, angles.shape[1], 3))
        travel = np.tanh(2 * angles) @ gains[0] + (1 - np.cos(2 * angles)) @ gains[1]
        travel -= travel.mean(axis=0)
        travel *= rng.uniform(0.2, 1.0) * skin_m / np.linalg.norm(travel, axis=1).max()
        markers[:, m] += np.einsum("fij,fj->fi", turns[:, m], travel)
    return times, markers + rng.normal(0, NOISE_M, markers.shape), turns


def _angles_about(segment: int) -> list[int]:
    skeleton = PERSON.skeleton
    columns = []
    for i, kind in enumerate(skeleton.joint_types):
        if kind != "free" and (i == segment or skeleton.parents[i] == segment):
            start = skeleton.v_starts[i]
            columns += list(range(start, start + (1 if kind == "revolute" else 3)))
    return columns


def fitted(markers: np.ndarray, times: np.ndarray) -> MarkerFit:
    q = solve_trial(PERSON, markers, posture_sd_rad=3.0, iterations=50, **SCALES).q
    return marker_fit(PERSON, markers, q, times, **SCALES)


def exchange(markers: np.ndarray, a: str, b: str, frames: slice) -> None:
    """Give two markers each other's labels, in place."""
    pair = [MARKERS.index(a), MARKERS.index(b)]
    markers[frames, pair] = markers[frames, pair[::-1]]


def markers_on(*segments: str) -> list[str]:
    on = zip(MARKERS, PERSON.marker_segments, strict=True)
    return [label for label, k in on if PERSON.skeleton.segments[k] in segments]


def judged(times: np.ndarray, markers: np.ndarray, filled: np.ndarray | None = None) -> Evidence:
    """Of frames that are recorded, but for those that were filled."""
    recorded = np.zeros(markers.shape[:2], dtype=bool) if filled is None else filled
    return marker_evidence(fitted(markers, times), fitted, recorded)


def events_of(times: np.ndarray, markers: np.ndarray, filled: np.ndarray | None = None):
    return judged(times, markers, filled).events
