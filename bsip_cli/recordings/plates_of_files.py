"""Plates of files and every way to understand their numbers: of a C3D file channels, corners and
ORIGIN, of a table (MOT) points of force and moments."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from bsip_cli.recordings.model import Finding, Plate
from bsip_cli.recordings.plate_reading import (
    ALIKE,
    AS_STATED,
    RARE_SCALES,
    PlateReading,
    PlateSource,
    Reference,
    averaged,
    faults_of_channels,
    in_lab,
    later_samples,
)
from bsip_cli.recordings.plates import (
    CHANNELS,
    LIGHT_N,
    LOADED_N,
    PlateDescription,
    cop_at_height,
    cop_shift_m,
    crossing,
    wrench_matrix,
)
from bsip_cli.recordings.under_the_feet import falling

_THICK_M = 0.3  # no plate's sensors lie so deep under its surface
_Z = np.array([1.0, 1.0, -1.0])
_CORNERS = np.array([[1, 1, 1], [-1, 1, -1], [-1, -1, 1], [1, -1, -1]])  # of x, of y, of both
_DIAGONAL = 0.1  # of the load, where the likelihood begins to fall
_MIRRORED = np.array([1.0, 1.0, -1.0, -1.0, -1.0, 1.0])  # a wrench seen in a level mirror


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
        of a reading."""
        kind = self.description.kind
        matrix = wrench_matrix(self.description) @ reading.measured_matrix(kind)
        mirror = np.diag(_MIRRORED) if self.is_mirrored else np.eye(6)
        scale = 1.0 if kind == 1 else reading.moment_scale  # which has points, scaled before
        return np.asarray(
            np.repeat([1, scale], 3)[:, None] * (reading.channel_matrix() @ mirror @ matrix)
        )

    def matrix(self, reading: PlateReading) -> np.ndarray:
        """Without the maker's correction of the centre of pressure, which is no linear one."""
        description = self.read_description(reading)
        axes = self.rotation_world_lab @ description.rotation_lab_plate()
        force, moment = np.split(self.local(reading), 2)
        force = reading.sign * axes @ force
        to_surface = axes @ crossing(self._surface_m(reading)) @ axes.T
        at_centre = crossing(self.rotation_world_lab @ description.centre_m()) - to_surface
        return np.vstack([force, at_centre @ force + reading.sign * axes @ moment])

    def at(self, samples: np.ndarray) -> C3dPlate:
        return replace(self, measured=self.measured[samples], usable=self.usable[samples])

    def later(self, by: int) -> C3dPlate:
        samples, there = later_samples(len(self.usable), by)
        part = self.at(samples)
        return replace(part, usable=part.usable & there)

    def smoothed(self, sigma: float) -> C3dPlate:
        return replace(self, measured=averaged(self.measured, self.usable, sigma))

    def plate(self, reading: PlateReading) -> Plate:
        description = self.read_description(reading)
        wrench = self.measured @ self.matrix(reading).T
        if (moved := self._shift(reading)) is not None:
            (x, y), load = moved
            axes = reading.sign * self.rotation_world_lab @ description.rotation_lab_plate()
            wrench[:, 3:] += np.column_stack([-y * load, x * load]) @ axes[:, :2].T
        corners = description.corners_m @ self.rotation_world_lab.T
        return Plate(self.name, wrench, corners, self.usable)

    def level_matrices(self, reading: PlateReading) -> None:
        return None

    def lever_m(self, reading: PlateReading) -> np.ndarray:
        force, moment = self._at_sensor(reading)
        return np.hypot(*cop_at_height(force, moment, 0.0).T)

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

    def scaled(self, times: float) -> C3dPlate:
        return replace(self, measured=times * self.measured)

    def moved(self, change: np.ndarray, corners_only: bool = False) -> C3dPlate:
        """A mirrored plate's z points out of the floor."""
        corners = self.description.corners_m @ in_lab(change, self.rotation_world_lab).T
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
        for scale in RARE_SCALES if kind in (2, 4) else ():
            yield PlateReading(moment_scale=scale)
        for fault in faults_of_channels(ALIKE[kind]):
            yield PlateReading(channels=fault)
        for point, scale in product((10.0, 1e3), (1.0, 1e3)) if kind == 1 else ():
            yield PlateReading(point_scale=point, moment_scale=scale)

    def findings(self, reading: PlateReading) -> list[Finding]:
        """The maker's correction of the centre of pressure; force and vertical moment stay."""
        if (moved := self._shift(reading)) is None:
            return []
        shift_m, load = moved
        largest_mm = 1e3 * np.max(np.hypot(*shift_m)[np.abs(load) > LOADED_N], initial=0.0)
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

    def _shift(self, reading: PlateReading) -> tuple[np.ndarray, np.ndarray] | None:
        """By how much the maker moves the centre of pressure, plate frame, (2, n), and the load
        there, (n,), before the sign of a reading; None without a maker's polynomial."""
        description = self.read_description(reading)
        if description.cop_polynomial is None:
            return None
        force, moment = self._at_sensor(reading)
        moment = moment + np.cross(force, self._surface_m(reading))
        return cop_shift_m(cop_at_height(force, moment, 0.0), description).T, force[:, 2]

    def _at_sensor(self, reading: PlateReading) -> list[np.ndarray]:
        """Force and moment (n, 3) at the sensor's origin, plate frame, before the sign."""
        return np.split(self.measured @ self.local(reading).T, 2, axis=1)


