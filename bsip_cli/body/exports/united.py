"""Inertias of several segments as one body, and of one body in another frame."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from bsip_cli.body.exports.identified import IdentifiedPerson, neutral_pose
from bsip_cli.body.inertia import Inertia


def seen_from(inertia: Inertia, rotation: np.ndarray, origin_m: np.ndarray) -> Inertia:
    """The same body seen from a frame with this orientation (3, 3) and origin (3,) in its own."""
    com = rotation.T @ (inertia.com_m - origin_m)
    return Inertia(inertia.mass_kg, com, rotation.T @ inertia.tensor_kgm2 @ rotation)


def united(inertias: Iterable[Inertia]) -> Inertia:
    """Several bodies, all seen from one frame, as one."""
    parts = list(inertias)
    mass = sum(part.mass_kg for part in parts)
    com = np.sum([part.mass_kg * part.com_m for part in parts], axis=0) / mass
    tensor = np.zeros((3, 3))
    for part in parts:
        arm = part.com_m - com
        tensor += part.tensor_kgm2
        tensor += part.mass_kg * (float(arm @ arm) * np.eye(3) - np.outer(arm, arm))
    return Inertia(mass, com, tensor)


def segments_as_one(body: IdentifiedPerson, segments: tuple[str, ...]) -> Inertia:
    """Segments united in the neutral pose, in the frame of the first one's joint."""
    rotations, joints = neutral_pose(body.person)
    at = [body.person.skeleton.index(name) for name in segments]
    first = at[0]
    parts = []
    for i in at:
        rotation = rotations[i].T @ rotations[first]
        origin = rotations[i].T @ (joints[first] - joints[i])
        parts.append(seen_from(body.in_joint(i), rotation, origin))
    return united(parts)
