"""One plate of one recording before it is decided how its numbers are to be understood."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain, combinations, product
from typing import Protocol

import numpy as np
from scipy.ndimage import gaussian_filter1d

from bsip_cli.recordings.model import Finding, Plate, Recording
from bsip_cli.recordings.plate_reading import (
    ALIKE,
    AS_STATED,
    FrameChange,
    PlateReading,
    Reference,
    faults_of_channels,
)
from bsip_cli.recordings.plates import (
    CHANNELS,
    LOADED_N,
    LocalWrench,
    PlateDescription,
    cop_shift_m,
    crossing,
    wrench_matrix,
)
from bsip_cli.recordings.under_the_feet import falling

_THICK_M = 0.3  # no plate's sensors lie so deep under its surface
_Z = np.array([1.0, 1.0, -1.0])
_LEVEL = 0.5  # sine of an axis' slope
_CORNERS = np.array([[1, 1, 1], [-1, 1, -1], [-1, -1, 1], [1, -1, -1]])  # of x, of y, of both
_DIAGONAL = 0.1  # of the load, where the likelihood begins to fall
_MIRRORED = np.array([1.0, 1.0, -1.0, -1.0, -1.0, 1.0])  # a wrench seen in a level mirror
_HARDLY = 0.05  # of a bell: less of it has points
# Of the force: what makers state for a plate's linearity and cross talk. A copy or a sum is the
# same reading and differs by rounding; the loads of two feet differ by tens of per cent mostly.
_SAME, _MOSTLY = 0.01, 0.9
_BEARS = 0.05
_MOST_TERMS = 4  # of a sum
_STILL_M = 1e-6  # points that stay where they are, are no centres of pressure


class PlateSource(Protocol):
    """What every format's plate can say of itself; arrays are at the analog rate."""

    @property
    def name(self) -> str: ...

    @property
    def usable(self) -> np.ndarray:
        """Samples that can be believed, (n,) bool."""

    def parts(self) -> np.ndarray:
        """What every reading combines linearly, (n, k)."""

    def matrix(self, reading: PlateReading) -> np.ndarray:
        """From the parts to the wrench about the world's origin, world frame, (6, k)."""

    def at(self, samples: np.ndarray) -> PlateSource:
        """These samples alone."""

    def later(self, by: int) -> PlateSource:
        """Each sample's ``by``-th after it, not usable where there is none."""

    def smoothed(self, sigma: float) -> PlateSource:
        """Averaged with a bell of a standard deviation of so many samples."""

    def plate(self, reading: PlateReading) -> Plate:
        """In the world frame."""

    def level_matrices(self, reading: PlateReading) -> tuple[np.ndarray, np.ndarray] | None:
        """From the parts to the horizontal moment at the points that the file calls centres of
        pressure, as read and as written, (2, k) each; None where it names no such points."""

    def lever_m(self, reading: PlateReading) -> np.ndarray | None:
        """How far from the sensor, or from the origin of its points, the force is, (n,); None where
        there is neither."""

    def sensors_log_likelihood(self, reading: PlateReading) -> float:
        """How likely a plate's single sensors share its load so, logarithm; 0 without any."""

    def in_place_of(self, other: PlateSource) -> PlateSource:
        """This force where the other one is."""

    def floor_m(self, reading: PlateReading = AS_STATED) -> float:
        """Height of the surface, world frame."""

    def moved(self, change: np.ndarray, corners_only: bool = False) -> PlateSource:
        """In other axes of the world (3, 3), turned or as if seen in a mirror; what channels hold
        is mirrored too unless ``corners_only``."""

    def alternatives(self) -> Iterable[PlateReading]:
        """Other ways to understand the numbers, sign and size of the outline aside."""

    def findings(self, reading: PlateReading) -> list[Finding]:
        """What is to be said of this reading beyond its words."""


