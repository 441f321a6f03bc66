"""Write a trial as C3D: points, plates of types 1 to 4, and what the export says about them."""

from __future__ import annotations

import struct
from dataclasses import dataclass, replace
from pathlib import Path

import ezc3d
import numpy as np

from tests.circumstances.export import MOMENT_SIZES, SIZES, Export
from tests.circumstances.hidden import stored_points
from tests.circumstances.sound import Plate, Session, Trial, plate_axes

# A type 4 plate's sensitivities: nearly diagonal, [N/V] and [N m/V], with some cross talk.
SENSITIVITY = np.diag([250.0, 260.0, 500.0, 120.0, 110.0, 60.0])
CROSS_TALK = np.random.default_rng(4).normal(0.0, 0.004, (6, 6))


@dataclass(frozen=True, eq=False)
class _Stated:
    """A plate as the file describes it: channels (samples, 6 or 8), units, corners, origin."""

    channels: np.ndarray
    units: list[str]
    corners: np.ndarray
    origin: np.ndarray
    calibration: np.ndarray


def write_c3d(path: Path, session: Session, trial: Trial, export: Export, seed: int) -> None:
    """One trial; `trial` is at the export's rates, in the lab's frame."""
    content = ezc3d.c3d()
    _add_points(content, session, trial, export, seed)
    _add_plates(content, session, trial, export, seed)
    content.add_parameter("SUBJECTS", "NAMES", [""])
    content.write(str(path))
    if export.residuals == "negative":
        _mark_all_invalid(path, len(session.labels), len(trial.time_s))


def _mark_all_invalid(path: Path, n_points: int, n_frames: int) -> None:
    """Residual -1 in every point, coordinates kept, as files have it; ezc3d writes NaN there."""
    data = bytearray(path.read_bytes())
    start = (struct.unpack_from("<H", data, 16)[0] - 1) * 512
    samples = struct.unpack_from("<H", data, 4)[0]  # analog values of a frame
    size = 4 * (4 * n_points + samples)
    for frame in range(n_frames):
        for point in range(n_points):
            struct.pack_into("<f", data, start + frame * size + 16 * point + 12, -1.0)
    path.write_bytes(data)


def _add_points(
    content: ezc3d.c3d, session: Session, trial: Trial, export: Export, seed: int
) -> None:
    points, residuals = stored_points(trial.markers_m @ export.axes.T, export, seed)
    frames, markers, _ = points.shape
    labels = [export.label(name) for name in session.labels]
    point = content["parameters"]["POINT"]
    point["RATE"]["value"] = [export.marker_hz * export.stated_rate]
    point["LABELS"]["value"] = labels
    point["DESCRIPTIONS"]["value"] = [""] * markers
    point["UNITS"]["value"] = [export.stated_point_unit]
    homogeneous = np.ones((4, markers, frames))
    homogeneous[:3] = points.transpose(2, 1, 0)
    content["data"]["points"] = homogeneous
    content["data"]["meta_points"]["residuals"] = residuals.T[None]
    content["data"]["meta_points"]["camera_masks"] = np.zeros((7, markers, frames), dtype=bool)


