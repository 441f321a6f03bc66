"""One plate of one recording before it is decided how its numbers are to be understood."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Protocol

import numpy as np
from scipy.ndimage import gaussian_filter1d

from bsip_cli.recordings.cop_polynomial import correct_cop
from bsip_cli.recordings.model import Finding, Plate
from bsip_cli.recordings.plate_reading import AS_STATED, CHANNELS, PlateReading, Reference
from bsip_cli.recordings.plates import LocalWrench, PlateDescription, surface_offset_m, to_world

_THICK_M = 0.3  # no plate's sensors lie so deep under its surface
_Z = np.array([1.0, 1.0, -1.0])
_HARDLY = 0.05  # of a bell: less of it has points
_STILL_M = 1e-6  # points that stay where they are, are no centres of pressure


class PlateSource(Protocol):
    """What every format's plate can say of itself; arrays are at the analog rate."""

    @property
    def name(self) -> str: ...

    @property
    def usable(self) -> np.ndarray:
        """Samples that can be believed, (n,) bool."""

    def lift_N(self, reading: PlateReading = AS_STATED) -> np.ndarray:
        """Vertical force, world frame, before the sign of a reading, (n,)."""

    def at(self, samples: np.ndarray) -> PlateSource:
        """These samples alone."""

    def smoothed(self, sigma: float) -> PlateSource:
        """Averaged with a bell of a standard deviation of so many samples."""

    def plate(self, reading: PlateReading) -> Plate:
        """In the world frame."""

    def left_at_point(self, reading: PlateReading) -> LeftMoment | None:
        """What is left at the points that the file calls centres of pressure, if it names some."""

    def lever_m(self, reading: PlateReading) -> np.ndarray | None:
        """How far from the sensor, or from the origin of its points, the force is, (n,); None where
        there is neither."""

    def in_place_of(self, other: PlateSource) -> PlateSource:
        """This force where the other one is."""

    def floor_m(self, reading: PlateReading) -> float:
        """Height of the surface, world frame."""

    def moved(self, change: np.ndarray, corners_only: bool = False) -> PlateSource:
        """In other axes of the world (3, 3), turned or as if seen in a mirror; what channels hold
        is mirrored too unless ``corners_only``."""

    def alternatives(self) -> Iterable[PlateReading]:
        """Other ways to understand the numbers, sign and size of the outline aside."""

    def findings(self, reading: PlateReading) -> list[Finding]:
        """What is to be said of this reading beyond its words."""


@dataclass(frozen=True, eq=False)
class LeftMoment:
    """Horizontal moment at a named centre of pressure (n,): as read and as written, in N m."""

    read: np.ndarray
    written: np.ndarray


