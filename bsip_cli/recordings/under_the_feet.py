"""Is this the force under a foot? What one trial shows of one plate, and how likely a person is.

One measure for every format and every way in which a plate's numbers may be misunderstood: centre
of pressure against the feet on the ground, against the outline and the sensor, the moments at it.
The scales are those of 130 sound plates of 40 public recordings: the centre of pressure lies within
the feet's markers in the median and 85 mm beside them at most (sets with two markers on a foot);
the vertical moment over the force is 3 mm, in golf swings 60, in one quiet stance 0.024 at least;
the lowest marker of a foot is 0 to 102 mm above the surface, a computed one 46 mm below it.
Whoever passes over a plate rolls over the foot: where the body goes by 0.3 m or more, the centre of
pressure spreads by 20 to 97 mm (65 plates; a runner's forefoot 24 to 34).

A leg can turn little about its hip, so that the force under a foot leans from its centre of
pressure towards the body: of the slope to the centre of mass it has 0.63 in the median over 66
plates of 33 public trials in which each foot has a plate of its own, quiet stance, squats, gait and
jumps alike; half are within 0.18 of it in size and direction, nine of ten within 0.4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from bsip_cli.recordings.label_words import meanings
from bsip_cli.recordings.plates import cop_at_height

BESIDE_M = 0.12
"""Half a foot's length: a centre of pressure so far beside the feet is not under them."""

STAYS_M = 0.01
"""Half of the least spread of a centre of pressure over which a body passes, see above."""

PASSES_M = 0.3

LOWEST_M = (-0.06, 0.17)
"""Where, over the surface, a foot's lowest marker is: computed ones err, some sets have ankles."""

_DISTANCE_M, _TORQUE_M, _LEVEL_M = 0.03, 0.05, 0.005  # where the likelihood begins to fall
_ROUNDING_M = 1e-9
_LITTLE_TORQUE_M = 3e-5  # below it the likelihood falls too: soles hardly make less
_LEAN, _ASTRAY = 0.63, 0.18  # of the slope to the body, and half of all are so far from it
_PLACE_M = 0.024  # the markers show where the body is, to this: see balance_median_m
_LEVER_M = 0.05  # nobody stands nearer to the very middle of a plate but by chance
_LEAST = 1e-9
_RARE = -4.6  # an outline is stated wrongly, vertical moments are left out, in one file of 100
_INDEPENDENT = 3.0  # numbers of a trial that must agree by chance
_LEAST_SHARE, _HAIR_M = 1e-3, 1e-5  # how nearly they can
_FURTHEST_M, _NO_LOAD_N = 1e4, 1e-6
_LIFT_M = 0.035  # over a marker's own lowest height: the foot is in the air
_RIM_M = 0.05
# A distance is short by 1 - cos(2.5 degrees), a thousandth, between two of these.
_ANGLES = np.deg2rad(np.arange(0.0, 360.0, 5.0))
_DIRECTIONS = np.array([np.cos(_ANGLES), np.sin(_ANGLES)])  # (2, k)


