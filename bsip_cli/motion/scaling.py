"""Refine a first skeleton: lengths, joint centres, hinges and marker places that fit many frames.

Bundle adjustment with priors: poses and geometry together minimise the marker residuals; the
poses are eliminated frame by frame (variable projection), the geometry takes Gauss-Newton steps.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bsip_cli.body.person import Person
from bsip_cli.motion.calibration import Calibration
from bsip_cli.motion.inverse_kinematics import (
    Posed,
    Poses,
    marker_trust,
    posed,
    solve_poses,
    solve_trial,
    subtrees,
)
from bsip_cli.motion.marker_events import offsets
from bsip_cli.motion.marker_exchange import Labelling, relabelled
from bsip_cli.motion.marker_fit import MarkerFit, marker_fit
from bsip_cli.segments import mirrored

IkOptions = Mapping[str, Any]  # keyword options of :func:`solve_poses`


@dataclass(frozen=True)
class ScalingOptions:
    """Standard deviations of the priors and limits, as in configs/default.toml, [scale]."""

    joint_centre_sd_m: float
    length_sd: float
    marker_sd_m: float
    hinge_sd_rad: float
    symmetry_sd: float
    mirror_sd_m: float
    independent_frames: float
    iterations: int


@dataclass(frozen=True, eq=False)
class Refinement:
    """The refined person, its poses, the residual before, and standard deviations.

    ``length_sd_m`` (n,) is NaN for segments whose length is not a parameter of the fit.
    """

    person: Person
    poses: Poses
    rms_before_m: float
    length_sd_m: np.ndarray


@dataclass(frozen=True)
class _Parameter:
    """One number of the geometry, its prior, and what it moves.

    kind: length, joint, origin, parent_tilt, child_tilt, shift or marker. ``index`` is the segment
    (for joints and tilts the child segment, for markers the marker).
    moves : arrays of the person, entries in them, and by how much these change with it.
    """

    kind: str
    index: int
    sd: float
    moves: tuple[tuple[str, tuple[int, ...], float], ...]


def refine(
    person: Person, markers_m: np.ndarray, q: np.ndarray, options: ScalingOptions, ik: IkOptions
) -> Refinement:
    """Fit the person's geometry to N frames chosen from all trials.

    markers_m : (N, m, 3) world positions, NaN where missing.
    q : (N, nq) poses to start from.
    ik : keyword options of :func:`solve_poses`.
    """
    parameters = tuple(_parameters(person, options))
    precision = _prior_precision(person, parameters, options)
    x = np.zeros(len(parameters))
    # each frame from its own start: the chosen frames are not neighbours
    fitted, poses = person, solve_poses(person, markers_m, q, **ik)
    before, cost = poses.rms_m(), _total_cost(poses, fitted, x, precision, options, ik)
    damping = 1e-6
    information, gradient = _reduced_equations(fitted, markers_m, poses, parameters, options, ik)
    for _ in range(options.iterations):
        hessian = information + precision
        step = np.linalg.solve(
            hessian + damping * np.diag(np.diag(hessian)), gradient - precision @ x
        )
        trial = _with(person, parameters, x + step)
        trial_poses = solve_poses(trial, markers_m, poses.q, **ik)
        trial_cost = _total_cost(trial_poses, trial, x + step, precision, options, ik)
        if trial_cost > cost:
            damping = max(100 * damping, 1e-3)
            continue
        finished = cost - trial_cost < 1e-4 * cost
        x, fitted, poses, cost, damping = x + step, trial, trial_poses, trial_cost, 1e-6
        information, gradient = _reduced_equations(
            fitted, markers_m, poses, parameters, options, ik
        )
        if finished:
            break
    covariance = np.linalg.inv(information + precision)
    spread = np.full(len(person.skeleton.segments), np.nan)
    for k, parameter in enumerate(parameters):
        if parameter.kind == "length":
            spread[parameter.index] = np.sqrt(covariance[k, k])
    return Refinement(fitted, poses, before, spread)


def varied_frames(orientations: np.ndarray, count: int) -> np.ndarray:
    """Indices of ``count`` frames that differ most from each other, the first frame among them.

    orientations : (N, n, 3, 3) segment orientations; seen from the base, so that walking about
    does not count as variety.
    """
    base = orientations[:, :1]
    features = np.einsum("fbij,fnik->fnjk", base, orientations).reshape(len(orientations), -1)
    chosen = [0]
    distance = np.linalg.norm(features - features[0], axis=1)
    while len(chosen) < min(count, len(features)):
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(features - features[chosen[-1]], axis=1))
    return np.array(sorted(chosen))


def _total_cost(
    poses: Poses,
    person: Person,
    x: np.ndarray,
    precision: np.ndarray,
    options: ScalingOptions,
    ik: IkOptions,
) -> float:
    limit, d = ik["robust_limit_m"], np.nan_to_num(poses.residual_m)
    far = np.maximum(d, limit)
    loss = np.where(d <= limit, 0.5 * d**2, limit**2 * (0.5 + np.log(far / limit)))
    frame_weight = min(1.0, options.independent_frames / len(d))
    weights = person.marker_weights / ik["marker_sd_m"] ** 2 * frame_weight
    return float((loss * weights).sum() + 0.5 * x @ precision @ x)


# --- the parameters ---------------------------------------------------------------------------


_JOINT, _ORIGIN, _MARKER = "joint_in_parent_m", "origin_in_joint_m", "marker_positions_m"
_TILTS = ("parent_tilt", "child_tilt")
_SIDEWAYS = 2


def _children(person: Person, segment: int) -> list[int]:
    return [i for i, parent in enumerate(person.skeleton.parents) if parent == segment]


def _parameters(person: Person, options: ScalingOptions) -> Iterator[_Parameter]:
    """The base keeps its anatomical origin: where the trunk bends on it is a joint of its own."""
    skeleton, joint_sd = person.skeleton, options.joint_centre_sd_m
    for i in range(len(skeleton.segments)):
        children, moving = _children(person, i), _moving_joints(person, i)
        for child in moving:
            yield from _three("joint", child, joint_sd, [(_JOINT, child)])
        if children and i > 0 and not _has_free_joints(person, i):
            moves = (("lengths_m", (i,), 1.0), (_JOINT, (children[0], 1), -1.0))
            yield _Parameter("length", i, options.length_sd * person.lengths_m[i], moves)
        if np.any(person.origin_in_joint_m[i]):
            yield from _three("origin", i, joint_sd, [(_ORIGIN, i)])
        if skeleton.joint_types[i] == "revolute":
            for kind in _TILTS:
                yield _Parameter(kind, i, options.hinge_sd_rad, ((f"{kind}_rad", (i,), 1.0),))
        own = np.flatnonzero(person.marker_segments == i).tolist()
        if i > 0 and own:
            moved = [*((_MARKER, m) for m in own), *((_JOINT, child) for child in moving)]
            yield from _three("shift", i, joint_sd, moved)
    for m in range(len(person.markers)):
        yield from _three("marker", m, options.marker_sd_m, [(_MARKER, m)])


def _three(
    kind: str, index: int, sd: float, moved: Sequence[tuple[str, int]]
) -> Iterator[_Parameter]:
    """Along each axis."""
    for axis in range(3):
        yield _Parameter(kind, index, sd, tuple((name, (k, axis), 1.0) for name, k in moved))


def _has_free_joints(person: Person, segment: int) -> bool:
    """Whether joints on it lie anywhere: of several, and of a rod, whose axes are not along it."""
    return len(_children(person, segment)) > 1 or segment not in person.skeleton.bodies


def _moving_joints(person: Person, segment: int) -> list[int]:
    """Joints that lie anywhere on a segment and are not its origin by definition.

    Hips, shoulders and the waist are not; the neck is where the upper torso begins.
    """
    joints = _children(person, segment) if _has_free_joints(person, segment) else []
    return [c for c in joints if segment == 0 or np.any(person.joint_in_parent_m[c])]


def _prior_precision(
    person: Person, parameters: tuple[_Parameter, ...], options: ScalingOptions
) -> np.ndarray:
    """(P, P) precision of the priors; left and right lengths and hips pull each other, and the
    midline's joints and segments to its plane."""
    precision = np.diag([parameter.sd**-2 for parameter in parameters])
    segments = person.skeleton.segments
    hips = {segments[child] for child in _children(person, 0)}  # shoulders glide on the chest
    numbers = {
        (p.kind, segments[p.index], p.moves[0][1][1:]): k
        for k, p in enumerate(parameters)
        if p.kind in ("length", "joint", "origin", "shift")
    }
    for (kind, name, axis), k in numbers.items():
        twin, sign = numbers.get((kind, mirrored(name), axis)), -1 if axis == (_SIDEWAYS,) else 1
        sd_m = options.mirror_sd_m
        if kind == "length":
            sd_m = options.symmetry_sd * person.lengths_m[parameters[k].index]
        is_tied = kind == "length" or (kind == "joint" and name in hips)
        if twin is not None and is_tied and name.endswith("_l"):
            precision[np.ix_([k, twin], [k, twin])] += sd_m**-2 * np.array([[1, -sign], [-sign, 1]])
        elif twin == k and sign < 0:
            precision[k, k] += sd_m**-2
    return precision