@dataclass(frozen=True, eq=False)
class C3dPlate:
    """A plate of a C3D file: its wrench at the sensor's origin, plate frame."""

    description: PlateDescription
    wrench: LocalWrench
    usable: np.ndarray  # (n,) bool
    rotation_world_lab: np.ndarray  # (3, 3)
    z_up: bool = False

    @property
    def name(self) -> str:
        return self.description.name

    def lift_N(self, reading: PlateReading = AS_STATED) -> np.ndarray:
        axes = self.rotation_world_lab @ self.read_description(reading).rotation_lab_plate()
        return np.asarray(self.wrench.force_N * reading.force_signs() @ axes[2])

    def at(self, samples: np.ndarray) -> C3dPlate:
        part = LocalWrench(self.wrench.force_N[samples], self.wrench.moment_Nm[samples])
        return replace(self, wrench=part, usable=self.usable[samples])

    def smoothed(self, sigma: float) -> C3dPlate:
        parts = (
            _smooth(x, self.usable, sigma) for x in (self.wrench.force_N, self.wrench.moment_Nm)
        )
        return replace(self, wrench=LocalWrench(*parts))

    def plate(self, reading: PlateReading) -> Plate:
        description = self.read_description(reading)
        surface, _ = correct_cop(self._at_surface(reading), description)
        force, moment = to_world(surface, description, self.rotation_world_lab)
        corners = description.corners_m @ self.rotation_world_lab.T
        return Plate(self.name, reading.sign * force, reading.sign * moment, corners, self.usable)

    def left_at_point(self, reading: PlateReading) -> None:
        return None

    def lever_m(self, reading: PlateReading) -> np.ndarray:
        return np.asarray(np.hypot(*self._wrench(reading).cop().T))

    def in_place_of(self, other: PlateSource) -> C3dPlate:
        assert isinstance(other, C3dPlate)
        return replace(self, description=replace(other.description, name=self.name))

    def floor_m(self, reading: PlateReading) -> float:
        return float((self.description.corners_m @ self.rotation_world_lab.T)[:, 2].mean())

    def moved(self, change: np.ndarray, corners_only: bool = False) -> C3dPlate:
        """A mirrored plate's z points out of the floor."""
        corners = self.description.corners_m @ _in_lab(change, self.rotation_world_lab).T
        description = replace(self.description, corners_m=corners)
        if np.linalg.det(change) > 0 or corners_only:
            return replace(self, description=description)
        wrench = LocalWrench(self.wrench.force_N * _Z, -self.wrench.moment_Nm * _Z)
        return replace(self, description=description, wrench=wrench, z_up=not self.z_up)

    def alternatives(self) -> Iterable[PlateReading]:
        """Type 3 has no moments of its own, type 1 no point that they are about."""
        kind = self.description.kind
        scales = (1.0,) if kind == 3 else (1.0, 1e-3, 1e3, -1.0)
        abouts: tuple[Reference, ...] = ("stated",)
        if kind in (2, 4) and self.description.origin_m[:2].any():
            abouts += ("reversed", "centred")
        for scale, about, turn, mirrored in product(scales, abouts, range(4), (False, True)):
            yield PlateReading(moment_scale=scale, about=about, turn=turn, mirrored=mirrored)
        for channel in CHANNELS:
            yield PlateReading(reversed_channel=channel)

    def findings(self, reading: PlateReading) -> list[Finding]:
        return list(correct_cop(self._at_surface(reading), self.read_description(reading))[1])

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

    def local_cop_m(self, reading: PlateReading) -> np.ndarray:
        """Centre of pressure on the surface, plate frame, (n, 2)."""
        return self._at_surface(reading).cop()

    def _at_surface(self, reading: PlateReading) -> LocalWrench:
        offset = surface_offset_m(self.description)
        if reading.about != "stated":
            offset = offset * (np.array([-1, -1, 1]) if reading.about == "reversed" else [0, 0, 1])
            offset[2] *= abs(offset[2]) < _THICK_M
        if self.z_up:
            offset = offset * _Z
        return self._wrench(reading).at_surface(offset)

    def _wrench(self, reading: PlateReading) -> LocalWrench:
        """At the sensor's origin, before the sign of a reading."""
        return LocalWrench(
            self.wrench.force_N * reading.force_signs(),
            self.wrench.moment_Nm * reading.moment_signs() * reading.moment_scale,
        )