@dataclass(frozen=True, eq=False)
class Feet:
    """Places of foot markers on the ground, (n, k, 3); NaN: in the air, unseen.

    sides : whose they are, "l", "r" or empty, k of them. is_foot : by what their labels say, (k,).
    """

    points_m: np.ndarray
    sides: tuple[str, ...]
    is_foot: tuple[bool, ...] = ()

    @classmethod
    def of(
        cls,
        labels: Sequence[str],
        markers_m: np.ndarray,
        frames: np.ndarray,
        floors_m: Sequence[float],
    ) -> Feet:
        """From a trial's markers (n_frames, n_markers, 3), world frame, at some frames (n,); the
        surfaces, of a step too, are where the plates have them, unless feet can never stand
        there."""
        known = meanings(labels)
        sides = [known[n].segment[-1] if n in known else "" for n in labels]
        is_foot = np.array([n in known and known[n].is_of_foot for n in labels], bool)
        standing = lowest(markers_m[..., 2])
        sole = standing[is_foot].min(initial=np.inf)
        floors = np.unique(floors_m)
        if np.isfinite(sole) and not any(is_on_surface(sole - floor) for floor in floors):
            floors = np.array([sole])
        above = standing[:, None] - floors
        on_some = is_foot & ((above > LOWEST_M[0]) & (above < LOWEST_M[1])).any(axis=1)
        feet = np.flatnonzero((above[:, 0] < LOWEST_M[1]) | on_some)
        own = np.where(above > LOWEST_M[0], floors, floors[0]).max(axis=1)[feet]
        points = markers_m[np.ix_(frames, feet)]
        lift = (points[..., 2] - standing[feet] + own)[..., None] - floors
        points[(lift[..., 0] > _LIFT_M) & (np.abs(lift) > _LIFT_M).all(axis=-1)] = np.nan
        return cls(
            points,
            tuple(sides[k] if sides[k] in "lr" else "" for k in feet.tolist()),
            tuple(is_foot[feet].tolist()),
        )

    def on(self, corners_m: np.ndarray | None) -> Feet:
        """Those on a plate of these corners (4, 3), where any are, else all."""
        if corners_m is None:
            return self
        beyond = _beyond(self.points_m[..., :2], corners_m)
        inside = (beyond <= _RIM_M).all(axis=-1)
        some = np.any(inside, axis=1, keepdims=True)
        points = np.where((inside | ~some)[..., None], self.points_m, np.nan)
        return replace(self, points_m=points)

    def all_on(self, outlines: Sequence[np.ndarray]) -> bool:
        """Whether both feet are seen and each of their markers on the ground is on a plate of these
        corners (4, 3)."""
        on = np.isnan(self.points_m[..., 0])
        for corners_m in outlines:
            on = on | (_beyond(self.points_m[..., :2], corners_m) <= _RIM_M).all(axis=-1)
        return self.both_seen and bool(outlines) and bool(on.all())

    @property
    def both_seen(self) -> bool:
        return {"l", "r"} <= set(self.sides)

    def of_side(self, side: str) -> Feet:
        (mine,) = np.nonzero([one == side for one in self.sides])
        return Feet(self.points_m[:, mine], (side,) * len(mine), (*np.take(self.is_foot, mine),))

    def at(self, samples: np.ndarray) -> Feet:
        return replace(self, points_m=self.points_m[samples])

    def moved(self, change: np.ndarray) -> Feet:
        """In other axes of the world (3, 3)."""
        return replace(self, points_m=self.points_m @ change.T)

    def lowest_m(self) -> np.ndarray:
        """Height of each foot's lowest marker whose label says that it is on one, (k, n); NaN
        without."""
        heights = np.where(self.is_foot, self.points_m[..., 2], np.nan)
        feet = ([side == one for side in self.sides] for one in dict.fromkeys(self.sides))
        low_m = [np.fmin.reduce(heights[:, own], axis=1) for own in feet]
        return np.array(low_m).reshape(-1, len(heights))

    def distance_m(self, places_m: np.ndarray, apart: np.ndarray) -> np.ndarray:
        """Of places (..., n, 2) from the convex area of the markers, 0 inside, NaN without any;
        from that of the nearer foot where each stands ``apart`` (n,), on a plate of its own."""
        both = self._distance_m(places_m, [True] * len(self.sides))
        if not self.both_seen:
            return both
        each = [self._distance_m(places_m, [one != other for one in self.sides]) for other in "lr"]
        nearer = np.fmin(*each)
        return np.where(apart & np.isfinite(nearer), nearer, both)

    def _distance_m(self, places_m: np.ndarray, columns: Sequence[bool]) -> np.ndarray:
        """The largest, over all directions, by which a place lies further out than every marker."""
        some = self.points_m[:, np.array(columns, bool), :2]
        reach = some @ _DIRECTIONS  # (n, k, directions)
        furthest = np.max(np.where(np.isfinite(reach), reach, -np.inf), axis=1, initial=-np.inf)
        beyond = np.max(places_m @ _DIRECTIONS - furthest, axis=-1)
        return np.where(np.isfinite(beyond), np.maximum(beyond, 0.0), np.nan)