def later_samples(n: int, by: int) -> tuple[np.ndarray, np.ndarray]:
    """The ``by``-th after each of n samples, the nearest one where there is none, and where."""
    samples = np.arange(n) + by
    return samples.clip(0, n - 1), (samples >= 0) & (samples < n)


def lift_N(source: PlateSource) -> np.ndarray:
    """Vertical force as the file says, world frame, (n,)."""
    return np.asarray(source.parts() @ source.matrix(AS_STATED)[2])


@dataclass(frozen=True, eq=False)
class Opened:
    """A recording as its file has it, before it is decided how its plates' numbers are understood:
    ``recording`` is without its plates."""

    recording: Recording
    sources: tuple[PlateSource, ...]

    def with_plates(self, numbers: Collection[int]) -> Opened:
        """Only plates of these numbers; without any, all."""
        names = set(map(str, numbers))
        chosen = (source for source in self.sources if not names or source.name in names)
        return replace(self, sources=tuple(chosen))

    def with_forces_from(self, delay_s: float) -> Opened:
        """With the forces of so much later, of a clock that came late."""
        by = round(delay_s * self.recording.analog_rate_hz)
        return replace(self, sources=tuple(one.later(by) for one in self.sources)) if by else self

    def in_frame(self, change: FrameChange) -> Opened:
        """In other axes."""
        recording, sources, matrix = self.recording, self.sources, change.matrix()
        if change.moves_markers:
            recording = replace(recording, markers_m=recording.markers_m @ matrix.T)
        if change.moves_forces:
            sources = tuple(one.moved(matrix, change.corners_only) for one in sources)
        return Opened(recording, sources)


