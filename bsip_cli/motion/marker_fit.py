"""One trial's markers against the fitted model: what the search for bad markers reads."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from bsip_cli.body.person import Person
from bsip_cli.motion.inverse_kinematics import (
    marker_trust,
    model_markers,
    pose_columns,
    subtrees,
    tree_of,
)

_RESPONSE_FRAMES = 16
_POSTURE_SD_RAD = 3.0
# Median length of a three-dimensional normal vector of unit spread.
MEDIAN_LENGTH = 1.538
_USUAL_M = 0.03  # how far a displaced marker moves, before the data speak


@dataclass(frozen=True, eq=False)
class MarkerFit:
    """Markers of N frames and the poses fitted to them.

    labels, segments : (m,) names of the markers and of the segments they sit on.
    times_s : (N,).
    measured_m, model_m : (N, m, 3) world; NaN where a marker is missing.
    residual_m : (N, m, 3) measured less model, in the axes of the marker's segment.
    place_m : (m, 3) where the markers sit in their segments.
    trusted_m : (m,) what a marker's position is trusted to, as in the inverse kinematics.
    parents : of every segment but the root, the one that carries it.
    pose : segment to (N, k) columns, the angles of its own joint and of those it carries.
    respond : computes ``response``, which a fit that is only compared does not need.
    """

    labels: tuple[str, ...]
    segments: tuple[str, ...]
    times_s: np.ndarray
    measured_m: np.ndarray
    model_m: np.ndarray
    residual_m: np.ndarray
    place_m: np.ndarray
    trusted_m: np.ndarray
    parents: dict[str, str]
    pose: dict[str, np.ndarray]
    respond: Callable[[], np.ndarray]

    @cached_property
    def response(self) -> np.ndarray:
        """(m, 3, m, 3) change of the residual of a marker (first) for each metre by which another
        (third) moves on its segment: the pose follows the marker and bends the others."""
        return self.respond()

    def distance_m(self, m: int | slice = slice(None)) -> np.ndarray:
        """(N, m) distance of each marker from its model, NaN where missing; of one marker (N,)."""
        return np.linalg.norm(self.residual_m[:, m], axis=-1)

    def noise_m(self) -> float:
        """Noise of a marker, each direction: from second differences of the residuals."""
        bends = np.linalg.norm(np.diff(self.residual_m, n=2, axis=0), axis=2)
        bends = bends[np.isfinite(bends)]
        return float(np.median(bends)) / MEDIAN_LENGTH / 6**0.5 if len(bends) else 0.0

    def step_s(self) -> float:
        """Time between two frames."""
        return float(np.median(np.diff(self.times_s))) if len(self.times_s) > 1 else 1.0


def marker_fit(
    person: Person,
    markers_m: np.ndarray,
    q: np.ndarray,
    times_s: np.ndarray,
    *,
    marker_sd_m: float,
    robust_limit_m: float,
) -> MarkerFit:
    """Compare fitted poses q (N, nq) with the markers (N, m, 3) in the order of the person's.

    ``marker_sd_m`` and ``robust_limit_m`` are those of the inverse kinematics.
    """
    R, p = tree_of(person).forward(q)
    model = model_markers(person, R, p)
    turns = R[:, person.marker_segments]
    residual = np.einsum("fmji,fmj->fmi", turns, markers_m - model)
    names = person.skeleton.segments
    carried = {s: names[k] for s, k in zip(names, person.skeleton.parents, strict=True) if k >= 0}
    return MarkerFit(
        person.markers,
        tuple(names[k] for k in person.marker_segments),
        times_s,
        markers_m,
        model,
        residual,
        person.marker_positions_m,
        marker_sd_m / np.sqrt(np.maximum(person.marker_weights, 1e-6)),
        carried,
        {names[k]: _pose(person, q, int(k)) for k in np.unique(person.marker_segments)},
        partial(_response, person, residual, R, p, model, marker_sd_m, robust_limit_m),
    )


def _pose(person: Person, q: np.ndarray, segment: int) -> np.ndarray:
    """(N, k) angles [rad] about a segment, which its skin may follow: hinge angles, and twice the
    vector parts of quaternions (the turn, where it is small)."""
    skeleton, columns = person.skeleton, []
    for i, kind in enumerate(skeleton.joint_types):
        if kind == "free" or (i != segment and skeleton.parents[i] != segment):
            continue
        at = skeleton.q_starts[i]
        if kind == "revolute":
            columns.append(q[:, at : at + 1])
        else:
            columns.append(2.0 * q[:, at : at + 3] * np.where(q[:, at + 3 : at + 4] < 0, -1.0, 1.0))
    return np.concatenate(columns, axis=1) if columns else np.empty((len(q), 0))


def _response(
    person: Person,
    residual_m: np.ndarray,
    R: np.ndarray,
    p: np.ndarray,
    model: np.ndarray,
    marker_sd_m: float,
    limit_m: float,
) -> np.ndarray:
    """(m, 3, m, 3) I - J (J' W J + prior)^-1 J' W in segment axes, mean over some frames.

    W holds the weights that the robust loss leaves: a marker far off bends the pose little.
    """
    frames = np.unique(np.linspace(0, len(R) - 1, _RESPONSE_FRAMES).astype(int))
    tree, m = tree_of(person), len(person.markers)
    columns = pose_columns(tree, R[frames], p[frames], model[frames], subtrees(person))
    turns = R[frames][:, person.marker_segments]
    columns = np.einsum("fmji,fmjv->fmiv", turns, columns).reshape(len(frames), 3 * m, tree.nv)
    total, seen_total = np.zeros((3 * m, 3 * m)), np.zeros(m)
    trust = marker_trust(residual_m[frames], limit_m)
    for columns_f, share in zip(columns, trust, strict=True):
        seen = share > 0
        weight = np.repeat(person.marker_weights / marker_sd_m**2 * share, 3)
        information = columns_f.T @ (weight[:, None] * columns_f)
        information[range(6, tree.nv), range(6, tree.nv)] += _POSTURE_SD_RAD**-2
        information[range(tree.nv), range(tree.nv)] += 1e-9 * np.trace(information) / tree.nv
        gain = np.linalg.solve(information, (weight[:, None] * columns_f).T)
        total += columns_f @ gain * np.repeat(seen, 3)[None]
        seen_total += seen
    mean = total / np.repeat(np.maximum(seen_total, 1), 3)[None]
    return (np.eye(3 * m) - mean).reshape(m, 3, m, 3)


def best_source(
    response: np.ndarray, field: np.ndarray, sd: np.ndarray, candidates: list[int]
) -> tuple[int, np.ndarray]:
    """Which one marker's displacement explains a field of residuals best.

    response : as of :class:`MarkerFit`.
    field : (m, 3) residuals or changes of them, NaN where unknown; ``sd`` (m,).
    candidates : markers to choose from.

    Returns the marker and its displacement (3,) [m] on the segment, drawn to zero where the pose
    would follow it anyway.
    """
    known = np.flatnonzero(np.isfinite(sd) & np.isfinite(field[:, 0]))
    weight = np.repeat(1.0 / sd[known], 3)
    y = weight * field[known].ravel()
    fits = []
    for m in candidates:
        A = weight[:, None] * response[known, :, m].reshape(-1, 3)
        vector = np.linalg.solve(A.T @ A + np.eye(3) / _USUAL_M**2, A.T @ y)
        left = float(((y - A @ vector) ** 2).sum() + (vector**2).sum() / _USUAL_M**2)
        fits.append((left, m, vector))
    _, m, vector = min(fits, key=lambda one: one[0])
    return m, vector
