"""What skin that slides over the bones can do to the simulated wrench.

Skin moves with the pose: a marker's error is taken as a random linear function of the angles of the
joints beside its segment, as large as the residual that the marker itself shows. What all markers
of a segment share leaves no residual, and is larger: skin moves over the bone as a whole rather
than being deformed (Andersen 2012, J Biomech 45). Each draw of such functions bends the pose, and
the pose bends the wrench. The draws span what no diagnosis may take for an effect.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bsip_cli.body.person import Person
from bsip_cli.body.skeleton import Skeleton
from bsip_cli.effects.scene import Scene

SKIN_HZ = 8.0
_FRAMES_AT_ONCE = 200_000  # of all draws together: bounds the memory


def skin_draws(
    scene: Scene, marker_rms_m: np.ndarray, shared: float, count: int, rng: np.random.Generator
) -> np.ndarray:
    """(N, 6, count) changes of the wrench, one per draw of all markers' errors.

    marker_rms_m (m,) : how far each marker slides against the others, root mean square.
    shared : how many times as far all markers of a segment slide together.
    """
    nearby = nearby_angles(scene)
    mixing = _mixing(scene.person.marker_segments, nearby, marker_rms_m, shared, count, rng)
    at_once = max(1, _FRAMES_AT_ONCE // len(scene.q))
    parts = []
    for first in range(0, count, at_once):
        some = [one[..., first : first + at_once] for one in mixing]
        errors = _marker_errors(scene, nearby, some)
        parts.append(scene.response.of(scene.pose_response.of(errors)))
    return np.concatenate(parts, axis=2)


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


def _mixing(
    segments: np.ndarray,
    nearby: Sequence[np.ndarray],
    marker_rms_m: np.ndarray,
    shared: float,
    count: int,
    rng: np.random.Generator,
) -> list[np.ndarray]:
    """(3, j, count) per marker: by how far each angle beside its segment moves it [m]."""
    together = {}
    for segment in np.unique(segments):
        (mine,) = np.nonzero(segments == segment)
        far = shared * np.sqrt((marker_rms_m[mine] ** 2).mean())
        together[segment] = far * rng.normal(size=(3, nearby[mine[0]].shape[1], count))
    return [
        together[segment] + rms * rng.normal(size=(3, angles.shape[1], count))
        for segment, angles, rms in zip(segments, nearby, marker_rms_m, strict=True)
    ]


def _marker_errors(
    scene: Scene, nearby: Sequence[np.ndarray], mixing: Sequence[np.ndarray]
) -> np.ndarray:
    """(N, m, 3, k) [m] in the world, of k draws: mixing (3, j, k) of each marker."""
    rotation, draws = scene.motion.rotation, mixing[0].shape[2]
    errors = np.empty((len(scene.q), len(mixing), 3, draws))
    for m, segment in enumerate(scene.person.marker_segments):
        local = np.einsum("fj,xjc->fxc", nearby[m], mixing[m])
        errors[:, m] = rotation[:, segment] @ local
    return errors


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