@dataclass(frozen=True, eq=False)
class C3dPlate:
    """A plate of a C3D file, and what its channels have `measured`; mirrored: what they hold is."""

    description: PlateDescription
    measured: np.ndarray  # (n, k)
    usable: np.ndarray  # (n,) bool
    rotation_world_lab: np.ndarray  # (3, 3)
    is_mirrored: bool = False

    @property
    def name(self) -> str:
        return self.description.name

    def parts(self) -> np.ndarray:
        return self.measured

    def local(self, reading: PlateReading) -> np.ndarray:
        """From the parts to the wrench at the sensor's origin, plate frame, (6, k); before the sign
        and the scale of a reading."""
        kind = self.description.kind
        matrix = wrench_matrix(self.description) @ reading.measured_matrix(kind)
        mirror = np.diag(_MIRRORED) if self.is_mirrored else np.eye(6)
        return np.asarray(reading.channel_matrix() @ mirror @ matrix)

    def matrix(self, reading: PlateReading) -> np.ndarray:
        """Without the maker's correction of the centre of pressure, which is no linear one."""
        description = self.read_description(reading)
        axes = self.rotation_world_lab @ description.rotation_lab_plate()
        force, moment = np.split(self.local(reading), 2)
        force = reading.sign * axes @ force
        to_surface = axes @ crossing(self._surface_m(reading)) @ axes.T
        at_centre = crossing(self.rotation_world_lab @ description.centre_m()) - to_surface
        scale = reading.sign * reading.moment_scale
        return np.vstack([force, at_centre @ force + scale * axes @ moment])

    def at(self, samples: np.ndarray) -> C3dPlate:
        return replace(self, measured=self.measured[samples], usable=self.usable[samples])

    def later(self, by: int) -> C3dPlate:
        samples, there = later_samples(len(self.usable), by)
        part = self.at(samples)
        return replace(part, usable=part.usable & there)

    def smoothed(self, sigma: float) -> C3dPlate:
        return replace(self, measured=_smooth(self.measured, self.usable, sigma))

    def plate(self, reading: PlateReading) -> Plate:
        description = self.read_description(reading)
        surface, shift_m = self._at_surface(reading), self._shift_m(reading)
        if shift_m is not None:
            moment = surface.moment_Nm.copy()
            moment[:, 0] -= shift_m[:, 1] * surface.force_N[:, 2]
            moment[:, 1] += shift_m[:, 0] * surface.force_N[:, 2]
            surface = replace(surface, moment_Nm=moment)
        force, moment = surface.to_world(description, self.rotation_world_lab)
        corners = description.corners_m @ self.rotation_world_lab.T
        return Plate(self.name, reading.sign * force, reading.sign * moment, corners, self.usable)

    def level_matrices(self, reading: PlateReading) -> None:
        return None

    def lever_m(self, reading: PlateReading) -> np.ndarray:
        return np.hypot(*self._wrench(reading).cop().T)

    def sensors_log_likelihood(self, reading: PlateReading) -> float:
        """The load at a point of a bending plate goes to the four corners as that point's distances
        from the sides, so that the share of one diagonal less that of the other is the product of
        the point's coordinates. In 13 sound plates of five public laboratories this misses by 0.09
        of the load in the median, by 0.4 at most; of two exchanged neighbours by 0.3."""
        if self.description.kind != 3 or not len(self.measured):
            return 0.0
        corners = (self.measured @ reading.measured_matrix(3).T)[:, 4:]
        along, across, diagonal = (corners @ _CORNERS).T / corners.sum(axis=1)
        missed = np.sqrt(np.mean((diagonal - along * across) ** 2))
        return float(falling(missed, _DIAGONAL))

    def in_place_of(self, other: PlateSource) -> C3dPlate:
        assert isinstance(other, C3dPlate)
        stated = other.description
        if stated.kind != self.description.kind:
            stated = replace(self.description, corners_m=stated.corners_m)
        return replace(self, description=replace(stated, name=self.name))

    def floor_m(self, reading: PlateReading = AS_STATED) -> float:
        return float((self.description.corners_m @ self.rotation_world_lab.T)[:, 2].mean())

    def moved(self, change: np.ndarray, corners_only: bool = False) -> C3dPlate:
        """A mirrored plate's z points out of the floor."""
        corners = self.description.corners_m @ _in_lab(change, self.rotation_world_lab).T
        description = replace(self.description, corners_m=corners)
        is_mirrored = self.is_mirrored != (np.linalg.det(change) < 0 and not corners_only)
        return replace(self, description=description, is_mirrored=is_mirrored)

    def alternatives(self) -> Iterable[PlateReading]:
        """Type 3 has no moments of its own, type 1 no point that they are about."""
        kind = self.description.kind
        scales = (1.0,) if kind == 3 else (1.0, 1e-3, 1e3, -1.0, -1e-3, -1e3)
        abouts: tuple[Reference, ...] = ("stated",)
        if kind in (2, 4) and self.description.origin_m[:2].any():
            abouts += ("reversed", "centred")
        for scale, about, turn, mirrored in product(scales, abouts, range(4), (False, True)):
            yield PlateReading(moment_scale=scale, about=about, turn=turn, mirrored=mirrored)
        for fault in faults_of_channels(ALIKE[kind]):
            yield PlateReading(channels=fault)

    def findings(self, reading: PlateReading) -> list[Finding]:
        """The maker's correction of the centre of pressure; force and vertical moment stay."""
        if (shift_m := self._shift_m(reading)) is None:
            return []
        under_load = shift_m[np.abs(self._at_surface(reading).force_N[:, 2]) > LOADED_N]
        largest_mm = 1e3 * np.max(np.linalg.norm(under_load, axis=1), initial=0.0)
        found = "FPCOPPOLY holds the maker's correction of the centre of pressure"
        action = f"applied it: shifts of up to {largest_mm:.1f} mm under load"
        return [Finding("plate_cop", self.name, found, "", action, "info")]

    def read_description(self, reading: PlateReading) -> PlateDescription:
        """Corners in the order, and the outline in the size, of a reading."""
        corners = self.description.corners_m
        if reading.mirrored:
            corners = corners[[0, 3, 2, 1]]
        read = replace(self.description, corners_m=np.roll(corners, -reading.turn, axis=0))
        if reading.half_size_m is None:
            return read
        local = (read.corners_m - read.centre_m()) @ read.rotation_lab_plate()
        local *= [*(np.array(reading.half_size_m) / read.half_size_m()), 1.0]
        return replace(read, corners_m=read.centre_m() + local @ read.rotation_lab_plate().T)

    def _surface_m(self, reading: PlateReading) -> np.ndarray:
        """From the sensor's origin to the surface, plate frame, (3,): it lies under the surface,
        whichever way the order of the corners turns the plate's z."""
        offset = self.description.surface_offset_m()
        if reading.about != "stated":
            offset = offset * (np.array([-1, -1, 1]) if reading.about == "reversed" else [0, 0, 1])
            offset[2] *= abs(offset[2]) < _THICK_M
        axes = self.rotation_world_lab @ self.read_description(reading).rotation_lab_plate()
        return offset * _Z if axes[2, 2] > 0 else offset

    def _shift_m(self, reading: PlateReading) -> np.ndarray | None:
        """Of the centre of pressure on the surface, (n, 2); None without a maker's polynomial."""
        description = self.read_description(reading)
        if description.cop_polynomial is None:
            return None
        return cop_shift_m(self._at_surface(reading), description)

    def _wrench(self, reading: PlateReading) -> LocalWrench:
        """At the sensor's origin, before the sign of a reading."""
        force, moment = np.split(self.measured @ self.local(reading).T, 2, axis=1)
        return LocalWrench(force, moment * reading.moment_scale)

    def _at_surface(self, reading: PlateReading) -> LocalWrench:
        return self._wrench(reading).at_surface(self._surface_m(reading))


