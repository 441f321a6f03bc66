"""Poses of the whole tree that fit the markers best, frame by frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from bsip_cli.body.person import Person, rigid_motion
from bsip_cli.errors import BadDataError
from bsip_cli.motion import kernel

_STARTS, _START_SD_RAD, _LARGEST_MISFIT_M = 16, 0.8, 0.1
_KINDS = {"free": kernel.FREE, "spherical": kernel.SPHERICAL, "revolute": kernel.REVOLUTE}


@dataclass(frozen=True, eq=False)
class Poses:
    """Least-squares poses of N frames.

    q : (N, nq) configurations in Pinocchio's order (quaternions x, y, z, w).
    residual_m : (N, m) distance of each marker from its model, NaN where missing.
    coordinate_sd : (N, nv) standard deviation of each coordinate [m or rad], given those nearer
        to the base.
    converged : (N,) the optimum was reached within the allowed steps.
    """

    q: np.ndarray
    residual_m: np.ndarray
    coordinate_sd: np.ndarray
    converged: np.ndarray

    def frame_rms_m(self) -> np.ndarray:
        """(N,) root-mean-square residual of the markers that are there."""
        present = np.isfinite(self.residual_m)
        squares = np.where(present, self.residual_m, 0.0) ** 2
        return np.sqrt(squares.sum(axis=1) / np.maximum(present.sum(axis=1), 1))

    def rms_m(self) -> float:
        """Root-mean-square residual over everything."""
        return float(np.sqrt(np.nanmean(self.residual_m**2)))


def tree_of(person: Person) -> kernel.Tree:
    """Flatten a person's skeleton for the kernel."""
    skeleton = person.skeleton
    nv = len(skeleton.v_names)
    sizes = np.diff([*skeleton.v_starts, nv])
    v_parents = np.arange(-1, nv - 1)
    for start, parent in zip(skeleton.v_starts[1:], skeleton.parents[1:], strict=True):
        v_parents[start] = skeleton.v_starts[parent] + sizes[parent] - 1
    return kernel.Tree(
        kinds=np.array([_KINDS[kind] for kind in skeleton.joint_types]),
        parents=np.array(skeleton.parents),
        q_starts=np.array(skeleton.q_starts),
        v_starts=np.array(skeleton.v_starts),
        v_segments=np.repeat(np.arange(len(sizes)), sizes),
        v_parents=v_parents,
        positions=person.joint_positions_m(),
        rotations=person.joint_rotations(),
        axes=person.hinge_axes(),
    )


def neutral(person: Person, turns_rad: np.ndarray | None = None) -> np.ndarray:
    """(nq,) all angles zero, the base at the world's origin; or every joint but the base's turned
    by those of the angles (nv,)."""
    q, skeleton = np.zeros(len(person.skeleton.q_names)), person.skeleton
    angles = np.zeros(len(skeleton.v_names)) if turns_rad is None else turns_rad
    joints = zip(skeleton.joint_types, skeleton.q_starts, skeleton.v_starts, strict=True)
    for kind, at, av in joints:
        if kind == "free":
            q[at + 6] = 1.0
        elif kind == "spherical":
            q[at : at + 4] = Rotation.from_rotvec(angles[av : av + 3]).as_quat()
        else:
            q[at] = angles[av]
    return q


