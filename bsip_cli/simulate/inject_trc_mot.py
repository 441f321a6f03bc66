"""A TRC file with its MOT file as instruments, and back into copies of both."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bsip_cli.errors import BadDataError
from bsip_cli.files.force_files import forces_beside
from bsip_cli.files.regular import check_regular
from bsip_cli.simulate.instruments import Instruments, SensingPlate
from bsip_cli.simulate.study import write_text

METRES = {"m": 1.0, "mm": 1e-3}
LOADED_N = 20.0
UNEVEN_SHARE = 0.02  # of a frame's length, by which a stamp may be off


@dataclass(frozen=True, eq=False)
class Table:
    """A text table. head : its lines before the data. values : (rows, columns)."""

    head: list[str]
    values: np.ndarray


@dataclass(frozen=True)
class ForceSet:
    """The nine columns of one plate in a MOT table: force, point, torque."""

    force: list[int]
    point: list[int]
    torque: list[int]


def inject_trc_mot(
    trc: Path, copy: Path, change: Callable[[Instruments], Instruments]
) -> Instruments:
    """Write copies of a TRC file and of the MOT file beside it with a change of what they hold.

    copy : the TRC file to be written; the MOT file goes beside it.

    Raises
    ------
    BadDataError : a file that is not what its ending says; times that do not match.
    """
    mot = forces_beside(trc)
    if mot is None:
        raise BadDataError("there are no forces beside it", expected="a .mot", file=trc)
    markers, labels, forces = *_read_trc(trc), _read_mot(mot)
    sets = _force_sets(forces, mot)
    names, values = markers.head[1].split("\t"), markers.head[2].split("\t")
    unit = dict(zip(names, values, strict=False)).get("Units", "").strip()
    if unit not in METRES:
        raise BadDataError(f"markers are in {unit!r}", expected="m or mm", file=trc)
    before = _instruments(markers, labels, forces, sets, METRES[unit], trc)
    after = change(before)
    write_text(copy, _new_trc(markers, before, after, METRES[unit]))
    forces_copy = copy.with_name(copy.stem + mot.name[len(trc.stem) :])
    write_text(forces_copy, _new_mot(forces, sets, before, after))
    return after


def _read_trc(file: Path) -> tuple[Table, tuple[str, ...]]:
    """The table, and the markers' labels."""
    lines = _lines(file)
    is_row = re.compile(r"\s*\d+\s+[-\d.]").match
    start = next((k for k in range(5, min(8, len(lines))) if is_row(lines[k])), 0)
    if not start or not lines[0].startswith("PathFileType"):
        raise BadDataError("this is no TRC file", file=file)
    labels = tuple(name.strip() for name in lines[3].split("\t")[2:] if name.strip())
    return _table(lines, start, "\t", 2 + 3 * len(labels), file), labels


def _read_mot(file: Path) -> Table:
    lines = _lines(file)
    ends = [k for k, line in enumerate(lines) if line.strip().lower() == "endheader"]
    if not ends:
        raise BadDataError("the line endheader is missing", file=file)
    start = ends[0] + 2
    return _table(lines, start, None, len("".join(lines[start - 1 : start]).split()), file)


def _lines(file: Path) -> list[str]:
    check_regular(file)
    try:
        return file.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError as error:
        raise BadDataError(f"it cannot be read ({error.strerror})", file=file) from error


def _table(lines: list[str], start: int, separator: str | None, least: int, file: Path) -> Table:
    """At least two rows and ``least`` columns; an empty or unreadable field is NaN."""
    rows = [line.rstrip("\r\n").split(separator) for line in lines[start:] if line.strip()]
    width = max(map(len, rows), default=0)
    if len(rows) < 2 or width < least or len(rows) * width > file.stat().st_size:
        raise BadDataError("this is no table", expected="rows as long as the heading", file=file)
    table = np.full((len(rows), width), np.nan)
    for k, row in enumerate(rows):
        table[k, : len(row)] = [_number(field) for field in row]
    return Table(lines[:start], table)


def _number(field: str) -> float:
    try:
        return float(field)
    except ValueError:
        return float("nan")


def _force_sets(table: Table, file: Path) -> list[ForceSet]:
    names = table.head[-1].split()
    column = {name: k for k, name in enumerate(names)}
    sets = []
    for prefix in [name[:-3] for name in names if name.endswith("_vx")]:
        for torque in (f"{prefix}_m", f"{prefix.replace('force', 'torque')}_"):
            wanted = [f"{p}{a}" for p in (f"{prefix}_v", f"{prefix}_p", torque) for a in "xyz"]
            if all(name in column for name in wanted):
                at = [column[name] for name in wanted]
                sets.append(ForceSet(at[:3], at[3:6], at[6:]))
                break
    if not sets:
        raise BadDataError(
            "no force, point and torque columns", expected="names as ground_force_vx", file=file
        )
    return sets


