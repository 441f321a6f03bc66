"""Write a trial as TRC and MOT."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.circumstances.export import MOMENT_SIZES, SIZES, Export
from tests.circumstances.hidden import stored_points
from tests.circumstances.sound import Session, Trial

LOADED_N = 15.0
_Three = tuple[np.ndarray, np.ndarray, np.ndarray]


def write_trc(path: Path, session: Session, trial: Trial, export: Export, seed: int) -> None:
    """Markers; gaps as empty cells."""
    points, _ = stored_points(trial.markers_m @ export.axes.T, export, seed)
    frames, markers, _ = points.shape
    labels = [export.label(name) for name in session.labels]
    rate = f"{export.marker_hz * export.stated_rate:g}"
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame"
        "\tOrigNumFrames",
        "\t".join(
            [
                rate,
                rate,
                str(frames),
                str(markers),
                export.stated_point_unit,
                rate,
                "1",
                str(frames),
            ]
        ),
        "Frame#\tTime\t" + "\t\t\t".join(labels) + "\t\t",
        "\t\t" + "\t".join(f"{a}{k + 1}" for k in range(markers) for a in "XYZ"),
        "",
    ]
    unnamed = ["0.5"] * (3 * export.unnamed)
    for k, (time, row) in enumerate(zip(trial.time_s, points.reshape(frames, -1), strict=True)):
        cells = ["" if np.isnan(x) else f"{x:.5f}" for x in row]
        more = unnamed if k % 3 == 0 else []
        stamp = _stamp(time / export.stated_rate + export.trc_start_s, k, export)
        lines.append("\t".join([str(k + 1), stamp, *cells, *more]))
    path.write_text("\n".join(lines) + "\n")


def _stamp(time_s: float, frame: int, export: Export) -> str:
    if export.time_unit == "frames":
        return str(frame + 1)
    scale = 1000.0 if export.time_unit == "ms" else 1.0
    return f"{scale * time_s:.{export.time_decimals}f}"


def write_mot(path: Path, trial: Trial, export: Export, centres_m: np.ndarray) -> None:
    """Forces on the body; centres_m : (plates, 3) of the plates' surfaces in the lab."""
    seen = trial.seen_from(export.axes, np.zeros(3)).seen_from(export.force_axes, np.zeros(3))
    centres = centres_m @ (export.force_axes @ export.axes).T
    up = export.force_axes @ export.axes @ np.array([0.0, 0.0, 1.0])
    count = seen.force_N.shape[1]
    order = export.plate_order or list(range(count))
    own = [_columns(seen, k, centres[k], up, export) for k in range(count)]
    columns: dict[str, np.ndarray] = {}
    # Exchanged plates: the force and torque of one stand with the points of the other.
    for k in range(count):
        force, _, moment = own[order[k]]
        six = export.channels(k, np.hstack([force, moment]), np.argsort(np.abs(up))[:2])
        _add(columns, k + 1, six[:, :3], own[k][1], six[:, 3:], export)
    if export.doubled:
        _add(columns, count + 1, *own[0], export)
    if export.summed:
        total = _columns_of(
            seen.force_N.sum(axis=1), seen.moment_Nm.sum(axis=1), centres.mean(axis=0), up, export
        )
        _add(columns, count + 1, *total, export)
    scale = 1000.0 if export.time_unit == "ms" else 1.0
    time = scale * (seen.analog_s / export.mot_rate + export.mot_start_s)
    lines = [
        path.stem,
        "version=1",
        f"nRows={len(time)}",
        f"nColumns={len(columns) + 1}",
        "inDegrees=yes",
        "endheader",
        "\t".join(["time", *columns]),
    ]
    decimals = max(export.time_decimals, 4 if export.time_unit == "s" else 1)
    table = np.column_stack(list(columns.values()))
    for stamp, row in zip(time, table, strict=True):
        lines.append("\t".join([f"{stamp:.{decimals}f}", *(f"{x:.6f}" for x in row)]))
    path.write_text("\n".join(lines) + "\n")


def _columns(seen: Trial, k: int, centre: np.ndarray, up: np.ndarray, export: Export) -> _Three:
    return _columns_of(seen.force_N[:, k], seen.moment_Nm[:, k], centre, up, export)


def _columns_of(
    force: np.ndarray, moment: np.ndarray, centre: np.ndarray, up: np.ndarray, export: Export
) -> _Three:
    """(n, 3) each: force, point on the floor, and the moment about the export's reference."""
    vertical = force @ up
    loaded = np.abs(vertical) > LOADED_N
    divisor = np.where(loaded, vertical, 1.0)[:, None]
    # On the surface u.p = 0 the centre of pressure is (u x M) / (u.F), M about the lab's origin.
    point = np.cross(up, moment) / divisor
    point = point - np.outer(point @ up, up)
    about = {
        "point": moment - np.cross(point, force),
        "plate_centre": moment - np.cross(np.broadcast_to(centre, force.shape), force),
        "lab_origin": moment,
    }[export.reference]
    point = point + export.plate_rise_m * up
    gap = np.nan if export.mot_unloaded == "nan" else 0.0
    force = np.where(loaded[:, None], force, 0.0)
    point, about = (np.where(loaded[:, None], x, gap) for x in (point, about))
    force, about = force / export.mot_force_N, about / export.mot_force_N
    return force, point / SIZES[export.mot_point_unit], about / MOMENT_SIZES[export.moment_unit]


def _add(
    columns: dict[str, np.ndarray],
    number: int,
    force: np.ndarray,
    point: np.ndarray,
    moment: np.ndarray,
    export: Export,
) -> None:
    kept = (True, export.mot_points, export.mot_moments)
    patterns = export.mot_columns.split()
    for pattern, values, keep in zip(patterns, (force, point, moment), kept, strict=True):
        for axis, letter in enumerate("xyz" if keep else ""):
            columns[pattern.format(n=number, a=letter)] = values[:, axis]
