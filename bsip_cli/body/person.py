"""A person's scaled skeleton: where the joints are and where the markers sit."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from bsip_cli.body.inertia import Inertia
from bsip_cli.body.skeleton import Skeleton

# --- how a rigid body has moved between points that are known before and after --------------------


def rigid_motion(reference: np.ndarray, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rotations (N, 3, 3) and shifts (N, 3) that bring reference (k, 3) onto frames (N, k, 3).

    Least squares (Kabsch 1976, A solution for the best rotation to relate two sets of vectors).
    """
    a, b = reference.mean(axis=0), frames.mean(axis=1)
    covariance = np.einsum("ki,nkj->nij", reference - a, frames - b[:, None])
    u, _, vt = np.linalg.svd(covariance)
    vt[:, 2] *= np.linalg.det(u @ vt)[:, None]
    turn = np.einsum("nji,nkj->nik", vt, u)
    return turn, b - turn @ a


# A marker trusted to 5 mm leaves the turn about an axis so near uncertain by a quarter radian.
_LEVER_M = 0.02


@dataclass(frozen=True, eq=False)
class Person:
    """Geometry of one person; arrays run over the skeleton's segments or over the markers.

    All segment axes are parallel in the neutral pose but for the hinges' tilts. A hinge turns
    about ``Rx(parent_tilt) z`` in the parent and about ``Rx(child_tilt) z`` in the segment.

    joint_in_parent_m : (n, 3) joint centre in the parent's segment frame (zeros for the base).
    parent_tilt_rad, child_tilt_rad : (n,) tilt of hinges about X; zero for other joints.
    origin_in_joint_m : (n, 3) from the joint centre to the segment's origin, segment axes; only
        the upper torso has one (its joint is the waist, its origin the neck).
    lengths_m : (n,) lengths that scale the anthropometric table; of a link, joint to joint.
    markers : names; ``marker_segments`` (m,) indices; ``marker_positions_m`` (m, 3) in the
        segment frame; ``marker_weights`` (m,).
    held : (n,) joints that no marker informs.
    """

    skeleton: Skeleton
    joint_in_parent_m: np.ndarray
    parent_tilt_rad: np.ndarray
    child_tilt_rad: np.ndarray
    origin_in_joint_m: np.ndarray
    lengths_m: np.ndarray
    markers: tuple[str, ...]
    marker_segments: np.ndarray
    marker_positions_m: np.ndarray
    marker_weights: np.ndarray
    held: np.ndarray

    def without_data(self) -> np.ndarray:
        """(n,) segments whose motion no markers show.

        Held ones, and ends of limbs on spherical joints whose markers lie on a line through the
        joint, as a hand with the styloids only: how it bends cannot be known.
        """
        lost = np.array(self.held, dtype=bool)
        in_joint = self.markers_in_joint_m()
        for i in set(range(len(lost))) - set(self.skeleton.parents):
            own = in_joint[self.marker_segments == i]
            if self.skeleton.joint_types[i] == "spherical" and len(own):
                _, _, axes = np.linalg.svd(own)
                lever = own - np.outer(own @ axes[0], axes[0])
                lost[i] |= np.linalg.norm(lever, axis=1).max() < _LEVER_M
        return lost

    def joint_positions_m(self) -> np.ndarray:
        """(n, 3) joint centres as seen from the parent's *joint*, parent axes."""
        parents = np.array(self.skeleton.parents)
        shift = np.where(parents[:, None] >= 0, self.origin_in_joint_m[parents], 0.0)
        return self.joint_in_parent_m + shift

    def joint_rotations(self) -> np.ndarray:
        """(n, 3, 3) rotation of the segment in its parent at angle zero."""
        angles = self.parent_tilt_rad - self.child_tilt_rad
        c, s, one, zero = np.cos(angles), np.sin(angles), np.ones_like(angles), 0.0 * angles
        rows = [[one, zero, zero], [zero, c, -s], [zero, s, c]]
        return np.moveaxis(np.array(rows), -1, 0)

    def hinge_axes(self) -> np.ndarray:
        """(n, 3) unit axis of each joint in its own segment (used for hinges)."""
        tilt = self.child_tilt_rad
        return np.stack([np.zeros_like(tilt), -np.sin(tilt), np.cos(tilt)], axis=1)

    def markers_in_joint_m(self) -> np.ndarray:
        """(m, 3) marker positions from the joint centre of their segment, segment axes."""
        return self.marker_positions_m + self.origin_in_joint_m[self.marker_segments]


def load_parameters(
    loads: Iterable[tuple[str, float, Iterable[float]]], person: Person
) -> np.ndarray:
    """(10 n,) parameters of point masses on the n segments with mass, about their joint centres
    (Pinocchio's order); added to a person's they are those of person and loads.

    loads : segment, mass [kg] and place (3,) [m] from the segment's origin, in its frame. A load's
    moment of inertia about its own centre is neglected (1 kg of 10 cm has 0.002 kg m2).
    """
    skeleton = person.skeleton
    phi = np.zeros((len(skeleton.bodies), 10))
    for segment, mass_kg, place_m in loads:
        from_joint = np.array(place_m) + person.origin_in_joint_m[skeleton.index(segment)]
        point = Inertia(mass_kg, from_joint, np.zeros((3, 3)))
        phi[skeleton.body_names.index(segment)] += point.phi()
    return phi.ravel()
