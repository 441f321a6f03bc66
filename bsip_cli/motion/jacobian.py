"""How the model's markers move with the pose."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bsip_cli.body.person import Person
from bsip_cli.motion import kernel
from bsip_cli.motion.inverse_kinematics import Tree, model_markers, tree_of


def marker_residuals(person: Person, q: np.ndarray, markers: np.ndarray) -> np.ndarray:
    """(N, m, 3) markers less the model's, in the axes of their segments [m]; NaN where missing."""
    R, p = tree_of(person).forward(q)
    world = markers - model_markers(person, R, p)
    return np.einsum("fmij,fmi->fmj", R[:, person.marker_segments], world)


def subtrees(person: Person) -> np.ndarray:
    """(n, m) True where marker m hangs on segment n or beyond it."""
    parents = person.skeleton.parents
    on = np.zeros((len(parents), len(person.markers)), dtype=bool)
    on[person.marker_segments, np.arange(len(person.markers))] = True
    for i in range(len(parents) - 1, 0, -1):
        on[parents[i]] |= on[i]
    return on


def pose_columns(
    tree: Tree, R: np.ndarray, p: np.ndarray, model: np.ndarray, below: np.ndarray
) -> np.ndarray:
    """(N, m, 3, nv) velocity of each marker for each unit velocity."""
    columns = np.zeros((*model.shape, tree.nv))
    kernel.marker_columns(R, p, model, tree.arrays, below, columns)
    return columns


def coordinate_covariance(person: Person, q: np.ndarray, prior_rad: float) -> np.ndarray:
    """(N, nv, nv) covariance of the pose for marker errors of 1 m; q (N, nq).

    ``prior_rad`` is the posture prior's standard deviation over that of the markers.
    """
    tree = tree_of(person)
    R, p = tree.forward(q)
    columns = pose_columns(tree, R, p, model_markers(person, R, p), subtrees(person))
    columns *= np.sqrt(person.marker_weights)[:, None, None]
    flat = columns.reshape(len(q), -1, tree.nv)
    information = np.einsum("fki,fkj->fij", flat, flat, optimize=True)
    information[:, range(6, tree.nv), range(6, tree.nv)] += prior_rad**-2
    return np.linalg.inv(information)


# --- how the pose answers to small errors of the markers, and what it leaves of them --------------


_BLOCK = 400
_PRIOR_M = 1e-3  # against the markers' metres: what no marker shows stays where it is


@dataclass(frozen=True, eq=False)
class PoseResponse:
    """The least-squares step of the inverse kinematics at poses q (N, nq).

    weights : (N, m) of the markers; 0 where one is missing.
    inverse : (N, nv, nv) of the weighted normal matrix, with a weak prior on all coordinates.
    """

    person: Person
    q: np.ndarray
    weights: np.ndarray
    inverse: np.ndarray

    def of(self, errors_m: np.ndarray, markers: Sequence[int] | None = None) -> np.ndarray:
        """(N, nv, k) change of the pose, in the tangent space.

        errors_m : (N, m, 3, k) [m] of all markers, world axes, or only of those numbered.
        """
        chosen = range(len(self.person.markers)) if markers is None else markers
        moved = np.empty((len(self.q), self.inverse.shape[1], errors_m.shape[-1]))
        for part, columns, _ in _columns(_with_only(self.person, chosen), self.q):
            weighted = self.weights[part][:, chosen, None, None] * errors_m[part]
            moved[part] = _flat(columns).swapaxes(1, 2) @ _flat(weighted)
        return self.inverse @ moved

    def left(
        self,
        errors_m: np.ndarray,
        markers: Sequence[int] | None = None,
        moved: np.ndarray | None = None,
    ) -> np.ndarray:
        """(N, m, 3, k) change of every marker's residual: its error less what the pose follows.

        In the axes of the markers' segments, as :func:`motion.jacobian.marker_residuals`.
        ``moved`` (N, nv, k) is the pose's answer where it is not :meth:`of` the errors.
        """
        chosen = range(len(self.person.markers)) if markers is None else markers
        moved = self.of(errors_m, markers) if moved is None else moved
        left = np.empty((*self.weights.shape, 3, errors_m.shape[-1]))
        for part, columns, turn in _columns(self.person, self.q):
            change = -(_flat(columns) @ moved[part]).reshape(left[part].shape)
            change[:, chosen] += errors_m[part]
            left[part] = turn.swapaxes(2, 3) @ change
        return left


def pose_responses(person: Person, q: np.ndarray, trust: np.ndarray | None = None) -> PoseResponse:
    """At q (N, nq); ``trust`` (N, m) is the part of its weight that each marker keeps."""
    share = np.ones((len(q), len(person.markers))) if trust is None else trust
    weights = share * person.marker_weights
    nv = len(person.skeleton.v_names)
    inverse = np.empty((len(q), nv, nv))
    for part, columns, _ in _columns(person, q):
        weighted = _flat(np.sqrt(weights[part])[..., None, None] * columns)
        information = weighted.swapaxes(1, 2) @ weighted
        information[:, range(nv), range(nv)] += _PRIOR_M**2
        inverse[part] = np.linalg.inv(information)
    return PoseResponse(person, q, weights, inverse)


def marker_trust(residual_m: np.ndarray, limit_m: float) -> np.ndarray:
    """(N, m) part of its weight that the robust fit leaves a marker with residual (N, m, 3).

    One up to the limit, then falling with the square of the distance; 0 where it is missing.
    """
    distance = np.linalg.norm(residual_m, axis=2)
    share = np.minimum(1.0, limit_m / np.maximum(np.nan_to_num(distance), 1e-9)) ** 2
    return np.where(np.isfinite(distance), share, 0.0)


def _columns(person: Person, q: np.ndarray) -> Iterator[tuple[slice, np.ndarray, np.ndarray]]:
    """Frames, velocity (n, m, 3, nv) of the markers for unit velocities, axes (n, m, 3, 3)."""
    tree, below = tree_of(person), subtrees(person)
    for start in range(0, len(q), _BLOCK):
        part = slice(start, start + _BLOCK)
        R, p = tree.forward(q[part])
        columns = pose_columns(tree, R, p, model_markers(person, R, p), below)
        yield part, columns, R[:, person.marker_segments]


def _flat(x: np.ndarray) -> np.ndarray:
    """(N, m, 3, k) as (N, 3 m, k)."""
    return x.reshape(len(x), -1, x.shape[-1])


def _with_only(person: Person, markers: Sequence[int]) -> Person:
    """The person with some of the markers."""
    chosen = list(markers)
    return replace(
        person,
        markers=tuple(person.markers[m] for m in chosen),
        marker_segments=person.marker_segments[chosen],
        marker_positions_m=person.marker_positions_m[chosen],
        marker_weights=person.marker_weights[chosen],
    )