def _with(person: Person, parameters: tuple[_Parameter, ...], x: np.ndarray) -> Person:
    """The person with the parameters' changes ``x`` added to the first guess."""
    names = (_JOINT, _ORIGIN, _MARKER, "lengths_m", *(f"{kind}_rad" for kind in _TILTS))
    arrays = {name: getattr(person, name).copy() for name in names}
    for parameter, value in zip(parameters, x, strict=True):
        for name, at, factor in parameter.moves:
            arrays[name][at] += factor * value
    joints, lengths = arrays[_JOINT], arrays["lengths_m"]
    hips = [c for c in _children(person, 0) if np.any(person.joint_in_parent_m[c])]
    if hips:  # the pelvis is as long as its origin is from the hips' middle
        lengths[0] = float(np.hypot(*joints[hips].mean(axis=0)[:2]))
    for rod in set(range(len(lengths))) - set(person.skeleton.bodies):
        lengths[rod] = np.linalg.norm(joints[_children(person, rod)[0]])
    return replace(person, **arrays)


# --- the equations ----------------------------------------------------------------------------


def _reduced_equations(
    person: Person,
    markers_m: np.ndarray,
    poses: Poses,
    parameters: tuple[_Parameter, ...],
    options: ScalingOptions,
    ik: IkOptions,
) -> tuple[np.ndarray, np.ndarray]:
    """Information (P, P) and gradient (P,) of the geometry with all poses eliminated."""
    at, below = posed(person, poses.q), subtrees(person)
    # weights [1/m2], less beyond the robust limit; zero where missing
    trust = marker_trust(poses.residual_m[..., None], ik["robust_limit_m"])
    base = person.marker_weights / ik["marker_sd_m"] ** 2
    root = np.sqrt(trust * base * min(1.0, options.independent_frames / len(poses.q)))[..., None]
    residual = np.where(root > 0, (markers_m - at.markers_m) * root, 0.0)
    by_parameter = np.stack([_column(one, at, below) for one in parameters], axis=-1)
    frames, nv = len(poses.q), len(person.skeleton.v_names)
    Jq = (at.columns() * root[..., None]).reshape(frames, -1, nv)
    Jp = (by_parameter * root[..., None]).reshape(frames, -1, len(parameters))
    r = residual.reshape(frames, -1)
    A = np.einsum("fki,fkj->fij", Jq, Jq, optimize=True)
    A += np.eye(nv) * max(ik["posture_sd_rad"] ** -2, 1e-9)
    B = np.matmul(Jq.transpose(0, 2, 1), Jp)
    C = np.linalg.solve(A, B)
    flat = Jp.reshape(-1, Jp.shape[2])
    information = flat.T @ flat - np.einsum("fip,fiq->pq", B, C, optimize=True)
    pose_gradient = np.einsum("fki,fk->fi", Jq, r)
    gradient = flat.T @ r.ravel() - np.einsum("fip,fi->p", C, pose_gradient)
    return information, gradient


