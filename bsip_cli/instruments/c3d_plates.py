"""How the force plates of a C3D file read: from analog channels to force and moment."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from bsip_cli.errors import BadDataError
from bsip_cli.instruments.readings import SensingPlate

AGREEMENT = 1e-3  # with ezc3d's own extraction, of the largest value
LOADED_N = 20.0  # vertical force under which a point of application stays where it was
_CHANNELS = {1: 6, 2: 6, 3: 8, 4: 6}  # by type
METRES = {"m": 1.0, "mm": 1e-3, "cm": 1e-2}
MOMENTS = {"Nm": 1.0, "Nmm": 1e-3, "Ncm": 1e-2}


@dataclass(frozen=True, eq=False)
class WiredPlate:
    """A plate and its wiring.

    channels : (k,) rows of the analog data. matrix : (6, k) from them to N and N m in the
        plate's axes, about its sensor; of TYPE 1 to the force, the point that it acts on in the
        surface, and the moment about the normal there.
    """

    plate: SensingPlate
    channels: np.ndarray
    matrix: np.ndarray
    has_points: bool = False

    def reading(self, analogs: np.ndarray) -> np.ndarray:
        """(N, 6) of the analog data (all channels, N)."""
        read = analogs[self.channels].T @ self.matrix.T
        if self.has_points:
            read[:, 3:] = np.cross(_level(read[:, 3:5]), read[:, :3]) + read[:, 5:] * [
                0.0,
                0.0,
                1.0,
            ]
        return read

    def changed(self, analogs: np.ndarray, change: np.ndarray) -> np.ndarray:
        """(k, N) its channels after a change (N, 6) of the reading, the smallest that does it; a
        point that a force below LOADED_N acts on stays where it was."""
        if self.has_points:
            read = analogs[self.channels].T @ self.matrix.T
            wanted = self.reading(analogs) + change
            force, (mx, my, mz) = wanted[:, :3], wanted[:, 3:].T
            loaded = np.abs(force[:, 2]) > LOADED_N
            under = np.where(loaded, force[:, 2], np.inf)
            point = np.where(
                loaded[:, None], np.stack([-my, mx], axis=1) / under[:, None], read[:, 3:5]
            )
            about = mz - np.cross(_level(point), force)[:, 2]
            change = np.column_stack([force, point, about]) - read
        return analogs[self.channels] + np.linalg.pinv(self.matrix) @ change.T


def wired_plates(c3d: Any, file: object) -> list[WiredPlate]:
    """All plates of a file loaded with ezc3d's own extraction, which each must agree with.

    Raises
    ------
    BadDataError : a plate of another type than 1 to 4, or one whose description and data disagree.
    """
    group = c3d["parameters"].get("FORCE_PLATFORM", {})
    used = int(np.ravel(group["USED"]["value"])[0]) if "USED" in group else 0
    return [_wired(c3d, group, index, file) for index in range(used)]


def _wired(c3d: Any, group: Any, index: int, file: object) -> WiredPlate:
    kind = int(group["TYPE"]["value"][index])
    if kind not in _CHANNELS:
        raise BadDataError(
            f"plate {index + 1} is of TYPE {kind}",
            expected="TYPE 1 to 4",
            file=file,
            remedy="export the trial with forces and moments as channels (TYPE 2)",
        )
    extracted = c3d["data"]["platform"][index]
    length = METRES.get(extracted["unit_position"], 0.0)
    unit = MOMENTS.get(extracted["unit_moment"].replace("-", "").replace(".", ""), 0.0)
    if not length or not unit or extracted["unit_force"] != "N":
        raise BadDataError(
            f"plate {index + 1} is in {extracted['unit_force']}, {extracted['unit_moment']} and "
            f"{extracted['unit_position']}",
            expected="N, N m or N mm, m or mm",
            file=file,
        )
    channels = np.asarray(group["CHANNEL"]["value"])[: _CHANNELS[kind], index].astype(int) - 1
    origin = np.ravel(np.asarray(group["ORIGIN"]["value"], dtype=float)[:, index])
    axes, centre = _axes(extracted["corners"] * length)
    analogs = np.nan_to_num(c3d["data"]["analogs"][0])
    for matrix, sensor in product(
        _matrices(kind, group, index, origin, length, unit), _sensors(kind, origin * length)
    ):
        place = SensingPlate(axes, centre, centre - axes @ sensor)
        wired = WiredPlate(place, channels, matrix, has_points=kind == 1)
        if _agrees(wired, analogs, extracted, unit):
            return wired
    raise BadDataError(
        f"what plate {index + 1} reads does not follow from its description", file=file
    )


def _axes(corners_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Axes (3, 3) and centre (3,) from corners (3, 4) in the order +x+y, -x+y, -x-y, +x-y."""
    x = corners_m[:, 0] - corners_m[:, 1]
    z = np.cross(x, corners_m[:, 0] - corners_m[:, 3])
    x, z = x / np.linalg.norm(x), z / np.linalg.norm(z)
    return np.stack([x, np.cross(z, x), z], axis=1), corners_m.mean(axis=1)


