"""Skin that slides and swings over the bones, and what it does to the simulated wrench."""

from __future__ import annotations

import numpy as np

from bsip_cli.body.person import Person
from bsip_cli.body.skeleton import Skeleton
from bsip_cli.effects.scene import Scene

SKIN_HZ = 8.0
_UNKNOWN_RMS_M = 0.004  # of a marker whose residuals are not known


def marker_rms_m(scene: Scene) -> np.ndarray:
    """(m,) root mean square of each marker's residuals, per direction."""
    if scene.residual_m is None:
        return np.full(len(scene.person.markers), _UNKNOWN_RMS_M)
    known = np.isfinite(scene.residual_m)
    squares = np.where(known, scene.residual_m, 0.0) ** 2
    count = known.sum(axis=(0, 2))
    rms = np.sqrt(squares.sum(axis=(0, 2)) / np.maximum(count, 1))
    return np.where(count > 0, rms, _UNKNOWN_RMS_M)


def skin_inertia(scene: Scene) -> np.ndarray:
    """(N, 6, s) changes of the wrench if the skin of each segment swings on, one by one.

    Skin is held elastically: where its bone is accelerated by a it stays behind by -a / w^2, with
    w the pace at which it swings by itself. So markers overshoot slightly wherever they turn back.
    """
    person, give = scene.person, (2 * np.pi * SKIN_HZ) ** -2
    columns = []
    for segment in range(len(person.skeleton.segments)):
        markers = [m for m, on in enumerate(person.marker_segments) if on == segment]
        if markers:
            behind = -give * scene.motion.acceleration_m_s2[:, segment]
            errors = np.broadcast_to(behind[:, None, :, None], (len(behind), len(markers), 3, 1))
            columns.append(scene.pose_response.of(errors, markers))
    return scene.response.of(np.concatenate(columns, axis=2))


def nearby_angles(scene: Scene) -> list[np.ndarray]:
    """(N, j) of each marker: angles of the joints at its segment, of variance 1 together."""
    features = joint_angles(scene.person.skeleton, scene.q)
    found = []
    for segment in scene.person.marker_segments:
        angles = [features[i] for i in beside(scene.person, int(segment))]
        nearby = np.concatenate(angles, axis=1)
        scale = np.sqrt((nearby**2).sum(axis=1).mean())
        found.append(nearby / max(scale, 1e-9))
    return found


def beside(person: Person, segment: int) -> list[int]:
    """Indices of the joints at a segment: its own and those of its children; not the base."""
    parents = person.skeleton.parents
    return [i for i in range(1, len(parents)) if i == segment or parents[i] == segment]


def joint_angles(skeleton: Skeleton, q: np.ndarray) -> list[np.ndarray]:
    """Per joint (N, 1 or 3) angles from the neutral pose [rad]; nothing for the base."""
    angles = []
    for at, kind in zip(skeleton.q_starts, skeleton.joint_types, strict=True):
        if kind == "free":
            angle = np.zeros((len(q), 0))
        elif kind == "spherical":
            x = q[:, at : at + 4]
            x = x * np.sign(x[:, 3:] + 1e-300)
            angle = 2 * x[:, :3]
        else:
            angle = q[:, at : at + 1]
        angles.append(angle)
    return angles