def _column(parameter: _Parameter, at: Posed, below: np.ndarray) -> np.ndarray:
    """(N, m, 3) motion of the model's markers for a unit change of one parameter; ``below`` (n, m)
    as of :func:`subtrees`."""
    column, R, parents = np.zeros_like(at.markers_m), at.R, at.person.skeleton.parents
    for name, (i, *axis), factor in parameter.moves:
        if name == _MARKER:
            column[:, i] += factor * R[:, at.person.marker_segments[i], :, axis[0]]
        elif name in (_JOINT, _ORIGIN):
            carrier = parents[i] if name == _JOINT else i
            column[:, below[i]] += factor * R[:, None, carrier, :, axis[0]]
        elif name != "lengths_m":  # which moves the joint, too
            turning = R[:, parents[i], :, 0] if name == "parent_tilt_rad" else -R[:, i, :, 0]
            arms = at.markers_m[:, below[i]] - at.p[:, None, i]
            column[:, below[i]] += np.cross(turning[:, None], arms)
    return column


# --- over frames of all trials, without the markers that are misplaced there --------------------


_FRAMES_PER_TRIAL = 400
_MOST = 0.8  # of the markers
_FEW = 0.5  # of the trials


@dataclass(frozen=True, eq=False)
class TrialMarkers:
    """Frames of one trial: times_s (N,), markers_m (N, m, 3) world in the person's order, NaN where
    missing."""

    times_s: np.ndarray
    markers_m: np.ndarray

    def frames(self, chosen: slice | np.ndarray) -> TrialMarkers:
        """Some of the frames."""
        return TrialMarkers(self.times_s[chosen], self.markers_m[chosen])

    def without(self, hidden: np.ndarray) -> TrialMarkers:
        """Without the markers that are hidden (m,)."""
        return replace(self, markers_m=np.where(hidden[:, None], np.nan, self.markers_m))


