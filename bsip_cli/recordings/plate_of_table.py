"""A force of a table (MOT), and every way to understand its points and moments."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from bsip_cli.recordings.model import Finding, Plate
from bsip_cli.recordings.plate_reading import AS_STATED, PlateReading, Reference, faults_of_channels
from bsip_cli.recordings.plate_source import PlateSource, averaged, in_lab, later_samples
from bsip_cli.recordings.plates import CHANNELS, LIGHT_N, crossing

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
