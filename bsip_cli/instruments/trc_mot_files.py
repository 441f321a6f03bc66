"""A TRC file with its MOT file as instruments, and back into copies of both."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bsip_cli.errors import BadDataError
from bsip_cli.files.regular import check_regular, forces_beside
from bsip_cli.instruments.readings import Instruments, SensingPlate

METRES = {"m": 1.0, "mm": 1e-3}
LOADED_N = 20.0
STILL_M = 1e-6
UNEVEN_SHARE = 0.02  # of a frame's length, by which a stamp may be off


@dataclass(frozen=True, eq=False)
class Table:
    """A text table. head : its lines before the data. values : (rows, columns)."""

    head: list[str]
    values: np.ndarray


def rewrite_trc_mot(
    trc: Path,
    copy: Path,
    change: Callable[[Instruments], Instruments],
    said: Sequence[str] = (),
) -> Instruments:
    """Write copies of a TRC file and of the MOT file next to it with other readings.

    A file that does not change is copied as it is, but for what the MOT's header says.

    copy : the TRC file to be written; the MOT file goes next to it. said : what the header of the
        MOT says of the change, a line each.

    Raises
    ------
    BadDataError : a file that is not what its ending says; times that do not match.
    """
    mot = forces_beside(trc)
    if mot is None:
        raise BadDataError("there are no forces next to it", expected="a .mot", file=trc)
    markers, forces = _read_trc(trc), _read_mot(mot)
    sets = _columns_of_plates(forces, mot)
    scale = _scale_m(markers, trc)
    before = _instruments(markers, forces, sets, scale, trc)
    after = change(before)
    other_rate = before.marker_hz != after.marker_hz
    moved, loaded = (
        other_rate
        or not np.array_equal(getattr(before, name), getattr(after, name), equal_nan=True)
        for name in ("points_m", "readings")
    )
    write_whole(copy, _new_trc(markers, before, after, scale) if moved else trc.read_bytes())
    content: str | bytes = mot.read_bytes()
    if loaded:
        content = _new_mot(forces, sets, before, after, said)
    elif said:  # other markers alone are told there as well: a TRC file has no place for it
        content = "\n".join([*forces.head[:-2], *said, *_lines(mot)[len(forces.head) - 2 :]]) + "\n"
    write_whole(copy.with_name(copy.stem + mot.name[len(trc.stem) :]), content)
    return after


def _read_trc(file: Path) -> Table:
    lines = _lines(file)
    is_row = [bool(re.match(r"\s*\d+\s+[-\d.]", line)) for line in lines[:8]]
    start = next((k for k in range(5, len(is_row)) if is_row[k]), 0)
    if not start or not lines[0].startswith("PathFileType"):
        raise BadDataError("this is no TRC file", file=file)
    width = 2 + 3 * len(_trc_labels(lines[:start]))
    return Table(lines[:start], _values(lines[start:], "\t", width, file))


def _read_mot(file: Path) -> Table:
    lines = _lines(file)
    ends = [k for k, line in enumerate(lines) if line.strip().lower() == "endheader"]
    if not ends:
        raise BadDataError("the line endheader is missing", file=file)
    start = ends[0] + 2
    width = len("".join(lines[start - 1 : start]).split())
    return Table(lines[:start], _values(lines[start:], None, width, file))


def _lines(file: Path) -> list[str]:
    check_regular(file)
    try:
        return file.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError as error:
        raise BadDataError(f"it cannot be read ({error.strerror})", file=file) from error


def _values(lines: list[str], separator: str | None, least: int, file: Path) -> np.ndarray:
    """(rows, columns), at least two and ``least``; an empty or unreadable field is NaN."""
    rows = [line.rstrip("\r\n").split(separator) for line in lines if line.strip()]
    width = max(map(len, rows), default=0)
    if len(rows) < 2 or width < least or len(rows) * width > file.stat().st_size:
        raise BadDataError("this is no table", expected="rows as long as the heading", file=file)
    table = np.full((len(rows), width), np.nan)
    for k, row in enumerate(rows):
        table[k, : len(row)] = [_number(field) for field in row]
    return table


def _number(field: str) -> float:
    try:
        return float(field)
    except ValueError:
        return float("nan")


def _trc_labels(head: list[str]) -> list[str]:
    return [name.strip() for name in head[3].split("\t")[2:] if name.strip()]


def _scale_m(table: Table, file: Path) -> float:
    names, values = table.head[1].split("\t"), table.head[2].split("\t")
    unit = dict(zip(names, values, strict=False)).get("Units", "").strip()
    if unit not in METRES:
        raise BadDataError(f"markers are in {unit!r}", expected="m or mm", file=file)
    return METRES[unit]


def _columns_of_plates(table: Table, file: Path) -> list[list[int]]:
    """The nine columns of each plate: force, point, torque."""
    names = table.head[-1].split()
    column = {name: k for k, name in enumerate(names)}
    sets = []
    for prefix in [name[:-3] for name in names if name.endswith("_vx")]:
        torque = prefix.replace("force", "torque")
        for pattern in (f"{prefix}_m", f"{torque}_"):
            wanted = [f"{prefix}_v{a}" for a in "xyz"] + [f"{prefix}_p{a}" for a in "xyz"]
            wanted += [f"{pattern}{a}" for a in "xyz"]
            if all(name in column for name in wanted):
                sets.append([column[name] for name in wanted])
                break
    if not sets:
        raise BadDataError(
            "no force, point and torque columns", expected="names as ground_force_vx", file=file
        )
    return sets


def _instruments(
    markers: Table, forces: Table, sets: list[list[int]], scale: float, file: Path
) -> Instruments:
    labels = _trc_labels(markers.head)
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
    plates, readings = [], []
    for acting in (forces.values[:, columns] for columns in sets):
        plates.append(plate := _plate(acting))
        force, point, torque = _known(acting, plate)
        readings.append(plate.reading(force, np.cross(point, force) + torque, np.zeros(3)))
    # The lab axis that carries most of the force.
    total = np.nansum(np.stack(readings)[..., :3], axis=(0, 1))
    return Instruments(
        labels=tuple(labels),
        points_m=points,
        marker_hz=1.0 / step,
        plates=tuple(plates),
        readings=np.stack(readings),
        analog_hz=ratio / step,
        up=np.eye(3)[int(np.argmax(np.abs(total)))],
        stamps_s=None if even else times - times[0],
        surfaces_known=False,
    )


def _plate(acting: np.ndarray) -> SensingPlate:
    """A plate whose sensor lies where the force acts in the mean: the file has no better place;
    acting (N, 9) force, point and torque."""
    force, point, _ = np.hsplit(acting, 3)
    load = np.linalg.norm(np.nan_to_num(force), axis=1)
    loaded = (load > LOADED_N) & np.isfinite(point).all(axis=1)
    if not loaded.any():
        return SensingPlate(np.eye(3), np.zeros(3), np.zeros(3))
    sensor = np.average(point[loaded], axis=0, weights=load[loaded])
    return SensingPlate(np.eye(3), sensor, sensor)


def _known(acting: np.ndarray, plate: SensingPlate) -> list[np.ndarray]:
    """Force, point and torque (N, 3); the point is the sensor's in rows that do not say where."""
    force, point, torque = np.hsplit(acting, 3)
    return [force, np.where(np.isfinite(point), point, plate.sensor_m), np.nan_to_num(torque)]


