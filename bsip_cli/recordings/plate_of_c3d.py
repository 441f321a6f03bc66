"""A plate of a C3D file, and every way to understand its channels, corners and ORIGIN."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from bsip_cli.recordings.model import Finding, Plate
from bsip_cli.recordings.plate_reading import (
    ALIKE,
    AS_STATED,
    PlateReading,
    Reference,
    faults_of_channels,
)
from bsip_cli.recordings.plate_source import PlateSource, averaged, in_lab, later_samples
from bsip_cli.recordings.plates import (
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
        for fault in faults_of_channels(ALIKE[kind]):
            yield PlateReading(channels=fault)
        for point, scale in product((10.0, 1e3), (1.0, 1e3)) if kind == 1 else ():
            yield PlateReading(point_scale=point, moment_scale=scale)

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
        return LocalWrench(force, moment)

    def _at_surface(self, reading: PlateReading) -> LocalWrench:
        return self._wrench(reading).at_surface(self._surface_m(reading))