@dataclass(frozen=True)
class Evidence:
    """What a reading makes of a plate's numbers [m]; NaN where it cannot be known.

    distance_m : of the centre of pressure from the feet, mean; outside_m : from the outline, mean;
    above_m : the lowest marker of a foot above the surface, median; sway_m : the standard deviation
    of the place, and rolls_m where a body passes; lever_m : its distance from the sensor as the
    moments have it; torque_m, level_m : vertical and horizontal moment at it over the force,
    median; level_share : of the horizontal moment as written, what a reading leaves [1]; astray :
    how far the force under one foot of two is from leaning towards the body, over the slope to its
    centre of mass [1].
    """

    distance_m: float
    outside_m: float
    above_m: float
    sway_m: float
    rolls_m: float
    lever_m: float
    torque_m: float
    level_m: float
    level_share: float
    astray: float


FIELDS = tuple(field.name for field in fields(Evidence))


def evidence(
    wrench: np.ndarray,
    floor_m: np.ndarray,
    feet: Feet,
    apart: np.ndarray,
    corners_m: np.ndarray | None,
    lever_m: np.ndarray | None,
    level_Nm: tuple[np.ndarray, np.ndarray] | None,
    body_m: np.ndarray,
    passes: np.ndarray,
) -> np.ndarray:
    """What each of r readings makes of n loaded samples, (r, 10): columns as in `Evidence`.

    wrench : (r, n, 6), about the world's origin. floor_m : (r,). feet : on the plate's place.
    apart : (n,), where each foot stands on a plate of its own.
    lever_m : (r, n), from the sensor to where its moments have the force; None without a sensor.
    level_Nm : horizontal moment (r, n) at the points that the file calls centres of pressure, as
    read and as written; None without such points. body_m : the centre of mass (n, 3).
    passes : (n,), where a body goes over the plate, which bears it alone.
    """
    force, moment = wrench[..., :3], wrench[..., 3:]
    load = np.maximum(np.abs(force[..., 2]), _NO_LOAD_N)
    cop = cop_at_height(force, moment, floor_m[:, None])
    cop = np.nan_to_num(np.clip(cop, -_FURTHEST_M, _FURTHEST_M), nan=_FURTHEST_M)  # without load
    known = np.isfinite(wrench).all(axis=(0, 2))
    if not known.any():
        return np.full((len(wrench), len(FIELDS)), np.nan)
    force, moment, load, cop = (x[:, known] for x in (force, moment, load, cop))
    torque = moment[..., 2] - cop[..., 0] * force[..., 1] + cop[..., 1] * force[..., 0]
    table = np.full((len(FIELDS), len(wrench)), np.nan)
    table[0] = _mean(feet.at(known).distance_m(cop, apart[known]))
    if corners_m is not None:
        table[1] = _mean(np.linalg.norm(_beyond(cop, corners_m), axis=-1))
    above = feet.at(known).lowest_m()[:, None] - floor_m[:, None]
    if np.isfinite(above).any():  # of the foot that is nearer to the surface: one may be on a step
        nearer = np.where(np.isfinite(above), np.abs(above), np.inf).argmin(axis=0)
        table[2] = np.nanmedian(np.take_along_axis(above, nearer[None], 0)[0], axis=1)
    table[3] = _spread(cop)
    if passes[known].any():
        table[4] = _spread(cop[:, passes[known]])
    if lever_m is not None:
        table[5] = np.sqrt(_mean(lever_m[:, known] ** 2))
    table[6] = np.median(np.abs(torque) / load, axis=1)
    table[6][table[6] < _ROUNDING_M] = np.nan  # none is written
    if level_Nm is not None:
        read, written = (x[:, known] for x in level_Nm)
        table[7], table[8] = np.median(read / load, axis=1), _left_share(read, written, load)
    table[9] = _astray(force, cop, floor_m, body_m[known], apart[known])
    return table.T


def log_likelihood(found: np.ndarray) -> np.ndarray:
    """Up to a constant: how likely a person's foot makes such numbers (..., 10), logarithm."""
    distance, outside, _, _, rolls, _, torque, level, share, astray = np.moveaxis(found, -1, 0)
    terms = [
        falling(distance, _DISTANCE_M),
        np.clip(falling(outside, _DISTANCE_M), _RARE, 0.0),
        lever_log_likelihood(found),
        falling(STAYS_M, np.maximum(rolls, _HAIR_M)),
        falling(torque, _TORQUE_M),
        np.maximum(falling(_LITTLE_TORQUE_M, torque), _RARE),
        falling(level, _LEVEL_M),
        falling(astray, _ASTRAY),
        -_INDEPENDENT * np.log(np.maximum(share, _LEAST_SHARE)),
    ]
    return np.nansum(terms, axis=0)