def _add_plates(
    content: ezc3d.c3d, session: Session, trial: Trial, export: Export, seed: int
) -> None:
    plates = _stated_plates(session, trial, export, np.random.default_rng([seed, 78]))
    channels = np.hstack([plate.channels for plate in plates])
    count = len(plates[0].units)
    analog = content["parameters"]["ANALOG"]
    analog["RATE"]["value"] = [export.marker_hz * export.stated_rate * export.analog_per_marker]
    analog["LABELS"]["value"] = [
        f"P{i + 1}C{k + 1}" for i in range(len(plates)) for k in range(count)
    ]
    analog["UNITS"]["value"] = [unit for plate in plates for unit in plate.units]
    content["data"]["analogs"] = channels.T[None]
    listed = np.arange(1, count * len(plates) + 1).reshape(-1, count).T
    for plate, (one, other) in export.listed_twice.items():
        listed[other, plate] = listed[one, plate]
    values = {
        "USED": np.array([len(plates)]),
        "TYPE": np.full(len(plates), export.plate_type),
        "ZERO": np.array([1, 0]),
        "CORNERS": np.stack([p.corners.T for p in plates], axis=-1),
        "ORIGIN": np.stack([p.origin for p in plates], axis=-1),
        "CHANNEL": listed,
        "CAL_MATRIX": np.stack([p.calibration for p in plates], axis=-1),
    }
    group = content["parameters"]["FORCE_PLATFORM"]
    for name, array in values.items():
        if name not in group:
            content.add_parameter("FORCE_PLATFORM", name, [0.0])
        group[name]["value"] = array  # ezc3d writes lists as floats; integers must stay such
        group[name]["type"] = 2 if array.dtype.kind == "i" else 4


def _stated_plates(
    session: Session, trial: Trial, export: Export, rng: np.random.Generator
) -> list[_Stated]:
    seen = trial.seen_from(export.axes, np.zeros(3)).seen_from(export.force_axes, np.zeros(3))
    force, moment = seen.force_N, seen.moment_Nm
    plates = [_seen_plate(plate, export) for plate in session.plates]
    readings = [(force[:, k], moment[:, k]) for k in range(len(plates))]
    if export.summed:
        plates.append(_around(plates))
        readings.append((force.sum(axis=1), moment.sum(axis=1)))
    order = export.plate_order or range(len(plates))
    own = [
        _channels(plate, *reading, export, k)
        for k, (plate, reading) in enumerate(zip(plates, readings, strict=True))
    ]
    order = [*order, *range(len(order), len(plates))]
    stated = [_describe(plate, own[order[k]], export, k) for k, plate in enumerate(plates)]
    hit = stated[export.damaged_plate]
    if export.damage:
        rate = export.marker_hz * export.analog_per_marker
        hit = replace(hit, channels=export.damage(hit.channels, rate, rng))
    if export.limit_share:
        source = order[export.damaged_plate]
        cut = _limited(hit.channels, source, trial, session, export.limit_share)
        hit = replace(hit, channels=cut)
    stated[export.damaged_plate] = hit
    return [*stated, stated[0]] if export.doubled else stated


def _limited(
    channels: np.ndarray, plate: int, trial: Trial, session: Session, share: float
) -> np.ndarray:
    """Cut at an amplifier's limit; of a plate of type 3, one of its four vertical sensors."""
    channels, vertical = channels.copy(), 2 if channels.shape[1] == 6 else 4
    loads = {t.name: np.abs(t.force_N[:, plate, 2]).max() for t in session.trials}
    per_newton = np.abs(channels[:, vertical]).max() / loads[trial.name]
    quiet = next(load for name, load in loads.items() if "static" in name)
    most = (quiet + share * (max(loads.values()) - quiet)) * per_newton
    channels[:, vertical] = channels[:, vertical].clip(-most, most)
    return channels


def _seen_plate(plate: Plate, export: Export) -> Plate:
    """In the export's axes; a mirrored outline is wound so that z still points into the floor."""
    axes = export.force_axes @ export.axes
    corners = plate.corners_m @ axes.T
    return replace(plate, corners_m=corners if np.linalg.det(axes) > 0 else corners[[1, 0, 3, 2]])


def _around(plates: list[Plate]) -> Plate:
    """A virtual plate over all, with the first one's axes."""
    axes = plate_axes(plates[0].corners_m)
    local = np.vstack([p.corners_m for p in plates]) @ axes
    low, high = local.min(axis=0), local.max(axis=0)
    corners = np.array([[high[0], high[1]], [low[0], high[1]], [low[0], low[1]], [high[0], low[1]]])
    return Plate(np.column_stack([corners, np.full(4, local[0, 2])]) @ axes.T, plates[0].depth_m)


