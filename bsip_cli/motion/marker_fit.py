"""One trial's markers against the fitted model: what the search for bad markers reads."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bsip_cli.body.person import Person
from bsip_cli.motion.inverse_kinematics import marker_trust, normal_matrix, posed

Uncertain = tuple[float, float]
"""A number and its standard deviation."""

_RESPONSE_FRAMES = 16
_POSTURE_SD_RAD = 3.0
# Median length of a three-dimensional normal vector of unit spread.
MEDIAN_LENGTH = 1.538
_LARGEST_M = 0.2  # a marker farther off says no more
# Nothing is reported that stays within this many times what a marker is trusted to.
BEYOND = 1.5
_SHOWN = 0.5  # of a displacement, at least, by the distances to the segment's other markers
_SURE = 2.0  # standard deviations
_USUAL_M = 0.03  # how far a displaced marker moves, before the data speak


@dataclass(frozen=True, eq=False)
class MarkerFit:
    """Markers of N frames and the poses fitted to them.

    q : (N, nq); times_s : (N,).
    measured_m, model_m : (N, m, 3) world; NaN where a marker is missing.
    residual_m : (N, m, 3) measured less model, in the axes of the marker's segment.
    marker_sd_m, robust_limit_m : of the inverse kinematics.
    strays_m : (m,) how far it was from its place in the frames that scaled the person, RMS.
    """

    person: Person
    q: np.ndarray
    times_s: np.ndarray
    measured_m: np.ndarray
    model_m: np.ndarray
    residual_m: np.ndarray
    marker_sd_m: float
    robust_limit_m: float
    strays_m: np.ndarray

    @property
    def labels(self) -> tuple[str, ...]:
        """(m,) names of the markers."""
        return self.person.markers

    @cached_property
    def segments(self) -> tuple[str, ...]:
        """(m,) names of the segments they sit on."""
        return tuple(self.person.skeleton.segments[k] for k in self.person.marker_segments)

    @cached_property
    def trusted_m(self) -> np.ndarray:
        """(m,) what a marker's position is trusted to, as in the inverse kinematics."""
        return self.marker_sd_m / np.sqrt(np.maximum(self.person.marker_weights, 1e-6))

    @cached_property
    def response(self) -> np.ndarray:
        """(m, 3, m, 3) change of the residual of a marker (first) for each metre by which another
        (third) moves on its segment: the pose follows the marker and bends the others.

        I - J (J' W J + prior)^-1 J' W in segment axes, mean over some frames. W holds the weights
        that the robust loss leaves: a marker far off bends the pose little.
        """
        frames = np.unique(np.linspace(0, len(self.q) - 1, _RESPONSE_FRAMES).astype(int))
        at, m = posed(self.person, self.q[frames]), len(self.labels)
        columns = np.einsum("fmji,fmjv->fmiv", at.turns(), at.columns())
        trust = marker_trust(self.residual_m[frames], self.robust_limit_m)
        weights = trust * self.person.marker_weights / self.marker_sd_m**2
        information = normal_matrix(columns, weights)
        every = np.arange(columns.shape[3])
        information[:, every[6:], every[6:]] += _POSTURE_SD_RAD**-2
        mean = np.trace(information, axis1=1, axis2=2)[:, None] / len(every)
        information[:, every, every] += 1e-9 * mean
        rows, weight = columns.reshape(len(frames), 3 * m, -1), np.repeat(weights, 3, axis=1)
        gain = np.linalg.solve(information, (weight[..., None] * rows).swapaxes(1, 2))
        seen = np.repeat(trust > 0, 3, axis=1)
        follows = (rows @ gain * seen[:, None]).sum(axis=0) / np.maximum(seen.sum(axis=0), 1)
        return (np.eye(3 * m) - follows).reshape(m, 3, m, 3)

    def angles_about(self, segment: int) -> np.ndarray:
        """(N, k) angles [rad] about a segment, which its skin may follow: hinge angles, and twice
        the vector parts of quaternions (the turn, where it is small)."""
        skeleton, q, columns = self.person.skeleton, self.q, [np.empty((len(self.q), 0))]
        for i, kind in enumerate(skeleton.joint_types):
            at = skeleton.q_starts[i]
            if kind == "free" or (i != segment and skeleton.parents[i] != segment):
                continue
            if kind == "revolute":
                columns.append(q[:, at : at + 1])
            else:
                sign = np.where(q[:, at + 3 : at + 4] < 0, -1.0, 1.0)
                columns.append(2.0 * q[:, at : at + 3] * sign)
        return np.concatenate(columns, axis=1)

    def source_of(
        self, field: np.ndarray, sd: np.ndarray, candidates: list[int]
    ) -> tuple[int, np.ndarray, np.ndarray]:
        """Which one marker's displacement explains a field of residuals best.

        field : (m, 3) residuals or changes of them, NaN where unknown; ``sd`` (m,).
        candidates : markers to choose from.

        Returns the marker, its displacement (3,) [m] on the segment, drawn to zero where the pose
        would follow it anyway, and the residuals (m, 3) that it makes.
        """
        known = np.flatnonzero(np.isfinite(sd) & np.isfinite(field[:, 0]))
        weight = np.repeat(1.0 / sd[known], 3)
        y = weight * field[known].ravel()
        fits = []
        for m in candidates:
            A = weight[:, None] * self.response[known, :, m].reshape(-1, 3)
            vector = np.linalg.solve(A.T @ A + np.eye(3) / _USUAL_M**2, A.T @ y)
            left = float(((y - A @ vector) ** 2).sum() + (vector**2).sum() / _USUAL_M**2)
            fits.append((left, m, vector))
        _, m, vector = min(fits, key=lambda one: one[0])
        return m, vector, np.einsum("jak,k->ja", self.response[:, :, m], vector)

    def is_shown(self, m: int, vector: np.ndarray, longer_m: Mapping[int, Uncertain]) -> bool:
        """Whether the distances to other markers of its segment, which no pose can change, are
        longer, each known to a standard deviation, by what a displacement (3,) of marker ``m`` on
        the segment would make them; where that is less than it is trusted to, in doubt."""
        if not longer_m:
            return True
        places, others = self.person.marker_positions_m, list(longer_m)
        seen, sd = np.array(list(longer_m.values())).T
        apart = places[m] - places[others]
        made = np.linalg.norm(apart + vector, axis=1) - np.linalg.norm(apart, axis=1)
        would_show = np.abs(made).max() > self.trusted_m[m]
        doubt = 0.0 if would_show else _SURE * float(np.linalg.norm(made / sd))
        return bool((made / sd) @ (seen / sd) + doubt > _SHOWN * (made / sd) @ (made / sd))

    def neighbours(self, m: int) -> list[int]:
        """The other markers of its segment."""
        segments = self.person.marker_segments
        return [k for k in np.flatnonzero(segments == segments[m]).tolist() if k != m]

    def apart_m(self, m: int, other: int) -> np.ndarray:
        """(N,) measured distance of two markers, NaN where one is missing."""
        return np.linalg.norm(self.measured_m[:, m] - self.measured_m[:, other], axis=1)

    def distance_m(self) -> np.ndarray:
        """(N, m) distance of each marker from its model, NaN where missing."""
        return np.linalg.norm(self.residual_m, axis=2)

    def misfit_m(
        self,
        m: int | np.ndarray | slice = slice(None),
        frames: np.ndarray | slice = slice(None),
    ) -> float:
        """Root mean square distance of some markers from the model in some frames, where none is
        taken to be larger than 0.2 m."""
        distance = np.linalg.norm(self.residual_m[:, m], axis=-1)[frames]
        near = np.minimum(distance[np.isfinite(distance)], _LARGEST_M)
        return float(np.sqrt(np.mean(near**2))) if len(near) else 0.0

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
    strays_m: np.ndarray | None = None,
) -> MarkerFit:
    """Compare fitted poses q (N, nq) with the markers (N, m, 3) in the order of the person's.

    ``marker_sd_m`` and ``robust_limit_m`` are those of the inverse kinematics; ``strays_m`` (m,) as
    in :class:`MarkerFit`, by default zero.
    """
    at, strays = posed(person, q), np.zeros(len(person.markers)) if strays_m is None else strays_m
    scales = marker_sd_m, robust_limit_m, strays
    residual = at.residuals(markers_m)
    return MarkerFit(person, q, times_s, markers_m, at.markers_m, residual, *scales)