def _instruments(
    markers: Table,
    labels: tuple[str, ...],
    forces: Table,
    sets: list[ForceSet],
    scale: float,
    file: Path,
) -> Instruments:
    times, samples = markers.values[:, 1], forces.values[:, 0]
    points = scale * markers.values[:, 2 : 2 + 3 * len(labels)].reshape(len(times), -1, 3)
    ratio = round(len(samples) / len(times))
    if ratio < 1 or ratio * len(times) != len(samples):
        raise BadDataError(
            f"{len(samples)} rows of forces for {len(times)} frames",
            expected="a whole multiple, from the same start",
            file=file,
        )
    step = (times[-1] - times[0]) / (len(times) - 1)
    if np.abs(samples[::ratio] - times).max() > 0.1 * step:
        raise BadDataError("forces and markers have other times", file=file)
    even = np.abs(times - times[0] - step * np.arange(len(times))).max() < UNEVEN_SHARE * step
    if not even and ratio != 1:
        raise BadDataError("the frames' times are uneven", expected="even ones", file=file)
    plates = tuple(_plate(forces.values, each) for each in sets)
    readings = []
    for each, plate in zip(sets, plates, strict=True):
        force, torque = forces.values[:, each.force], np.nan_to_num(forces.values[:, each.torque])
        moment = np.cross(_points_m(forces.values, each, plate), force) + torque
        readings.append(plate.reading(force, moment, np.zeros(3)))
    total = np.nansum(np.stack(readings)[..., :3], axis=(0, 1))
    return Instruments(
        labels=labels,
        points_m=points,
        marker_hz=1.0 / step,
        plates=plates,
        readings=np.stack(readings),
        analog_hz=ratio / step,
        up=np.eye(3)[int(np.argmax(np.abs(total)))],  # the axis that carries most of the force
        stamps_s=None if even else times - times[0],
        surfaces_known=False,
    )


def _plate(values: np.ndarray, each: ForceSet) -> SensingPlate:
    """A plate whose sensor lies where the force acts in the mean: the file has no better place."""
    load = np.linalg.norm(np.nan_to_num(values[:, each.force]), axis=1)
    loaded = (load > LOADED_N) & np.isfinite(values[:, each.point]).all(axis=1)
    sensor = np.zeros(3)
    if loaded.any():
        sensor = np.average(values[:, each.point][loaded], axis=0, weights=load[loaded])
    return SensingPlate(np.eye(3), sensor, sensor)


def _points_m(values: np.ndarray, each: ForceSet, plate: SensingPlate) -> np.ndarray:
    """(N, 3) where the force acts; at the sensor in rows that do not say where."""
    point = values[:, each.point]
    return np.where(np.isfinite(point), point, plate.sensor_m)


def _with_reading(
    values: np.ndarray, each: ForceSet, plate: SensingPlate, reading: np.ndarray, up: np.ndarray
) -> np.ndarray:
    """Nine columns (N, 9) for a reading (N, 6): the point moves in its plane.

    The torque keeps its horizontal parts; below LOADED_N the point stays where it was.
    """
    force, moment = plate.lab_wrench(reading, np.zeros(3))
    point, torque = _points_m(values, each, plate), np.nan_to_num(values[:, each.torque])
    level = np.eye(3) - np.outer(up, up)
    upward = force @ up
    rest = moment - np.cross(point, force) - torque @ level
    loaded = np.abs(upward) > LOADED_N
    shift = np.cross(up, rest @ level) / np.where(loaded, upward, np.inf)[:, None]
    point = point + shift
    return np.hstack([force, point, moment - np.cross(point, force)])


def _new_trc(table: Table, before: Instruments, after: Instruments, scale: float) -> str:
    first, (frames, count, _) = before.first_frame_of(after), after.points_m.shape
    values = table.values[first : first + frames].copy()
    values[:, 2 : 2 + 3 * count] = after.points_m.reshape(frames, -1) / scale
    head = list(table.head)
    pairs = zip(head[1].split("\t"), head[2].split("\t"), strict=False)
    head[2] = "\t".join(str(frames) if name == "NumFrames" else fact for name, fact in pairs)
    rows = (
        [f"{row[0]:.0f}", *("" if np.isnan(x) else f"{x:.9g}" for x in row[1:])] for row in values
    )
    return "\n".join([*head, *map("\t".join, rows)]) + "\n"


def _new_mot(table: Table, sets: list[ForceSet], before: Instruments, after: Instruments) -> str:
    first = before.first_frame_of(after) * before.per_frame
    values = table.values[first : first + after.readings.shape[1]].copy()
    for each, plate, reading in zip(sets, after.plates, after.readings, strict=True):
        columns = [*each.force, *each.point, *each.torque]
        values[:, columns] = _with_reading(values, each, plate, reading, after.up)
    head = [re.sub(r"(?i)^nRows=.*", f"nRows={len(values)}", line) for line in table.head]
    rows = ["\t".join(f"{x:.9g}" for x in row) for row in values]
    return "\n".join([*head, *rows]) + "\n"