def refine_over_trials(
    calibration: Calibration,
    standing: TrialMarkers,
    standing_trial: int,
    trials: Iterable[TrialMarkers],
    frames: int,
    options: ScalingOptions,
    ik: IkOptions,
) -> Refinement:
    """Fit the geometry to ``frames`` frames of all trials that differ most.

    Exchanged labels, and a marker that is misplaced throughout fewer than half of the trials, would
    drag places in the model towards their middle. Labels are corrected by the calibration before
    the fit; of such a marker the fit is made again without it.

    standing : the one frame that the calibration is like, of the trial with this number.
    ik : keyword options of :func:`solve_poses`.
    """
    person, seen = calibration.person, []  # some of the frames that show nearly all markers
    for one in trials:
        fewer = one.frames(slice(None, None, max(1, len(one.times_s) // _FRAMES_PER_TRIAL)))
        fewer = fewer.frames(np.isfinite(fewer.markers_m[..., 0]).mean(axis=1) > _MOST)
        if len(fewer.times_s):
            labelled = relabelled(_labelling(person, fewer, ik)).fit
            fewer = replace(fewer, markers_m=labelled.measured_m)
        seen.append(fewer)

    def refined(standing: TrialMarkers, seen: Sequence[TrialMarkers]) -> Refinement:
        markers = [standing.markers_m, *(one.markers_m for one in seen if len(one.times_s))]
        poses = [solve_poses(person, standing.markers_m, calibration.q, **ik).q]
        poses += [solve_trial(person, one, **ik).q for one in markers[1:]]
        all_markers, all_poses = np.concatenate(markers), np.concatenate(poses)
        chosen = varied_frames(posed(person, all_poses).R, frames)
        return refine(person, all_markers[chosen], all_poses[chosen], options, ik)

    fit = refined(standing, seen)
    misplaced = np.array([_misplaced(fit.person, one, ik) for one in seen])
    misplaced &= misplaced.mean(axis=0) < _FEW
    if not misplaced.any():
        return fit
    kept = [one.without(off) for one, off in zip(seen, misplaced, strict=True)]
    return refined(standing.without(misplaced[standing_trial]), kept)


def _labelling(person: Person, one: TrialMarkers, ik: IkOptions) -> Labelling:
    """A trial's markers as labelled, and the poses fitted to them."""
    scales = {name: ik[name] for name in ("marker_sd_m", "robust_limit_m")}

    def fitted(markers_m: np.ndarray, times_s: np.ndarray) -> MarkerFit:
        poses = solve_trial(person, markers_m, **ik)
        return marker_fit(person, markers_m, poses.q, times_s, **scales)

    return Labelling(fitted(one.markers_m, one.times_s), fitted)


def _misplaced(person: Person, one: TrialMarkers, ik: IkOptions) -> np.ndarray:
    """(m,) markers that are not where the model has them throughout a trial."""
    if not len(one.times_s):
        return np.zeros(len(person.markers), dtype=bool)
    fit = _labelling(person, one, ik).fit
    off = {event.marker for event in offsets(fit, fit.residual_m) if event.kind == "offset"}
    return np.isin(person.markers, list(off))