def solve_poses(
    person: Person,
    markers_m: np.ndarray,
    q_first: np.ndarray,
    *,
    marker_sd_m: float,
    robust_limit_m: float,
    posture_sd_rad: float | np.ndarray,
    iterations: int,
    may_show_nothing: bool = False,
) -> Poses:
    """Weighted least squares on all markers, robust beyond a limit.

    markers_m : (N, m, 3) world positions in the order of ``person.markers``, NaN where missing.
    q_first : (nq,) where the first frame starts, each other one from the last; or (N, nq), where
        each frame starts.
    marker_sd_m, robust_limit_m, posture_sd_rad, iterations : as in configs/default.toml, [ik];
        ``posture_sd_rad`` may differ between coordinates (nv,).

    BadDataError: there is no frame, or no marker in any frame and that is not allowed.
    """
    if not may_show_nothing and not np.isfinite(markers_m).any():
        raise BadDataError("no marker is visible in any frame", expected="tracked markers")
    count, nv = len(markers_m), len(person.skeleton.v_names)
    starts = np.ascontiguousarray(np.atleast_2d(q_first))
    q, residual = np.empty((count, starts.shape[1])), np.empty(markers_m.shape[:2])
    sd, steps = np.empty((count, nv)), np.empty(count, dtype=np.int64)
    task = kernel.Task(
        segments=np.asarray(person.marker_segments),
        positions=person.markers_in_joint_m(),
        weights=person.marker_weights / marker_sd_m**2,
        limit=float(robust_limit_m),
        prior=np.full(nv, posture_sd_rad) ** -2.0,
    )
    measured = np.ascontiguousarray(markers_m, dtype=float)
    tree = tree_of(person)
    kernel.solve_frames(measured, starts, tree, task, iterations, q, residual, sd, steps)
    return Poses(q, residual, sd, steps >= 0)


def solve_trial(person: Person, markers_m: np.ndarray, **options: Any) -> Poses:
    """Poses of a whole trial (N, m, 3), from the frame that shows most markers to both ends.

    ``options`` and errors as in :func:`solve_poses`.
    """
    seen = np.isfinite(markers_m).all(axis=2).sum(axis=1)
    if not seen.any():
        return solve_poses(person, markers_m, neutral(person), **options)
    first = int(np.argmax(seen))
    start = first_pose(person, markers_m[first], **options)
    after = solve_poses(person, markers_m[first:], start, **options)
    if first == 0:
        return after
    earlier, options = markers_m[first - 1 :: -1], options | {"may_show_nothing": True}
    before = solve_poses(person, earlier, after.q[0], **options)
    both = zip(vars(before).values(), vars(after).values(), strict=True)
    return Poses(*(np.concatenate([one[::-1], other]) for one, other in both))


def first_pose(person: Person, markers_m: np.ndarray, **options: Any) -> np.ndarray:
    """(nq,) pose of one frame (m, 3) without a neighbour to start from.

    The best of several starts: the neutral pose and random turns of all joints about it, since
    raised arms seen from hanging ones may end in a wrong optimum. ``options`` as in
    :func:`solve_poses`. Hinge angles come back within half a turn of zero.
    """
    rng, nv = np.random.default_rng(_STARTS), len(person.skeleton.v_names)
    turns = [None, *rng.normal(0.0, _START_SD_RAD, (_STARTS - 1, nv))]
    starts = np.array([place_base(person, markers_m, neutral(person, one)) for one in turns])
    poses = solve_poses(person, np.tile(markers_m, (_STARTS, 1, 1)), starts, **options)
    misfits = np.nansum(np.minimum(poses.residual_m, _LARGEST_MISFIT_M) ** 2, axis=1)
    best = poses.q[np.argmin(misfits)]
    joints = zip(person.skeleton.q_starts, person.skeleton.joint_types, strict=True)
    hinges = [at for at, kind in joints if kind == "revolute"]
    best[hinges] = (best[hinges] + np.pi) % (2 * np.pi) - np.pi
    return best


_LYING = 0.5  # cosine of the trunk's lean, median over a trial: who lies holds no head upright


def held_upright(person: Person, q: np.ndarray) -> np.ndarray:
    """Poses q (N, nq) with the head, which no marker shows, upright on the leaning trunk.

    People who stand, walk or land keep it within some ten degrees of the vertical (Pozzo 1990,
    Exp Brain Res 82:97); the neck makes the smallest turn that does so. Beyond 90 degrees of lean
    it gives way, as in who stands on the hands. Where the trunk lies, q is returned as it is.
    """
    head = person.skeleton.index("head")
    trunk = posed(person, q).R[:, person.skeleton.parents[head]]
    up = trunk[:, 2]  # the world's vertical in the trunk's axes
    if np.median(up[:, 1]) < _LYING:
        return q
    lean = np.arccos(np.clip(up[:, 1], -1.0, 1.0))
    axis = np.cross([0.0, 1.0, 0.0], up)
    axis /= np.maximum(np.linalg.norm(axis, axis=1, keepdims=True), np.finfo(float).tiny)
    turned, at = q.copy(), person.skeleton.q_starts[head]
    neck = Rotation.from_rotvec(axis * np.minimum(lean, np.pi - lean)[:, None])
    turned[:, at : at + 4] = neck.as_quat()
    return turned


