"""A measured C3D file as instruments, and back into a copy of the file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import ezc3d
import numpy as np

from bsip_cli.errors import BadDataError
from bsip_cli.simulate.instruments import Instruments, SensingPlate

MODEL_OUTPUTS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS")
AGREEMENT = 1e-3  # with ezc3d's own extraction, of the largest value
METRES = {"m": 1.0, "mm": 1e-3, "cm": 1e-2}
MOMENTS = {"Nm": 1.0, "Nmm": 1e-3, "Ncm": 1e-2}


def inject_c3d(
    source: Path, copy: Path, change: Callable[[Instruments], Instruments]
) -> Instruments:
    """Write a copy of a C3D file with a change of what it holds; returns what it now holds.

    Raises
    ------
    BadDataError : not a readable C3D file; plates that cannot be changed; nothing changed.
    """
    try:
        c3d = ezc3d.c3d(str(source), extract_forceplat_data=True)
    except (OSError, RuntimeError, ValueError) as error:
        raise BadDataError(f"ezc3d cannot read it ({error})", file=source) from error
    group = c3d["parameters"].get("FORCE_PLATFORM", {})
    used = int(np.ravel(group["USED"]["value"])[0]) if "USED" in group else 0
    wired = [_wired(c3d, group, index, source) for index in range(used)]
    labels, columns = _markers(c3d)
    unit = str(c3d["parameters"]["POINT"]["UNITS"]["value"][0]).strip()
    if unit not in METRES:
        raise BadDataError(f"points are in {unit!r}", expected="m, cm or mm", file=source)
    before = _instruments(c3d, labels, columns, METRES[unit], wired)
    after = change(before)
    _cut(c3d, before, after)
    # markers that are seen; a lost one stays as it was written
    data = c3d["data"]
    points, residuals = data["points"].copy(), data["meta_points"]["residuals"].copy()
    placed = after.points_m.transpose(2, 1, 0) / METRES[unit]
    lost = np.isnan(placed).any(axis=0)
    points[:3, columns] = np.where(lost, np.nan, placed)
    residuals[:, columns] = np.where(lost, -1.0, residuals[:, columns])
    data["points"], data["meta_points"]["residuals"] = points, residuals
    # channels whose plate reads otherwise
    analogs, first = data["analogs"].copy(), before.first_frame_of(after)
    kept = before.frames(first, first + len(after.points_m))
    for plate, old, new in zip(wired, kept.readings, after.readings, strict=True):
        if not np.array_equal(old, new, equal_nan=True):
            analogs[0, plate.channels] = plate.changed(analogs[0], new - old)
    data["analogs"] = analogs
    c3d.write(str(copy))
    return after


def _markers(c3d: Any) -> tuple[tuple[str, ...], np.ndarray]:
    """Labels (POINT:LABELS, LABELS2 and so on) and columns of the points that are markers, not
    angles or forces of a model."""
    point, count = c3d["parameters"]["POINT"], c3d["data"]["points"].shape[1]
    labels, number = list(point["LABELS"]["value"]), 2
    while f"LABELS{number}" in point and len(labels) < count:
        labels += list(point[f"LABELS{number}"]["value"])
        number += 1
    outputs = {label for name in MODEL_OUTPUTS if name in point for label in point[name]["value"]}
    columns = [k for k, label in enumerate(labels[:count]) if label not in outputs]
    return tuple(labels[k] for k in columns), np.array(columns, dtype=int)


def _instruments(
    c3d: Any, labels: tuple[str, ...], columns: np.ndarray, scale_m: float, wired: list[WiredPlate]
) -> Instruments:
    points = scale_m * c3d["data"]["points"][:3, columns].transpose(2, 1, 0)
    analogs, rate = c3d["data"]["analogs"][0], float(c3d["parameters"]["POINT"]["RATE"]["value"][0])
    ratio = max(analogs.shape[1] // max(len(points), 1), 1)
    up = np.array([0.0, 0.0, 1.0])
    if wired:  # the axis nearest to the first plate's normal, to the side where the markers are
        plate = wired[0].plate
        axis = int(np.argmax(np.abs(plate.axes[:, 2])))
        above = np.nanmedian(points[..., axis]) - plate.centre_m[axis]
        up = np.sign(above) * np.eye(3)[axis]
    readings = [plate.reading(analogs) for plate in wired]
    return Instruments(
        labels=labels,
        points_m=points,
        marker_hz=rate,
        plates=tuple(plate.plate for plate in wired),
        readings=np.array(readings) if wired else np.zeros((0, ratio * len(points), 6)),
        analog_hz=rate * ratio,
        up=up,
    )


def _cut(c3d: Any, before: Instruments, after: Instruments) -> None:
    """Keep only the frames that are left."""
    first, frames = before.first_frame_of(after), len(after.points_m)
    kept, ratio = slice(first, first + frames), before.per_frame
    data, header = c3d["data"], c3d["header"]["points"]
    data["points"] = data["points"][:, :, kept]
    for name in ("residuals", "camera_masks"):
        data["meta_points"][name] = data["meta_points"][name][:, :, kept]
    data["analogs"] = data["analogs"][:, :, first * ratio : (first + frames) * ratio]
    header["first_frame"] += first
    header["last_frame"] = header["first_frame"] + frames - 1


# --- force plates: from analog channels to force and moment ---------------------------------------


@dataclass(frozen=True, eq=False)
class WiredPlate:
    """A plate and its wiring.

    channels : (k,) rows of the analog data. matrix : (6, k) from them to N and N m in the
        plate's axes, about its sensor.
    """

    plate: SensingPlate
    channels: np.ndarray
    matrix: np.ndarray

    def reading(self, analogs: np.ndarray) -> np.ndarray:
        """(N, 6) of the analog data (all channels, N)."""
        return analogs[self.channels].T @ self.matrix.T

    def changed(self, analogs: np.ndarray, change: np.ndarray) -> np.ndarray:
        """(k, N) its channels after a change (N, 6) of the reading, the smallest that does it."""
        return analogs[self.channels] + np.linalg.pinv(self.matrix) @ change.T


def _wired(c3d: Any, group: Any, index: int, file: Path) -> WiredPlate:
    """A plate that reads what ezc3d's own extraction says; of types linear in their channels."""
    kind = int(group["TYPE"]["value"][index])
    if kind not in (2, 3, 4):
        raise BadDataError(
            f"plate {index + 1} is of TYPE {kind}", expected="TYPE 2, 3 or 4", file=file
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
    channels = np.asarray(group["CHANNEL"]["value"])[: 8 if kind == 3 else 6, index].astype(int) - 1
    origin = length * np.ravel(np.asarray(group["ORIGIN"]["value"], dtype=float)[:, index])
    corners = extracted["corners"] * length  # (3, 4) in the order +x+y, -x+y, -x-y, +x-y
    x = corners[:, 0] - corners[:, 1]
    z = np.cross(x, corners[:, 0] - corners[:, 3])
    x, z = x / np.linalg.norm(x), z / np.linalg.norm(z)
    axes, centre = np.stack([x, np.cross(z, x), z], axis=1), corners.mean(axis=1)
    force, moment = extracted["force"].T, unit * extracted["moment"].T
    analogs = np.nan_to_num(c3d["data"]["analogs"][0])
    # the surface's centre from the sensor: as is written, with the other height, or, as the format
    # means it where the height is positive, from the centre to the sensor
    place = origin * [0.0, 0.0, 1.0] if kind == 3 else origin
    sensors = (place, place * [1.0, 1.0, -1.0], -place)
    for matrix, sensor in product(_matrices(kind, group, index, origin, unit), sensors):
        wired = WiredPlate(SensingPlate(axes, centre, centre - axes @ sensor), channels, matrix)
        ours = wired.plate.lab_wrench(wired.reading(analogs), centre)
        if all(_agree(*pair) for pair in zip(ours, (force, moment), strict=True)):
            return wired
    raise BadDataError(
        f"what plate {index + 1} reads does not follow from its description", file=file
    )


def _agree(ours: np.ndarray, theirs: np.ndarray) -> bool:
    most = AGREEMENT * np.nanmax(np.abs(theirs)) + 1e-9
    return bool(np.abs(ours - np.nan_to_num(theirs)).max() <= most)


def _matrices(
    kind: int, group: Any, index: int, origin_m: np.ndarray, unit: float
) -> list[np.ndarray]:
    """What may lead from channels to N and N m."""
    if kind == 3:  # fx12 fx34 fy14 fy23 fz1 fz2 fz3 fz4, sensors at (+-a, +-b)
        a, b = np.abs(origin_m[:2])
        eight = np.array(
            [
                [1, 1, 0, 0, 0, 0, 0, 0],
                [0, 0, 1, 1, 0, 0, 0, 0],
                [0, 0, 0, 0, 1, 1, 1, 1],
                [0, 0, 0, 0, b, b, -b, -b],
                [0, 0, 0, 0, -a, a, a, -a],
                [-b, b, a, -a, 0, 0, 0, 0],
            ]
        )
        return [eight, -eight]
    scale = np.diag(np.repeat([1.0, unit], 3))
    if kind == 2:
        return [scale, -scale]
    calibration = np.asarray(group["CAL_MATRIX"]["value"], dtype=float)[:6, :6, index]
    variants = [calibration, calibration.T]
    return [scale @ (sign * matrix) for matrix in variants for sign in (1.0, -1.0)]
