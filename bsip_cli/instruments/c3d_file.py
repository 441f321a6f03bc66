"""A measured C3D file as instruments, how its plates read, and back into a copy of the file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from textwrap import wrap
from typing import Any

import ezc3d
import numpy as np

from bsip_cli.errors import BadDataError
from bsip_cli.instruments.readings import Instruments, SensingPlate

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
            force, (x, y, torque) = read[:, :3], read[:, 3:].T.copy()
            level = np.stack([x, y, np.zeros(len(x))], axis=1)
            read[:, 3:] = np.cross(level, force)
            read[:, 5] += torque
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
            about = mz - (point[:, 0] * force[:, 1] - point[:, 1] * force[:, 0])
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
    corners = extracted["corners"] * length  # (3, 4), in the order +x+y, -x+y, -x-y, +x-y
    x = corners[:, 0] - corners[:, 1]
    z = np.cross(x, corners[:, 0] - corners[:, 3])
    x, z = x / np.linalg.norm(x), z / np.linalg.norm(z)
    axes, centre = np.stack([x, np.cross(z, x), z], axis=1), corners.mean(axis=1)
    # Where the surface's centre may lie from the sensor, plate axes: as is written, with the other
    # height, or, as the format means it of a positive height, from the centre to the sensor.
    offset = length * origin * {1: [0, 0, 0], 3: [0, 0, 1]}.get(kind, [1, 1, 1])
    sensors = [offset, offset * [1, 1, -1], -offset]
    analogs = np.nan_to_num(c3d["data"]["analogs"][0])
    for matrix, sensor in product(_matrices(kind, group, index, origin, length, unit), sensors):
        place = SensingPlate(axes, centre, centre - axes @ sensor)
        wired = WiredPlate(place, channels, matrix, has_points=kind == 1)
        if _agrees(wired, analogs, extracted, unit):
            return wired
    raise BadDataError(
        f"what plate {index + 1} reads does not follow from its description", file=file
    )


def _matrices(
    kind: int, group: Any, index: int, origin: np.ndarray, length: float, unit: float
) -> list[np.ndarray]:
    """What may lead from channels to N and N m."""
    scale = np.diag(np.repeat([1.0, unit], 3))
    if kind == 3:  # fx12 fx34 fy14 fy23 fz1 fz2 fz3 fz4, sensors at (+-a, +-b)
        a, b = np.abs(origin[:2]) * length
        one = np.array(
            [
                [1, 1, 0, 0, 0, 0, 0, 0],
                [0, 0, 1, 1, 0, 0, 0, 0],
                [0, 0, 0, 0, 1, 1, 1, 1],
                [0, 0, 0, 0, b, b, -b, -b],
                [0, 0, 0, 0, -a, a, a, -a],
                [-b, b, a, -a, 0, 0, 0, 0],
            ]
        )
        return [one, -one]
    if kind == 1:
        both = product((1.0, -1.0), (length, 1.0, 1e-3))
        return [np.diag([s, s, s, points, points, s * unit]) for s, points in both]
    if kind == 2:
        return [scale, -scale]
    calibration = np.asarray(group["CAL_MATRIX"]["value"], dtype=float)[:6, :6, index]
    variants = [calibration, calibration.T]
    return [scale @ (sign * matrix) for matrix in variants for sign in (1.0, -1.0)]


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


# --- a measured C3D file as instruments, and back into a copy of the file -------------------------


MODEL_OUTPUTS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS")
_LINE = 120  # letters: a C3D file counts a text's in one byte, which some readers take as signed


def rewrite_c3d(
    source: Path,
    copy: Path,
    change: Callable[[Instruments], Instruments],
    said: Sequence[str] = (),
) -> Instruments:
    """Write a copy of a C3D file with other readings; returns what it now holds.

    said : what the parameter group BSIP of the copy says of the change, a line each.

    Raises
    ------
    BadDataError : not a readable C3D file; plates that cannot be changed.
    """
    try:
        c3d = ezc3d.c3d(str(source), extract_forceplat_data=True)
    except (OSError, RuntimeError, ValueError) as error:
        raise BadDataError(f"ezc3d cannot read it ({error})", file=source) from error
    wired = wired_plates(c3d, source)
    markers, scale = _markers(c3d), _scale_m(c3d, source)
    before = _instruments(c3d, markers, wired, scale)
    after = change(before)
    _cut(c3d, before, after)
    first = before.first_frame_of(after)
    kept = before.frames(first, first + len(after.points_m))
    _put_points(c3d, np.array(list(markers), dtype=int), kept, after, scale)
    analogs = c3d["data"]["analogs"].copy()
    for plate, old, new in zip(wired, kept.readings, after.readings, strict=True):
        if not np.array_equal(old, new, equal_nan=True):
            analogs[0, plate.channels] = plate.changed(analogs[0], new - old)
    c3d["data"]["analogs"] = analogs
    if after.marker_hz != before.marker_hz:
        for group in ("POINT", "ANALOG"):
            rate = c3d["parameters"][group]["RATE"]
            rate["value"] = np.array(rate["value"], float) * after.marker_hz / before.marker_hz
    if said:
        lines = [part for line in said for part in wrap(line, _LINE)]
        c3d.add_parameter("BSIP", "CORRECTED", lines)
    _write(c3d, copy, source)
    return after


def _write(c3d: Any, copy: Path, source: Path) -> None:
    """All of it, or nothing."""
    partial = copy.with_name(f".{copy.stem}.part.c3d")  # ezc3d wants this ending
    try:
        c3d.write(str(partial))
        partial.replace(copy)
    except (RuntimeError, ValueError) as error:
        raise BadDataError(f"ezc3d cannot write it again ({error})", file=source) from error
    finally:
        partial.unlink(missing_ok=True)


def _markers(c3d: Any) -> dict[int, str]:
    """The labels (POINT:LABELS, LABELS2 and so on) of points that are markers, not angles or forces
    of a model, by column."""
    point = c3d["parameters"]["POINT"]
    labels, number = list(point["LABELS"]["value"]), 2
    while (more := f"LABELS{number}") in point:
        labels += list(point[more]["value"])
        number += 1
    outputs = {label for name in MODEL_OUTPUTS if name in point for label in point[name]["value"]}
    labels = labels[: c3d["data"]["points"].shape[1]]
    return {k: label for k, label in enumerate(labels) if label not in outputs}


def _scale_m(c3d: Any, file: object) -> float:
    unit = str(c3d["parameters"]["POINT"]["UNITS"]["value"][0]).strip()
    if unit not in METRES:
        raise BadDataError(f"points are in {unit!r}", expected="m, cm or mm", file=file)
    return METRES[unit]


def _instruments(
    c3d: Any, markers: dict[int, str], wired: list[WiredPlate], scale: float
) -> Instruments:
    points = scale * c3d["data"]["points"][:3, list(markers)].transpose(2, 1, 0)
    analogs = c3d["data"]["analogs"][0]
    readings = np.array([plate.reading(analogs) for plate in wired])
    rate = float(c3d["parameters"]["POINT"]["RATE"]["value"][0])
    ratio = max(analogs.shape[1] // max(len(points), 1), 1)
    up = np.array([0.0, 0.0, 1.0])
    if wired:  # the lab axis nearest to the first plate's normal, to the side where the markers are
        plate = wired[0].plate
        axis = int(np.argmax(np.abs(plate.axes[:, 2])))
        up = np.sign(np.nanmedian(points[..., axis]) - plate.centre_m[axis]) * np.eye(3)[axis]
    else:
        readings = np.zeros((0, ratio * len(points), 6))
    return Instruments(
        labels=tuple(markers.values()),
        points_m=points,
        marker_hz=rate,
        plates=tuple(plate.plate for plate in wired),
        readings=readings,
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


def _put_points(
    c3d: Any, columns: np.ndarray, before: Instruments, after: Instruments, scale: float
) -> None:
    """Markers that changed; a lost one stays as it was written."""
    gone = np.isnan(before.points_m) & np.isnan(after.points_m)
    frames, markers = np.nonzero(~((before.points_m == after.points_m) | gone).all(axis=2))
    placed = after.points_m[frames, markers].T / scale
    lost = np.isnan(placed).any(axis=0)
    was_lost = np.isnan(before.points_m[frames, markers]).any(axis=1)
    points = c3d["data"]["points"].copy()
    points[:3, columns[markers], frames] = np.where(lost, np.nan, placed)
    residuals = c3d["data"]["meta_points"]["residuals"].copy()
    kept = residuals[0, columns[markers], frames]
    residuals[0, columns[markers], frames] = np.select([lost, was_lost], [-1.0, 0.0], kept)
    c3d["data"]["points"] = points
    c3d["data"]["meta_points"]["residuals"] = residuals
