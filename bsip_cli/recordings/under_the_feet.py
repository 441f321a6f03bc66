"""Is this the force under a foot? What one trial shows of one plate, and how likely a person is.

One measure for every format and every way in which a plate's numbers may be misunderstood: centre
of pressure against the feet on the ground, against the outline and the sensor, the moments at it.
The scales are those of 130 sound plates of 40 public recordings: the centre of pressure lies within
the feet's markers in the median and 85 mm beside them at most (sets with two markers on a foot);
the vertical moment over the force is 3 mm, in golf swings 60.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from bsip_cli.recordings.plate_source import LeftMoment
from bsip_cli.recordings.plates import cop_at_height

BESIDE_M = 0.12
"""Half a foot's length: a centre of pressure so far beside the feet is not under them."""

_DISTANCE_M, _TORQUE_M, _LEVEL_M = 0.03, 0.05, 0.005  # where the likelihood begins to fall
_LEVER_M = 0.05  # nobody stands nearer to the very middle of a plate but by chance
_LEAST = 1e-9
_OUTLINE = -4.6  # an outline is stated wrongly in one laboratory of a hundred
_INDEPENDENT = 3.0  # numbers of a trial that must agree by chance
_LEAST_SHARE, _HAIR_M = 1e-3, 1e-5  # how nearly they can
_FURTHEST_M = 1e4
_LOW_M = 0.17  # ankles and below
_LIFT_M = 0.035  # over a marker's own lowest height: the foot is in the air
_RIM_M = 0.05


@dataclass(frozen=True, eq=False)
class Feet:
    """Horizontal places of foot markers on the ground, (n, k, 2); NaN: in the air, unseen."""

    points_m: np.ndarray

    @classmethod
    def of(cls, markers_m: np.ndarray, frames: np.ndarray, floor_m: float) -> Feet:
        """From a trial's markers (n_frames, n_markers, 3), world frame, at some frames (n,)."""
        height = markers_m[..., 2] - floor_m
        lowest = _lowest(height)
        feet = np.flatnonzero(lowest < _LOW_M)
        points = markers_m[np.ix_(frames, feet)][..., :2].copy()
        points[height[np.ix_(frames, feet)] - lowest[feet] > _LIFT_M] = np.nan
        return cls(points)

    def on(self, corners_m: np.ndarray | None) -> Feet:
        """Those on a plate of these corners (4, 3), where any are, else all."""
        if corners_m is None:
            return self
        centre = corners_m.mean(axis=0)[:2]
        inside: np.ndarray = np.ones(self.points_m.shape[:2], bool)
        for side in (corners_m[0] - corners_m[1], corners_m[0] - corners_m[3]):
            length = np.linalg.norm(side[:2])
            along = (self.points_m - centre) @ side[:2] / length
            inside &= np.abs(along) <= length / 2 + _RIM_M
        kept = np.where(inside[..., None], self.points_m, np.nan)
        some = np.any(inside, axis=1, keepdims=True)
        return Feet(np.where(some[..., None], kept, self.points_m))

    def moved(self, change: np.ndarray) -> Feet:
        """In other axes of the world (3, 3)."""
        return Feet(self.points_m @ change[:2, :2].T)

    def area(self) -> Area:
        """The smallest convex area that holds the markers, at each of the n samples."""
        hulls = [_hull(points[np.isfinite(points).all(axis=1)]) for points in self.points_m]
        most = max((len(hull) for hull in hulls), default=0)
        corners = np.full((len(hulls), most + 1, 2), np.nan)
        for row, hull in zip(corners, hulls, strict=True):
            row[: len(hull)] = hull
            row[len(hull) :] = hull[:1] if len(hull) else np.nan  # closed
        return Area(corners)


@dataclass(frozen=True, eq=False)
class Area:
    """Convex areas, (n, h + 1, 2): corners counter-clockwise, the first one again; NaN: none."""

    corners_m: np.ndarray

    def at(self, samples: np.ndarray) -> Area:
        return Area(self.corners_m[samples])

    def distance_m(self, places_m: np.ndarray) -> np.ndarray:
        """Of places (n, 2), 0 inside, NaN where there is no area, (n,)."""
        start, end = self.corners_m[:, :-1], self.corners_m[:, 1:]
        if not start.shape[1]:
            return np.full(len(places_m), np.nan)
        along, offset = end - start, places_m[:, None] - start
        length2 = (along**2).sum(axis=-1)
        share = (offset * along).sum(axis=-1) / np.where(length2 > 0, length2, 1.0)
        gap = np.linalg.norm(offset - np.clip(share, 0, 1)[..., None] * along, axis=-1).min(axis=1)
        left = along[..., 0] * offset[..., 1] - along[..., 1] * offset[..., 0]
        is_area = (length2 > 0).sum(axis=1) >= 3
        return np.where(is_area & (left >= 0).all(axis=1), 0.0, gap)


def _hull(points: np.ndarray) -> np.ndarray:
    """Corners of the convex hull of points (k, 2), counter-clockwise (Andrew's monotone chain)."""
    ordered = sorted({(x, y) for x, y in points.tolist()})
    if len(ordered) < 3:
        return np.array(ordered).reshape(-1, 2)
    chains: list[list[tuple[float, float]]] = []
    for some in (ordered, ordered[::-1]):
        chain: list[tuple[float, float]] = []
        for point in some:
            while len(chain) > 1 and _turn(chain[-2], chain[-1], point) <= 0:
                chain.pop()
            chain.append(point)
        chains.append(chain[:-1])
    return np.array(chains[0] + chains[1])