@dataclass(frozen=True, eq=False)
class ForceOnPoint:
    """A force of a table (MOT), with the points that it acts on and moments, both as written.

    All (n, 3), lab frame; a point is zero where there is no force.
    """

    name: str
    force_N: np.ndarray
    points: np.ndarray | None
    moment: np.ndarray
    point_height: float  # median under load, in the points' unit
    points_move: bool
    usable: np.ndarray  # (n,) bool
    rotation_world_lab: np.ndarray  # (3, 3)

    def parts(self) -> np.ndarray:
        """Force, moment, and the products of each coordinate of the point with each force."""
        f = self.force_N
        p = np.zeros_like(f) if self.points is None else self.points
        products = p[:, :, None] * f[:, None]
        return np.hstack([f, self.moment, products.reshape(len(f), 9)])

    def matrix(self, reading: PlateReading) -> np.ndarray:
        moment = self._scaled_moment(reading)
        if self.points is not None:
            left = self._left(reading)
            if reading.about != "stated":
                up = self.rotation_world_lab[2]
                left = np.outer(up, up) @ left
            moment = self._at_origin(reading) + left
        turn = reading.sign * self.rotation_world_lab
        return np.vstack([turn @ self._force(reading), turn @ moment])

    def at(self, samples: np.ndarray) -> ForceOnPoint:
        return replace(
            self,
            force_N=self.force_N[samples],
            points=None if self.points is None else self.points[samples],
            moment=self.moment[samples],
            usable=self.usable[samples],
        )

    def later(self, by: int) -> ForceOnPoint:
        samples, there = later_samples(len(self.usable), by)
        part = self.at(samples)
        return replace(part, usable=part.usable & there)

    def smoothed(self, sigma: float) -> ForceOnPoint:
        """Points where there are any: zero says that there is no force."""
        points = self.points
        if points is not None:
            there = self.usable & np.nan_to_num(points).any(axis=1)
            weight = _smooth(np.ones_like(points), there, sigma)
            points = _smooth(points, there, sigma) / np.maximum(weight, _HARDLY)
        return replace(
            self,
            force_N=_smooth(self.force_N, self.usable, sigma),
            points=points,
            moment=_smooth(self.moment, self.usable, sigma),
        )

    def plate(self, reading: PlateReading) -> Plate:
        force, moment = np.split(self.parts() @ self.matrix(reading).T, 2, axis=1)
        return Plate(self.name, force, moment, None, self.usable)

    def level_matrices(self, reading: PlateReading) -> tuple[np.ndarray, np.ndarray] | None:
        """None where the points are no centres of pressure."""
        if self.points is None or not self.points_move:
            return None
        level = self.rotation_world_lab[:2]
        return level @ self._left(reading), level @ self._scaled_moment(reading)

    def lever_m(self, reading: PlateReading) -> np.ndarray | None:
        """From the laboratory's origin, where points in too small a unit come to lie."""
        if self.points is None:
            return None
        return np.linalg.norm(self.points, axis=1) * reading.point_scale

    def sensors_log_likelihood(self, reading: PlateReading) -> float:
        return 0.0

    def in_place_of(self, other: PlateSource) -> ForceOnPoint:
        assert isinstance(other, ForceOnPoint)
        return replace(other, name=self.name, force_N=self.force_N, moment=self.moment)

    def floor_m(self, reading: PlateReading = AS_STATED) -> float:
        return self.point_height * reading.point_scale

    def moved(self, change: np.ndarray, corners_only: bool = False) -> ForceOnPoint:
        """A moment turns the other way round in a mirror."""
        change = _in_lab(change, self.rotation_world_lab)
        return replace(
            self,
            force_N=self.force_N @ change.T,
            points=None if self.points is None else self.points @ change.T,
            moment=self.moment @ change.T * np.linalg.det(change),
        )

    def alternatives(self) -> Iterable[PlateReading]:
        points = (1.0, 1e-3, 1e-2) if self.points is not None else (1.0,)
        abouts: tuple[Reference, ...] = ("stated",)
        if self.points is not None and self.points_move:
            abouts += ("origin", "fixed")
        for point, moment, about in product(points, (1.0, 1e-3, -1.0, -1e-3), abouts):
            yield PlateReading(moment_scale=moment, point_scale=point, about=about)
        level = np.flatnonzero(np.abs(self.rotation_world_lab[2]) < _LEVEL)
        alike = [[CHANNELS[k + first] for k in level] for first in (0, 3)]
        for fault, about in product(faults_of_channels(alike), abouts):
            yield PlateReading(channels=fault, about=about)

    def findings(self, reading: PlateReading) -> list[Finding]:
        return []

    @staticmethod
    def with_centre(trials: Sequence[ForceOnPoint], reading: PlateReading) -> PlateReading:
        """The reading with the fixed point that leaves least horizontal moment in all trials."""
        turn = trials[0].rotation_world_lab
        forces, lefts = [], []
        for one in trials:
            parts = one.parts()[one.usable]
            left = one._scaled_moment(reading) - one._at_origin(reading)
            forces.append(parts @ (turn @ one._force(reading)).T)
            lefts.append(parts @ (turn @ left).T)
        force, left = np.concatenate(forces), np.concatenate(lefts)
        zero = np.zeros(len(force))
        # The horizontal part of centre x force, linear in the centre.
        rows = np.concatenate(
            [
                np.column_stack([zero, force[:, 2], -force[:, 1]]),
                np.column_stack([-force[:, 2], zero, force[:, 0]]),
                # A thin plate: its height, told by little horizontal force, is near the floor.
                [[0.0, 0.0, np.abs(force[:, 2]).max(initial=1.0)]],
            ]
        )
        wanted = np.concatenate([-left[:, 0], -left[:, 1], [0.0]])
        centre, *_ = np.linalg.lstsq(rows, wanted, rcond=None)
        x, y, z = (turn.T @ centre).tolist()
        return replace(reading, centre_m=(x, y, z))

    # From the parts, lab frame, (3, 15) each.

    def _force(self, reading: PlateReading) -> np.ndarray:
        return np.hstack([reading.channel_matrix()[:3, :3], np.zeros((3, 12))])

    def _scaled_moment(self, reading: PlateReading) -> np.ndarray:
        scaled = reading.moment_scale * reading.channel_matrix()[3:, 3:]
        return np.hstack([np.zeros((3, 3)), scaled, np.zeros((3, 9))])

    def _at_origin(self, reading: PlateReading) -> np.ndarray:
        """Moment of the force at its point about the lab's origin."""
        cross = _CROSS_PRODUCT @ reading.channel_matrix()[:3, :3]
        return np.hstack([np.zeros((3, 6)), reading.point_scale * cross.reshape(3, 9)])

    def _left(self, reading: PlateReading) -> np.ndarray:
        """Moment at the point."""
        left = self._scaled_moment(reading)
        if reading.about == "stated":
            return left
        left = left - self._at_origin(reading)
        if reading.centre_m is not None:
            left = left + crossing(np.array(reading.centre_m)) @ self._force(reading)
        return left