def _channels(
    plate: Plate, force: np.ndarray, moment: np.ndarray, export: Export, number: int
) -> np.ndarray:
    """(n, 6) forces [N] and moments [N m] in the plate's axes, about the export's reference."""
    axes, centre = plate_axes(plate.corners_m), plate.corners_m.mean(axis=0)
    own_force = force @ axes
    top = (moment - np.cross(centre, force)) @ axes
    if export.reference == "sensor":
        top = top - np.cross(own_force, [0.0, 0.0, -plate.depth_m])
    return export.channels(number, np.hstack([own_force, top]), (0, 1))


def _describe(plate: Plate, six: np.ndarray, export: Export, number: int) -> _Stated:
    size, moment_size = SIZES[export.corner_unit], MOMENT_SIZES[export.moment_unit]
    corners = np.roll(plate.corners_m, export.corner_roll.get(number, 0), axis=0)
    if export.corner_wound:
        corners = corners[::-1]
    corners = corners + export.plate_rise_m * (export.force_axes @ export.axes[:, 2])
    origin = _origin(plate, export)
    calibration = np.eye(6)
    unit = export.stated_moment_unit
    if export.plate_type == 1:
        channels, units = _with_point(six, export), ["N"] * 3 + [export.corner_unit] * 2 + [unit]
    elif export.plate_type == 3:
        channels, units, origin = _kistler(six, plate.depth_m)
        for one, other in filter(None, [export.sensors_exchanged.get(number)]):
            channels[:, [one, other]] = channels[:, [other, one]]
    else:
        channels = six / np.array([1.0] * 3 + [moment_size] * 3)
        units = ["N"] * 3 + [unit] * 3
        if export.plate_type == 4:
            calibration = (np.eye(6) + CROSS_TALK) @ SENSITIVITY
            calibration[3:] /= moment_size
            channels, units = channels @ np.linalg.inv(calibration).T, ["V"] * 6
    return _Stated(channels, units, corners / size, origin / size, calibration)


def _origin(plate: Plate, export: Export) -> np.ndarray:
    """(3,) [m] ORIGIN as the file states it."""
    if export.origin == "place":
        return plate.corners_m.mean(axis=0)
    sensor = np.array([0.0, 0.0, -plate.depth_m])
    return {"sensor": sensor, "reversed": -sensor, "zero": 0 * sensor}[export.origin]


def _with_point(six: np.ndarray, export: Export) -> np.ndarray:
    """(n, 6) type 1: force, point on the surface and free torque; zero where unloaded."""
    fx, fy, fz, mx, my, mz = six.T
    loaded = np.abs(fz) > 10.0
    divisor = np.where(loaded, fz, 1.0)
    px, py = np.where(loaded, -my / divisor, 0.0), np.where(loaded, mx / divisor, 0.0)
    free = np.where(loaded, mz - px * fy + py * fx, 0.0)
    size, moment_size = SIZES[export.corner_unit], MOMENT_SIZES[export.moment_unit]
    return np.column_stack([fx, fy, fz, px / size, py / size, free / moment_size])


def _kistler(six: np.ndarray, depth_m: float) -> tuple[np.ndarray, list[str], np.ndarray]:
    """(n, 8) type 3: four sensors at (+-a, +-b) under the surface; ORIGIN holds a, b, z."""
    a, b = 0.12, 0.20
    fx, fy, fz, mx, my, mz = six.T
    fx12, fy14 = fx / 2 - mz / (2 * b), fy / 2
    over, across = mx / (4 * b), my / (4 * a)
    # A bending plate: the load at a place goes to the corners as its distances from them have it.
    both = 4 * over * across / np.where(np.abs(fz) > 1.0, fz, np.inf)
    signs = ((1, -1), (1, 1), (-1, 1), (-1, -1))
    verticals = [fz / 4 + s * over + t * across + s * t * both for s, t in signs]
    channels = np.column_stack([fx12, fx - fx12, fy14, fy - fy14, *verticals])
    return channels, ["N"] * 8, np.array([a, b, -depth_m])