def place_base(person: Person, markers_m: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Move ``q``'s base so that the model's markers lie on one frame's markers (m, 3), rigidly.

    The fit takes the markers of the base segment where three are visible, else all of them.
    """
    at = posed(person, q[None])
    seen = np.isfinite(markers_m).all(axis=1)
    chosen = seen & (person.marker_segments == 0)
    if chosen.sum() < 3:
        chosen = seen
    (turn,), (shift,) = rigid_motion(at.markers_m[0, chosen], markers_m[chosen][None])
    placed = q.copy()
    placed[:3] = turn @ q[:3] + shift
    placed[3:7] = Rotation.from_matrix(turn @ at.R[0, 0]).as_quat()
    return placed


# --- how the model's markers move with the pose ---------------------------------------------------


@dataclass(frozen=True, eq=False)
class Posed:
    """A person in N poses, world.

    R, p : orientation (N, n, 3, 3) and joint centre (N, n, 3) [m] of every segment.
    markers_m : (N, m, 3) where the model has the markers.
    """

    person: Person
    R: np.ndarray
    p: np.ndarray
    markers_m: np.ndarray

    def turns(self) -> np.ndarray:
        """(N, m, 3, 3) axes of each marker's segment."""
        return self.R[:, self.person.marker_segments]

    def residuals(self, markers_m: np.ndarray) -> np.ndarray:
        """(N, m, 3) markers less the model's, in the axes of their segments [m]; NaN where
        missing."""
        return np.einsum("fmij,fmi->fmj", self.turns(), markers_m - self.markers_m)

    def columns(self, markers: Sequence[int] | slice = slice(None)) -> np.ndarray:
        """(N, m, 3, nv) velocity of all or some markers for each unit velocity."""
        places = np.ascontiguousarray(self.markers_m[:, markers])
        below = np.ascontiguousarray(subtrees(self.person)[:, markers])
        columns = np.zeros((*places.shape, len(self.person.skeleton.v_names)))
        kernel.marker_columns(self.R, self.p, places, tree_of(self.person), below, columns)
        return columns


def posed(person: Person, q: np.ndarray) -> Posed:
    """The person in poses q (N, nq)."""
    shape, segments = (len(q), len(person.skeleton.segments), 3), person.marker_segments
    R, p = np.empty((*shape, 3)), np.empty(shape)
    kernel.forward_frames(np.ascontiguousarray(q), tree_of(person), R, p)
    apart = np.einsum("fmij,mj->fmi", R[:, segments], person.markers_in_joint_m())
    return Posed(person, R, p, p[:, segments] + apart)


def subtrees(person: Person) -> np.ndarray:
    """(n, m) True where marker m hangs on segment n or beyond it."""
    parents = person.skeleton.parents
    below = np.arange(len(parents))[:, None] == person.marker_segments
    for i in range(len(parents) - 1, 0, -1):
        below[parents[i]] |= below[i]
    return below


def coordinate_covariance(person: Person, q: np.ndarray, prior_rad: float) -> np.ndarray:
    """(N, nv, nv) covariance of the pose for marker errors of 1 m; q (N, nq).

    ``prior_rad`` is the posture prior's standard deviation over that of the markers.
    """
    return np.linalg.inv(coordinate_information(person, posed(person, q).columns(), prior_rad))


def coordinate_information(person: Person, columns: np.ndarray, prior_rad: float) -> np.ndarray:
    """(N, nv, nv) the inverse of that covariance, of markers that move by ``columns`` (N, m, 3, nv)
    for each unit velocity."""
    information = normal_matrix(columns, person.marker_weights)
    turns = range(6, columns.shape[-1])
    information[:, turns, turns] += prior_rad**-2
    return information


def normal_matrix(columns: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """(N, nv, nv) of markers with weights (N, m) or (m,) that move by ``columns`` (N, m, 3, nv)."""
    weighted = _flat(np.sqrt(weights)[..., None, None] * columns)
    return weighted.swapaxes(1, 2) @ weighted


# --- how the pose answers to small errors of the markers, and what it leaves of them --------------


_BLOCK = 400
_PRIOR_M = 1e-3  # against the markers' metres: what no marker shows stays where it is


@dataclass(frozen=True, eq=False)
class PoseResponse:
    """The least-squares step of the inverse kinematics at poses q (N, nq).

    weights : (N, m) of the markers; 0 where one is missing.
    """

    person: Person
    q: np.ndarray
    weights: np.ndarray

    @cached_property
    def inverse(self) -> np.ndarray:
        """(N, nv, nv) of the weighted normal matrix, with a weak prior on all coordinates."""
        nv = len(self.person.skeleton.v_names)
        inverse = np.empty((len(self.q), nv, nv))
        for part, at in self._blocks:
            information = normal_matrix(at.columns(), self.weights[part])
            information[:, range(nv), range(nv)] += _PRIOR_M**2
            inverse[part] = np.linalg.inv(information)
        return inverse

    @cached_property
    def _blocks(self) -> list[tuple[slice, Posed]]:
        """Some frames after the others: the columns of all at once may not fit into memory."""
        parts = (slice(start, start + _BLOCK) for start in range(0, len(self.q), _BLOCK))
        return [(part, posed(self.person, self.q[part])) for part in parts]

    def of(self, errors_m: np.ndarray, markers: Sequence[int] | slice = slice(None)) -> np.ndarray:
        """(N, nv, k) change of the pose, in the tangent space.

        errors_m : (N, m, 3, k) [m] of all markers, world axes, or only of those numbered.
        """
        moved = np.empty((len(self.q), self.inverse.shape[1], errors_m.shape[-1]))
        for part, at in self._blocks:
            weighted = self.weights[part][:, markers, None, None] * errors_m[part]
            moved[part] = _flat(at.columns(markers)).swapaxes(1, 2) @ _flat(weighted)
        return self.inverse @ moved

    def left(
        self,
        errors_m: np.ndarray,
        markers: Sequence[int] | slice = slice(None),
        moved: np.ndarray | None = None,
    ) -> np.ndarray:
        """(N, m, 3, k) change of every marker's residual: its error less what the pose follows.

        In the axes of the markers' segments, as :meth:`Posed.residuals`.
        ``moved`` (N, nv, k) is the pose's answer where it is not :meth:`of` the errors.
        """
        moved = self.of(errors_m, markers) if moved is None else moved
        left = np.empty((*self.weights.shape, 3, errors_m.shape[-1]))
        for part, at in self._blocks:
            change = -(_flat(at.columns()) @ moved[part]).reshape(left[part].shape)
            change[:, markers] += errors_m[part]
            left[part] = at.turns().swapaxes(2, 3) @ change
        return left


def marker_trust(residual_m: np.ndarray, limit_m: float) -> np.ndarray:
    """(N, m) part of its weight that the robust fit leaves a marker with residual (N, m, 3).

    One up to the limit, then falling with the square of the distance; 0 where it is missing.
    """
    distance = np.linalg.norm(residual_m, axis=2)
    share = np.minimum(1.0, limit_m / np.maximum(np.nan_to_num(distance), 1e-9)) ** 2
    return np.where(np.isfinite(distance), share, 0.0)


def _flat(x: np.ndarray) -> np.ndarray:
    """(N, m, 3, k) as (N, 3 m, k)."""
    return x.reshape(len(x), -1, x.shape[-1])