@dataclass(frozen=True, eq=False)
class ForceOnPoint:
    """A force of a table (MOT), with the points that it acts on and moments, both as written.

    All (n, 3), lab frame; a point is zero where there is no force.
    """

    name: str
    force_N: np.ndarray
    points: np.ndarray | None
    moment: np.ndarray | None
    point_height: float  # median under load, in the points' unit
    points_move: bool
    usable: np.ndarray  # (n,) bool
    rotation_world_lab: np.ndarray  # (3, 3)

    def lift_N(self, reading: PlateReading = AS_STATED) -> np.ndarray:
        return np.asarray(self._force_N(reading) @ self.rotation_world_lab[2])

    def at(self, samples: np.ndarray) -> ForceOnPoint:
        def some(values: np.ndarray | None) -> np.ndarray | None:
            return None if values is None else values[samples]

        return replace(
            self,
            force_N=self.force_N[samples],
            points=some(self.points),
            moment=some(self.moment),
            usable=self.usable[samples],
        )

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
            moment=None if self.moment is None else _smooth(self.moment, self.usable, sigma),
        )

    def plate(self, reading: PlateReading) -> Plate:
        turn = self.rotation_world_lab
        force, moment = self._force_N(reading) @ turn.T, self._moment_Nm(reading) @ turn.T
        return Plate(self.name, reading.sign * force, reading.sign * moment, None, self.usable)

    def left_at_point(self, reading: PlateReading) -> LeftMoment | None:
        """None where the points are no centres of pressure, or nothing is left to be seen."""
        if self.moment is None or self.points is None or not self.points_move:
            return None
        turn = self.rotation_world_lab
        left = self._left(reading) @ turn.T
        written = self.moment @ turn.T * reading.moment_scale
        return LeftMoment(np.hypot(*left.T[:2]), np.hypot(*written.T[:2]))

    def lever_m(self, reading: PlateReading) -> np.ndarray | None:
        """From the laboratory's origin, where points in too small a unit come to lie."""
        if self.points is None:
            return None
        return np.linalg.norm(self.points, axis=1) * reading.point_scale

    def in_place_of(self, other: PlateSource) -> ForceOnPoint:
        assert isinstance(other, ForceOnPoint)
        return other.with_force(self)

    def floor_m(self, reading: PlateReading) -> float:
        return self.point_height * reading.point_scale

    def moved(self, change: np.ndarray, corners_only: bool = False) -> ForceOnPoint:
        """A moment turns the other way round in a mirror."""
        change = _in_lab(change, self.rotation_world_lab)
        moment = None if self.moment is None else self.moment @ change.T * np.linalg.det(change)
        return replace(
            self,
            force_N=self.force_N @ change.T,
            points=None if self.points is None else self.points @ change.T,
            moment=moment,
        )

    def alternatives(self) -> Iterable[PlateReading]:
        points = (1.0, 1e-3, 1e-2) if self.points is not None else (1.0,)
        moments = (1.0, 1e-3, -1.0) if self.moment is not None else (1.0,)
        abouts: tuple[Reference, ...] = ("stated",)
        if self.moment is not None and self.points is not None and self.points_move:
            abouts += ("origin", "fixed")
        for point, moment, about in product(points, moments, abouts):
            yield PlateReading(moment_scale=moment, point_scale=point, about=about)
        for channel in CHANNELS[:3]:
            yield PlateReading(reversed_channel=channel)

    def findings(self, reading: PlateReading) -> list[Finding]:
        return []

    @staticmethod
    def with_centre(trials: Sequence[ForceOnPoint], reading: PlateReading) -> PlateReading:
        """The reading with the fixed point that leaves least horizontal moment in all trials."""
        turn = trials[0].rotation_world_lab
        forces, lefts = [], []
        for one in trials:
            left = one._scaled_moment(reading) - one._at_origin(reading)
            known = one.usable & np.isfinite(left).all(axis=1)
            forces.append(one._force_N(reading)[known] @ turn.T)
            lefts.append(left[known] @ turn.T)
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

    def with_force(self, other: ForceOnPoint) -> ForceOnPoint:
        """These points with another force and its moment."""
        return replace(self, name=other.name, force_N=other.force_N, moment=other.moment)

    def _moment_Nm(self, reading: PlateReading) -> np.ndarray:
        """About the lab's origin, lab frame, (n, 3)."""
        if self.points is None:
            return self._scaled_moment(reading)
        at_point = self._at_origin(reading)
        if self.moment is None:
            return at_point
        left = self._left(reading)
        if reading.about != "stated":
            up = self.rotation_world_lab[2]
            left = np.outer(left @ up, up)
        return at_point + left

    def _left(self, reading: PlateReading) -> np.ndarray:
        """Moment at the point, lab frame, (n, 3)."""
        left = self._scaled_moment(reading)
        if reading.about == "stated":
            return left
        left = left - self._at_origin(reading)
        if reading.centre_m is not None:
            left = left + np.cross(np.array(reading.centre_m), self._force_N(reading))
        return left

    def _at_origin(self, reading: PlateReading) -> np.ndarray:
        """Moment of the force at its point about the lab's origin, (n, 3)."""
        assert self.points is not None
        return np.asarray(np.cross(self.points * reading.point_scale, self._force_N(reading)))

    def _force_N(self, reading: PlateReading) -> np.ndarray:
        return self.force_N * reading.force_signs()

    def _scaled_moment(self, reading: PlateReading) -> np.ndarray:
        assert self.moment is not None
        return self.moment * reading.moment_scale


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
