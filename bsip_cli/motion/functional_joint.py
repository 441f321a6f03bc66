"""A joint from the movement of the segments that it joins: SCoRE and SARA (Ehrig 2006, 2007)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bsip_cli.body.rigid_motion import rigid_motion

_LEAST_FRAMES = 20


@dataclass(frozen=True, eq=False)
class FunctionalJoint:
    """The point and the line that stay where they are in both segments, in the reference pose.

    Attributes
    ----------
    point : (3,) on the axis, nearest to the markers' middle [m].
    axis : (3,) unit vector of the direction in which the point is known worst.
    turned_rad : largest turn of one segment against the other from the reference pose.
    residual_m : how far the point parts between both segments, root mean square.
    """

    point: np.ndarray
    axis: np.ndarray
    turned_rad: float
    residual_m: float

    def nearest_to(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """(3,) the point of the axis nearest to the line through a and b (3,)."""
        along = (b - a) / np.linalg.norm(b - a)
        across = np.cross(self.axis, along)
        across /= np.linalg.norm(across)
        # Seen along the other line: how far to go on the axis until both meet.
        beside = np.cross(across, along)
        return self.point + self.axis * ((a - self.point) @ beside) / (self.axis @ beside)

    def in_plane(self, a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
        """(3,) where the axis meets the plane through a, b and c (3,)."""
        normal = np.cross(b - a, c - a)
        return self.point + self.axis * ((a - self.point) @ normal) / (self.axis @ normal)


def functional_joint(
    proximal: np.ndarray,
    distal: np.ndarray,
    reference_proximal: np.ndarray,
    reference_distal: np.ndarray,
) -> FunctionalJoint | None:
    """The joint between two clusters of markers; None without enough frames.

    Parameters
    ----------
    proximal, distal : (N, k, 3) world positions of each cluster [m], k of at least 3, NaN where
        missing; frames in which one is missing are left out.
    reference_proximal, reference_distal : (k, 3) world positions in the pose that counts.
    """
    whole = np.isfinite(proximal).all(axis=(1, 2)) & np.isfinite(distal).all(axis=(1, 2))
    if whole.sum() < _LEAST_FRAMES:
        return None
    turn_a, shift_a = rigid_motion(reference_proximal, proximal[whole])
    turn_b, shift_b = rigid_motion(reference_distal, distal[whole])
    rows = np.concatenate([turn_a, -turn_b], axis=2).reshape(-1, 6)
    middle = 0.5 * (reference_proximal.mean(axis=0) + reference_distal.mean(axis=0))
    start = np.concatenate([middle, middle])
    right = (shift_b - shift_a).reshape(-1) - rows @ start
    u, strength, vt = np.linalg.svd(rows, full_matrices=False)
    step = vt[:5].T @ ((u[:, :5].T @ right) / strength[:5])  # nothing along the axis
    points = (start + step).reshape(2, 3)
    left = (rows @ (start + step) - (shift_b - shift_a).reshape(-1)).reshape(-1, 3)
    axis = vt[5].reshape(2, 3).sum(axis=0)
    relative = np.einsum("nji,njk->nik", turn_a, turn_b)
    cosine = 0.5 * (np.trace(relative, axis1=1, axis2=2) - 1.0)
    return FunctionalJoint(
        points.mean(axis=0),
        axis / np.linalg.norm(axis),
        float(np.arccos(np.clip(cosine, -1.0, 1.0)).max()),
        float(np.sqrt((left**2).sum(axis=1).mean())),
    )
