"""Recordings as C3D files, with the plates' channels in the manner of three makers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import ezc3d
import numpy as np

from tests.blind.second_world.lab import Plate, Recorded

MM = 1000.0


@dataclass(frozen=True)
class Channels:
    """Of one plate: signals (N, k); resolution (k,) of a 16-bit converter; origin_mm (3,)."""

    signals: np.ndarray
    names: tuple[str, ...]
    units: tuple[str, ...]
    resolution: np.ndarray
    origin_mm: np.ndarray

    def rounded(self) -> np.ndarray:
        return np.round(self.signals / self.resolution) * self.resolution


_WRENCH = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")
_MOMENTS_MM = np.array([1.0, 1.0, 1.0, MM, MM, MM])


def type_2(plate: Plate, wrench: np.ndarray) -> Channels:
    """Six components in N and N mm."""
    ranges = np.array([2500.0, 2500.0, 5000.0, 1.25e6, 1.25e6, 6e5])
    units = ("N",) * 3 + ("Nmm",) * 3
    signals = wrench * _MOMENTS_MM
    return Channels(signals, _WRENCH, units, ranges * 2.0 / 65536.0, plate.origin_m * MM)


def type_3(plate: Plate, wrench: np.ndarray) -> Channels:
    """Eight sensors at the corners, in N."""
    a, b = 0.8 * plate.half_m
    Fx, Fy, Fz, Mx, My, Mz = wrench.T
    corners = np.array([[1.0, 1.0, 1.0, 1.0], [b, b, -b, -b], [-a, a, a, -a]])
    vertical = np.linalg.pinv(corners) @ np.array([Fz, Mx, My])
    split_x, split_y = Mz / (4.0 * b), Mz / (4.0 * a)  # half of the turn by either pair
    pairs = [Fx / 2.0 - split_x, Fx / 2.0 + split_x, Fy / 2.0 + split_y, Fy / 2.0 - split_y]
    names = ("fx12", "fx34", "fy14", "fy23", "fz1", "fz2", "fz3", "fz4")
    resolution = np.array([1e3] * 4 + [5e3] * 4) * 2.0 / 65536.0
    origin = np.array([a, b, plate.origin_m[2]]) * MM
    return Channels(np.column_stack([*pairs, *vertical]), names, ("N",) * 8, resolution, origin)


def type_4(plate: Plate, wrench: np.ndarray) -> Channels:
    """Six voltages that a matrix turns into the wrench."""
    signals = wrench @ np.linalg.inv(plate.calibration).T
    return Channels(signals, _WRENCH, ("V",) * 6, np.full(6, 20.0 / 65536.0), plate.origin_m * MM)


TYPES: dict[int, Callable[[Plate, np.ndarray], Channels]] = {2: type_2, 3: type_3, 4: type_4}


def write_c3d(path: Path, recorded: Recorded, plate_type: int) -> None:
    """Markers in mm and the plates' channels."""
    pairs = zip(recorded.plates, recorded.wrenches, strict=True)
    channels = [TYPES[plate_type](plate, wrench) for plate, wrench in pairs]
    c3d = ezc3d.c3d()
    _fill_points(c3d, recorded)
    _fill_analogs(c3d, recorded, channels)
    _fill_plates(c3d, recorded, channels, plate_type)
    c3d.add_parameter("MANUFACTURER", "COMPANY", ["otherlab"])
    path.parent.mkdir(parents=True, exist_ok=True)
    c3d.write(str(path))


def _fill_points(c3d: ezc3d.c3d, recorded: Recorded) -> None:
    courses = np.stack(list(recorded.markers_m.values()))  # (m, n, 3)
    points = np.ones((4, *courses.shape[:2]))
    points[:3] = courses.transpose(2, 0, 1) * MM
    missing = np.isnan(points[0])
    _set(c3d, "POINT", RATE=[float(recorded.rate_hz)], UNITS=["mm"])
    _set(c3d, "POINT", LABELS=list(recorded.markers_m))
    c3d["data"]["points"] = points
    c3d["data"]["meta_points"]["residuals"] = np.where(missing, -1.0, 0.0)[None]


def _fill_analogs(c3d: ezc3d.c3d, recorded: Recorded, channels: list[Channels]) -> None:
    signals = np.hstack([plate.rounded() for plate in channels])
    names = [f"{name}{k + 1}" for k, plate in enumerate(channels) for name in plate.names]
    units = [unit for plate in channels for unit in plate.units]
    _set(c3d, "ANALOG", RATE=[float(recorded.analog_hz)], LABELS=names, UNITS=units)
    _set(c3d, "ANALOG", SCALE=[1.0] * len(names), OFFSET=[0] * len(names), GEN_SCALE=[1.0])
    c3d["data"]["analogs"] = signals.T[None]


def _fill_plates(
    c3d: ezc3d.c3d, recorded: Recorded, channels: list[Channels], plate_type: int
) -> None:
    count, each = len(channels), len(channels[0].names)
    group = "FORCE_PLATFORM"
    # Arrays of integers: readers refuse these as floats.
    _set(c3d, group, USED=np.array([count]), TYPE=np.array([plate_type] * count))
    _set(c3d, group, ZERO=np.array([1, 0]))
    _set(c3d, group, CHANNEL=np.arange(1, count * each + 1).reshape(count, each).T)
    _set(c3d, group, CORNERS=np.stack([corners.T * MM for corners in recorded.corners_m], axis=2))
    _set(c3d, group, ORIGIN=np.column_stack([plate.origin_mm for plate in channels]))
    if plate_type == 4:
        matrices = [plate.calibration * _MOMENTS_MM[:, None] for plate in recorded.plates]
        _set(c3d, group, CAL_MATRIX=np.stack(matrices, axis=2))


def _set(c3d: ezc3d.c3d, group: str, **values: object) -> None:
    for name, value in values.items():
        c3d["parameters"][group][name]["value"] = value