def lever_log_likelihood(found: np.ndarray) -> np.ndarray:
    """The part of how the moments go with a lever about the sensor: it distinguishes readings, and
    no person from nobody, since a file may give moments about its own origin."""
    return np.nan_to_num(2.0 * np.log(np.clip(found[..., 5] / _LEVER_M, _LEAST, 1.0)))


def mean_evidence(found: np.ndarray) -> Evidence:
    """Over several trials (n, 10), of what is known in them."""
    return Evidence(*_mean(found.T).tolist())


def is_on_surface(above_m: float) -> bool:
    """Whether the lowest marker of a foot on the ground may be so far above the surface."""
    return LOWEST_M[0] < above_m < LOWEST_M[1]


def falling(size: float | np.ndarray, scale: float | np.ndarray) -> np.ndarray:
    """Logarithm of a likelihood of sizes (...) that most often are below ``scale``: Student's t."""
    return -2.0 * np.log1p((size / scale) ** 2)


def _mean(values: np.ndarray) -> np.ndarray:
    """Over the last axis, of what is known; NaN if nothing is."""
    known = np.isfinite(values)
    count = known.sum(axis=-1)
    total = np.where(known, values, 0.0).sum(axis=-1)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)


def _spread(places_m: np.ndarray) -> np.ndarray:
    """Standard deviation of places (r, n, 2) about their median, (r,)."""
    away = places_m - np.median(places_m, axis=1, keepdims=True)
    return np.sqrt((away**2).sum(axis=-1).mean(axis=-1))


def _left_share(read: np.ndarray, written: np.ndarray, load_N: np.ndarray) -> np.ndarray:
    """Root mean square of what is left over that of what is written, to a hair of the force."""
    hair = _HAIR_M * load_N.mean(axis=-1)
    left, whole = (np.sqrt((x**2).mean(axis=-1)) for x in (read, written))
    return (left + hair) / (whole + hair)


def _astray(
    force: np.ndarray, cop_m: np.ndarray, floor_m: np.ndarray, body_m: np.ndarray, apart: np.ndarray
) -> np.ndarray:
    """Least squares of what forces (r, n, 3) lean beyond their part of the slope to the body, in
    size and direction, (r,): a short slope, which errors of the place may be, counts less."""
    some = apart & np.isfinite(body_m).all(axis=1)
    if not some.any():
        return np.full(len(force), np.nan)
    height = body_m[some, 2] - floor_m[:, None]
    level = np.array([1.0, 1j])
    slope = (body_m[some, :2] - cop_m[:, some]) @ level / height
    lift = force[:, some, 2]
    lean = force[:, some, :2] @ level / np.copysign(np.maximum(np.abs(lift), _NO_LOAD_N), lift)
    beyond = ((lean - _LEAN * slope) * slope.conj()).sum(axis=1)
    return np.abs(beyond) / (np.abs(slope) ** 2 + (_PLACE_M / height) ** 2).sum(axis=1)


def lowest(height_m: np.ndarray) -> np.ndarray:
    """2nd percentile of each marker's heights (n_frames, n_markers), infinite if never seen."""
    seen = np.isfinite(height_m)
    columns = zip(height_m.T, seen.T, strict=True)
    return np.array([np.percentile(z[k], 2) if k.any() else np.inf for z, k in columns])


def outline(places_m: np.ndarray, corners_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How far places (..., 2) are from a plate's middle along its sides, (..., 2), and half of
    these sides, (2,)."""
    sides = np.array([corners_m[0] - corners_m[1], corners_m[0] - corners_m[3]])[:, :2]
    length = np.linalg.norm(sides, axis=1)
    return np.abs((places_m - corners_m.mean(axis=0)[:2]) @ (sides.T / length)), length / 2


def _beyond(places_m: np.ndarray, corners_m: np.ndarray) -> np.ndarray:
    """How far places (..., 2) lie outside an outline, along its sides, (..., 2)."""
    along, half = outline(places_m, corners_m)
    return np.maximum(along - half, 0.0)