def _with_reading(
    acting: np.ndarray, plate: SensingPlate, reading: np.ndarray, up: np.ndarray
) -> np.ndarray:
    """Nine columns (N, 9) for a reading (N, 6): the point moves in its plane.

    The torque keeps its horizontal parts; below LOADED_N the point stays where it was. Points that
    all are one place are no centres of pressure, and stay it.
    """
    force, moment = plate.lab_wrench(reading, np.zeros(3))
    before, point, torque = _known(acting, plate)
    under_load = point[np.abs(before @ up) > LOADED_N]
    if len(under_load) and np.ptp(under_load, axis=0).max() < STILL_M:
        return np.hstack([force, point, moment - np.cross(point, force)])
    level = np.eye(3) - np.outer(up, up)
    upward = force @ up
    rest = moment - np.cross(point, force) - torque @ level
    loaded = np.abs(upward) > LOADED_N
    shift = np.cross(up, rest @ level) / np.where(loaded, upward, np.inf)[:, None]
    point = point + shift
    return np.hstack([force, point, moment - np.cross(point, force)])


def _new_trc(table: Table, before: Instruments, after: Instruments, scale: float) -> str:
    first, frames = before.first_frame_of(after), len(after.points_m)
    values = table.values[first : first + frames].copy()
    count = after.points_m.shape[1]
    values[:, 2 : 2 + 3 * count] = after.points_m.reshape(frames, -1) / scale
    head = list(table.head)
    names, facts = head[1].split("\t"), head[2].split("\t")
    slower = before.marker_hz / after.marker_hz
    values[:, 1] *= slower
    for k, (name, fact) in enumerate(zip(names, facts, strict=False)):
        if name == "NumFrames":
            facts[k] = str(frames)
        elif name.endswith("Rate") and slower != 1:
            facts[k] = f"{_number(fact) / slower:.9g}"
    head[2] = "\t".join(facts)
    rows = [
        "\t".join([f"{row[0]:.0f}", *("" if np.isnan(x) else f"{x:.9g}" for x in row[1:])])
        for row in values
    ]
    return "\n".join([*head, *rows]) + "\n"


def _new_mot(
    table: Table,
    sets: list[list[int]],
    before: Instruments,
    after: Instruments,
    said: Sequence[str],
) -> str:
    first = before.first_frame_of(after) * before.per_frame
    values = table.values[first : first + after.readings.shape[1]].copy()
    for columns, plate, reading in zip(sets, after.plates, after.readings, strict=True):
        values[:, columns] = _with_reading(values[:, columns], plate, reading, after.up)
    values[:, 0] *= before.marker_hz / after.marker_hz
    head = [re.sub(r"(?i)^nRows=.*", f"nRows={len(values)}", line) for line in table.head]
    head[-2:-2] = said  # before the line endheader and the names
    rows = ["\t".join(f"{x:.9g}" for x in row) for row in values]
    return "\n".join([*head, *rows]) + "\n"


def write_whole(file: Path, content: str | bytes) -> None:
    """Under a temporary name first: no half file under the final one."""
    partial = file.with_name(file.name + ".part")
    partial.write_bytes(content.encode() if isinstance(content, str) else content)
    partial.replace(file)