# (3, 3, 3): what the products of each coordinate of a point with each force add to its moment.
_CROSS_PRODUCT = np.cross(np.eye(3)[:, None], np.eye(3)[None]).transpose(2, 0, 1)


def _in_lab(change: np.ndarray, rotation_world_lab: np.ndarray) -> np.ndarray:
    """A change of the world's axes, as one of the lab's, (3, 3)."""
    return np.asarray(rotation_world_lab.T @ change @ rotation_world_lab)


def _smooth(values: np.ndarray, usable: np.ndarray, sigma: float) -> np.ndarray:
    """Averaged over samples (n, k), with nothing where they are not usable."""
    known = np.where(usable[:, None], np.nan_to_num(values), 0.0)
    return np.asarray(gaussian_filter1d(known, sigma, axis=0, mode="nearest"))


def points_that_move(point: np.ndarray, loaded: np.ndarray) -> bool:
    """Whether points of force (n, 3) under load (n,) are more than one place."""
    some = point[loaded & np.isfinite(point).all(axis=1)]
    return bool(len(some) and np.ptp(some, axis=0).max() > _STILL_M * max(1.0, np.abs(some).max()))


# --- plates that are copies or sums of others, as treadmills and virtual plates export them -------


def repeated_plates(trials: Sequence[Mapping[str, PlateSource]]) -> dict[str, tuple[str, ...]]:
    """Names of plates whose force is that of another, or the sum of others, in every trial.

    Fewer terms are tried first, so that each is needed; of two copies the later one repeats. Forces
    are vertical ones, whichever way the plate lies and its signs are.
    """
    repeated: dict[str, tuple[str, ...]] = {}
    forces = [
        {name: np.where(s.usable, np.abs(lift_N(s)), np.nan) for name, s in trial.items()}
        for trial in trials
    ]
    names = list(dict.fromkeys(n for trial in trials for n in trial))
    for name in reversed(names):
        others = [n for n in names if n != name and n not in repeated]
        earlier = [n for n in others if names.index(n) < names.index(name)]
        sums = (combinations(others, n) for n in range(2, min(len(others), _MOST_TERMS) + 1))
        possible = chain(combinations(earlier, 1), *sums)
        terms = next((some for some in possible if _is_sum(forces, name, some)), None)
        if terms is not None:
            repeated[name] = terms
    return repeated


def _is_sum(trials: Sequence[Mapping[str, np.ndarray]], name: str, terms: Sequence[str]) -> bool:
    """In every trial that has them all."""
    common = [trial for trial in trials if name in trial and all(t in trial for t in terms)]
    if not common:
        return False
    forces = np.stack([np.concatenate([t[n] for t in common]) for n in (name, *terms)])
    forces = forces[:, np.isfinite(forces).all(axis=0)]
    if not forces[0].any():
        return False
    # Plates that bear nothing are alike; a few samples may be damaged on one of them.
    loaded = forces.max(axis=0) > _BEARS * forces.max()
    gap = np.abs(forces[0] - forces[1:].sum(axis=0))[loaded]
    return bool(np.mean(gap < _SAME * forces[0, loaded]) > _MOSTLY)