def _turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    """Positive where a, b, c turn left."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


@dataclass(frozen=True)
class Evidence:
    """What a reading makes of a plate's numbers in one trial [m]; NaN where it cannot be known.

    distance_m : of the centre of pressure from the feet, mean; outside_m : from the outline, mean;
    sway_m : its standard deviation; lever_m : its distance from the sensor as the moments have it;
    torque_m, level_m : vertical and horizontal moment at it over the force, median; level_share :
    of the horizontal moment as written, what a reading leaves [1].
    """

    distance_m: float
    outside_m: float
    sway_m: float
    lever_m: float
    torque_m: float
    level_m: float
    level_share: float

    def log_likelihood(self) -> float:
        """Up to a constant: how likely a person's foot makes such numbers, natural logarithm."""
        terms = [
            -2.0 * np.log1p((size / scale) ** 2)
            for size, scale in (
                (self.distance_m, _DISTANCE_M),
                (self.torque_m, _TORQUE_M),
                (self.level_m, _LEVEL_M),
            )
        ]
        outside = -2.0 * np.log1p((self.outside_m / _DISTANCE_M) ** 2)
        terms.append(np.clip(outside, _OUTLINE, 0.0))
        terms.append(self.lever_log_likelihood())
        terms.append(-_INDEPENDENT * np.log(np.maximum(self.level_share, _LEAST_SHARE)))
        return float(np.nansum(terms))

    def lever_log_likelihood(self) -> float:
        """The part of how the moments go with a lever about the sensor: it tells readings from one
        another, and no person from nobody, since a file may give moments about its own origin."""
        return float(2.0 * np.log(np.clip(self.lever_m / _LEVER_M, _LEAST, 1.0)))

    @classmethod
    def mean(cls, found: Sequence[Evidence]) -> Evidence:
        """Over several trials, of what is known in them."""
        rows = np.array([[getattr(one, f.name) for f in fields(cls)] for one in found])
        known = np.isfinite(rows)
        count = np.where(known.any(axis=0), known.sum(axis=0), np.nan)
        return cls(*(np.where(known, rows, 0.0).sum(axis=0) / count).tolist())


def evidence(
    force_N: np.ndarray,
    moment_Nm: np.ndarray,
    left: LeftMoment | None,
    lever_m: np.ndarray | None,
    feet: Area,
    corners_m: np.ndarray | None,
    floor_m: float,
) -> Evidence:
    """Of loaded samples: force (n, 3), moment about the world origin (n, 3), the feet on
    its place.

    ``left``: what is left at the points that the file calls centres of pressure; ``lever_m`` (n,):
    from the sensor to where its moments have the force, None where there is no sensor.
    """
    cop = np.clip(cop_at_height(force_N, moment_Nm, floor_m), -_FURTHEST_M, _FURTHEST_M)
    known = np.isfinite(cop).all(axis=1)
    if not known.any():
        return Evidence(*[np.nan] * len(fields(Evidence)))
    load = np.abs(force_N[:, 2])
    torque = moment_Nm[:, 2] - cop[:, 0] * force_N[:, 1] + cop[:, 1] * force_N[:, 0]
    gap = feet.distance_m(cop)
    return Evidence(
        distance_m=float(np.nanmean(gap)) if np.isfinite(gap).any() else np.nan,
        outside_m=np.nan if corners_m is None else float(np.nanmean(_outside(cop, corners_m))),
        sway_m=_spread(cop[known]),
        lever_m=np.nan if lever_m is None else float(np.sqrt(np.nanmean(lever_m**2))),
        torque_m=float(np.nanmedian(np.abs(torque) / load)),
        level_m=np.nan if left is None else float(np.nanmedian(left.read / load)),
        level_share=np.nan if left is None else _share(left, load),
    )


def _spread(places_m: np.ndarray) -> float:
    """Standard deviation of places (n, 2) about their median, 0 where nothing is known."""
    known = places_m[np.isfinite(places_m).all(axis=1)]
    if not len(known):
        return 0.0
    return float(np.sqrt(np.mean(np.sum((known - np.median(known, axis=0)) ** 2, axis=1))))


def _share(left: LeftMoment, load_N: np.ndarray) -> float:
    """Root mean square of what is left over that of what is written, to a hair of the force."""
    hair = _HAIR_M * load_N.mean()
    read, written = (np.sqrt(np.nanmean(x**2)) for x in (left.read, left.written))
    return float((read + hair) / (written + hair))


def _lowest(height_m: np.ndarray) -> np.ndarray:
    """2nd percentile of each marker's heights (n_frames, n_markers), infinite if never seen."""
    seen = np.isfinite(height_m)
    columns = zip(height_m.T, seen.T, strict=True)
    return np.array([np.percentile(z[k], 2) if k.any() else np.inf for z, k in columns])


def _outside(cop_m: np.ndarray, corners_m: np.ndarray) -> np.ndarray:
    """Distance of centres of pressure (n, 2) from the outline, 0 inside, (n,)."""
    centre = corners_m.mean(axis=0)[:2]
    beyond = np.zeros(len(cop_m))
    for side in (corners_m[0] - corners_m[1], corners_m[0] - corners_m[3]):
        length = np.linalg.norm(side[:2])
        along = np.abs((cop_m - centre) @ side[:2] / length)
        beyond = np.hypot(beyond, np.maximum(along - length / 2, 0.0))
    return beyond