# --- a force of a table (MOT) ---------------------------------------------------------------------


_LEVEL = 0.5  # sine of an axis' slope
_HARDLY = 0.05  # of a bell: less of it has points
_STILL_M = 1e-6  # points that stay where they are, are no centres of pressure


@dataclass(frozen=True, eq=False)
class ForceOnPoint:
    """A force of a table (MOT), with the points that it acts on and moments, both as written.

    All (n, 3), lab frame; a point is zero where there is no force. known : (n,) bool, samples of
    force, moment and point that can be believed.
    """

    name: str
    force_N: np.ndarray
    points: np.ndarray | None
    moment: np.ndarray
    point_height: float  # median under load, in the points' unit
    points_move: bool
    known: np.ndarray
    rotation_world_lab: np.ndarray  # (3, 3)

    @property
    def usable(self) -> np.ndarray:
        """Known, and not a load without a point."""
        return self.known & ~self.pointless()

    def pointless(self) -> np.ndarray:
        """Loaded, and without the point that other loads have, (n,) bool."""
        if self.points is None or not self.points_move:
            return np.zeros(len(self.known), bool)
        loaded = np.linalg.norm(np.nan_to_num(self.force_N), axis=1) > LIGHT_N
        return loaded & ~self.points.any(axis=1)

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
            known=self.known[samples],
        )

    def later(self, by: int) -> ForceOnPoint:
        samples, there = later_samples(len(self.usable), by)
        part = self.at(samples)
        return replace(part, known=part.known & there)

    def smoothed(self, sigma: float) -> ForceOnPoint:
        """Points where there are any: zero says that there is no force."""
        points = self.points
        if points is not None:
            there = self.usable & np.nan_to_num(points).any(axis=1)
            weight = averaged(np.ones_like(points), there, sigma)
            points = averaged(points, there, sigma) / np.maximum(weight, _HARDLY)
        return replace(
            self,
            force_N=averaged(self.force_N, self.usable, sigma),
            points=points,
            moment=averaged(self.moment, self.usable, sigma),
        )

    def plate(self, reading: PlateReading) -> Plate:
        return Plate(self.name, self.parts() @ self.matrix(reading).T, None, self.usable)

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
        known = self.known & other.known
        return replace(other, name=self.name, force_N=self.force_N, moment=self.moment, known=known)

    def floor_m(self, reading: PlateReading = AS_STATED) -> float:
        return self.point_height * reading.point_scale

    def scaled(self, times: float) -> ForceOnPoint:
        return replace(self, force_N=times * self.force_N, moment=times * self.moment)

    def moved(self, change: np.ndarray, corners_only: bool = False) -> ForceOnPoint:
        """A moment turns the other way round in a mirror."""
        change = in_lab(change, self.rotation_world_lab)
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
        if not (pointless := self.pointless()).any():
            return []
        found = f"{pointless.sum()} of {len(pointless)} samples have a force and no point"
        action = "marked them unusable"
        return [Finding("analog_point", self.name, found, "none", action, "warning")]

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
                # A thin plate: its height, known by little horizontal force, is near the floor.
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


def points_that_move(point: np.ndarray, loaded: np.ndarray) -> bool:
    """Whether points of force (n, 3) under load (n,) are more than one place."""
    some = point[loaded & np.isfinite(point).all(axis=1)]
    return bool(len(some) and np.ptp(some, axis=0).max() > _STILL_M * max(1.0, np.abs(some).max()))