def _matrices(
    kind: int, group: Any, index: int, origin: np.ndarray, length: float, unit: float
) -> list[np.ndarray]:
    """What may lead from channels to N and N m."""
    if kind == 3:
        a, b = np.abs(origin[:2]) * length
        return [sign * _of_eight(a, b) for sign in (1.0, -1.0)]
    if kind == 1:
        both = product((1.0, -1.0), (length, 1.0, 1e-3))
        return [np.diag([s, s, s, points, points, s * unit]) for s, points in both]
    scale = np.diag(np.repeat([1.0, unit], 3))
    if kind == 2:
        return [scale, -scale]
    calibration = np.asarray(group["CAL_MATRIX"]["value"], dtype=float)[:6, :6, index]
    variants = [calibration, calibration.T]
    return [scale @ (sign * matrix) for matrix in variants for sign in (1.0, -1.0)]


def _of_eight(a: float, b: float) -> np.ndarray:
    """(6, 8) of TYPE 3: fx12 fx34 fy14 fy23 fz1 fz2 fz3 fz4, sensors at (+-a, +-b)."""
    return np.array(
        [
            [1, 1, 0, 0, 0, 0, 0, 0],
            [0, 0, 1, 1, 0, 0, 0, 0],
            [0, 0, 0, 0, 1, 1, 1, 1],
            [0, 0, 0, 0, b, b, -b, -b],
            [0, 0, 0, 0, -a, a, a, -a],
            [-b, b, a, -a, 0, 0, 0, 0],
        ]
    )


def _level(points: np.ndarray) -> np.ndarray:
    """(N, 3) of points (N, 2) in the surface."""
    return np.pad(points, ((0, 0), (0, 1)))


def _sensors(kind: int, origin_m: np.ndarray) -> list[np.ndarray]:
    """Where the surface's centre may lie from the sensor, plate axes: as is written, with the
    other height, or, as the format means it where the height is positive, from the centre to the
    sensor."""
    if kind == 1:
        return [np.zeros(3)]
    place = np.array([0.0, 0.0, origin_m[2]]) if kind == 3 else origin_m
    return [place, place * [1.0, 1.0, -1.0], -place]


def _agrees(wired: WiredPlate, analogs: np.ndarray, extracted: Any, unit: float) -> bool:
    """Force and moment about the surface's centre as ezc3d has them: of TYPE 1 (ezc3d 1.7) with the
    force's moment reversed, F x p."""
    force, moment = wired.plate.lab_wrench(wired.reading(analogs), wired.plate.centre_m)
    sign = -1.0 if wired.has_points else 1.0
    pairs = ((force, extracted["force"].T), (sign * moment, unit * extracted["moment"].T))
    return all(
        np.abs(ours - np.nan_to_num(theirs)).max() <= AGREEMENT * np.nanmax(np.abs(theirs)) + 1e-9
        for ours, theirs in pairs
    )
