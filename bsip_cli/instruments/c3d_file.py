"""A measured C3D file as instruments, and back into a copy of the file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from textwrap import wrap
from typing import Any

import ezc3d
import numpy as np

from bsip_cli.errors import BadDataError
from bsip_cli.instruments.c3d_plates import METRES, WiredPlate, wired_plates
from bsip_cli.instruments.readings import Instruments

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
    columns = _marker_columns(c3d)
    before = _instruments(c3d, columns, wired, source)
    after = change(before)
    _cut(c3d, before, after)
    first = before.first_frame_of(after)
    kept = before.frames(first, first + len(after.points_m))
    _put_points(c3d, columns, kept, after)
    _put_forces(c3d, wired, kept, after)
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


def _labels(c3d: Any) -> list[str]:
    """POINT:LABELS, LABELS2 and so on."""
    point = c3d["parameters"]["POINT"]
    labels = list(point["LABELS"]["value"])
    number = 2
    while f"LABELS{number}" in point and len(labels) < c3d["data"]["points"].shape[1]:
        labels += list(point[f"LABELS{number}"]["value"])
        number += 1
    return labels


def _marker_columns(c3d: Any) -> np.ndarray:
    """Points that are markers, not angles or forces of a model."""
    point = c3d["parameters"]["POINT"]
    outputs = {label for name in MODEL_OUTPUTS if name in point for label in point[name]["value"]}
    labels = _labels(c3d)[: c3d["data"]["points"].shape[1]]
    return np.array([k for k, label in enumerate(labels) if label not in outputs], dtype=int)


def _scale_m(c3d: Any, file: object) -> float:
    unit = str(c3d["parameters"]["POINT"]["UNITS"]["value"][0]).strip()
    if unit not in METRES:
        raise BadDataError(f"points are in {unit!r}", expected="m, cm or mm", file=file)
    return METRES[unit]


def _instruments(
    c3d: Any, columns: np.ndarray, wired: list[WiredPlate], file: object
) -> Instruments:
    points = _scale_m(c3d, file) * c3d["data"]["points"][:3, columns].transpose(2, 1, 0)
    labels, analogs = _labels(c3d), c3d["data"]["analogs"][0]
    readings = np.array([plate.reading(analogs) for plate in wired])
    rate = float(c3d["parameters"]["POINT"]["RATE"]["value"][0])
    ratio = max(analogs.shape[1] // max(len(points), 1), 1)
    if not wired:
        readings = np.zeros((0, ratio * len(points), 6))
    return Instruments(
        labels=tuple(labels[k] for k in columns),
        points_m=points,
        marker_hz=rate,
        plates=tuple(plate.plate for plate in wired),
        readings=readings,
        analog_hz=rate * ratio,
        up=_up(points, wired),
    )


def _up(points_m: np.ndarray, wired: list[WiredPlate]) -> np.ndarray:
    """The lab axis nearest to the first plate's normal, to the side where the markers are."""
    if not wired:
        return np.array([0.0, 0.0, 1.0])
    plate = wired[0].plate
    axis = int(np.argmax(np.abs(plate.axes[:, 2])))
    above = np.nanmedian(points_m[..., axis]) - plate.centre_m[axis]
    return np.sign(above) * np.eye(3)[axis]


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


def _put_points(c3d: Any, columns: np.ndarray, before: Instruments, after: Instruments) -> None:
    """Markers that changed; a lost one stays as it was written."""
    gone = np.isnan(before.points_m) & np.isnan(after.points_m)
    frames, markers = np.nonzero(~((before.points_m == after.points_m) | gone).all(axis=2))
    placed = after.points_m[frames, markers].T / _scale_m(c3d, "")
    lost = np.isnan(placed).any(axis=0)
    was_lost = np.isnan(before.points_m[frames, markers]).any(axis=1)
    points = c3d["data"]["points"].copy()
    points[:3, columns[markers], frames] = np.where(lost, np.nan, placed)
    residuals = c3d["data"]["meta_points"]["residuals"].copy()
    kept = residuals[0, columns[markers], frames]
    residuals[0, columns[markers], frames] = np.select([lost, was_lost], [-1.0, 0.0], kept)
    c3d["data"]["points"] = points
    c3d["data"]["meta_points"]["residuals"] = residuals


def _put_forces(c3d: Any, wired: list[WiredPlate], before: Instruments, after: Instruments) -> None:
    """Channels whose plate reads otherwise."""
    analogs = c3d["data"]["analogs"].copy()
    for plate, old, new in zip(wired, before.readings, after.readings, strict=True):
        if not np.array_equal(old, new, equal_nan=True):
            analogs[0, plate.channels] = plate.changed(analogs[0], new - old)
    c3d["data"]["analogs"] = analogs
