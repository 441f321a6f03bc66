"""Writers of small C3D, TRC and MOT files with a known content."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import ezc3d
import numpy as np

CORNERS_M = np.array([[0.4, 0.6, 0.0], [0.0, 0.6, 0.0], [0.0, 0.0, 0.0], [0.4, 0.0, 0.0]])
CORNERS_M = CORNERS_M[[1, 0, 3, 2]]  # wound so that the plate's z points into the floor
ORIGIN_M = np.array([0.001, -0.002, -0.04])
Y_UP_FROM_Z_UP = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])
X_UP_FROM_Z_UP = np.array([[0.0, 0, 1.0], [1.0, 0, 0], [0, 1.0, 0]])


@dataclass
class PlateSpec:
    """A plate and the wrench it should report: on the body, about the lab's origin."""

    force_N: np.ndarray  # (n, 3), lab frame
    moment_Nm: np.ndarray  # (n, 3), lab frame
    kind: int = 2
    corners_m: np.ndarray = field(default_factory=lambda: CORNERS_M)
    origin_m: np.ndarray = field(default_factory=lambda: ORIGIN_M)
    sign: float = 1.0
    stated_origin_m: np.ndarray | None = None

    def channels(self) -> np.ndarray:
        """Channels in N and N m (type 1: m), (6 or 8, n)."""
        c = self.corners_m
        x, y = c[0] - c[1], c[0] - c[3]
        axes = np.array([x, y, np.cross(x, y)]).T
        rotation = axes / np.linalg.norm(axes, axis=0)
        force = self.force_N @ rotation
        top = (self.moment_Nm - np.cross(c.mean(axis=0), self.force_N)) @ rotation
        if self.kind == 1:
            px, py = -top[:, 1] / force[:, 2], top[:, 0] / force[:, 2]
            free = top[:, 2] - px * force[:, 1] + py * force[:, 0]
            return np.column_stack([force, px, py, free]).T
        if self.kind == 3:
            return self.sign * self._kistler(force, top)
        moment = top - np.cross(force, self.origin_m)
        return self.sign * np.hstack([force, moment]).T

    def _kistler(self, force: np.ndarray, top: np.ndarray) -> np.ndarray:
        a, b, az0 = self.origin_m
        moment = top - np.cross(force, [0, 0, az0])
        fx, fy, fz = force.T
        fx12 = fx / 2 - moment[:, 2] / (2 * b)
        over = np.outer([1, 1, -1, -1], moment[:, 0] / (4 * b))
        across = np.outer([-1, 1, 1, -1], moment[:, 1] / (4 * a))
        return np.vstack([fx12, fx - fx12, fy / 2, fy / 2, fz / 4 + over + across])


def write_c3d(
    path: Path,
    markers_m: np.ndarray,
    labels: Sequence[str],
    plates: Sequence[PlateSpec] = (),
    rate_hz: float = 100.0,
    ratio: int = 10,
    unit: str = "mm",
    force_unit: str = "N",
    moment_unit: str = "Nmm",
    point_parameters: dict[str, list[str]] | None = None,
    channel_shift: int = 0,
) -> Path:
    """Markers (n, k, 3), lab frame, and plates into a C3D file; NaN = missing."""
    size = 1e-3 if unit.startswith("mi") or unit == "mm" else 1.0
    content = ezc3d.c3d()
    points = np.ones((4, markers_m.shape[1], len(markers_m)))
    points[:3] = np.transpose(markers_m, (2, 1, 0)) / size
    content["parameters"]["POINT"]["RATE"]["value"] = [rate_hz]
    content["parameters"]["POINT"]["LABELS"]["value"] = tuple(labels)
    content["parameters"]["POINT"]["UNITS"]["value"] = (unit,)
    for name, texts in (point_parameters or {}).items():
        if name in content["parameters"]["POINT"]:
            content["parameters"]["POINT"][name]["value"] = tuple(texts)
        else:
            content.add_parameter("POINT", name, texts)
    content["data"]["points"] = points
    if plates:
        _add_plates(content, plates, rate_hz * ratio, size, force_unit, moment_unit)
        group = content["parameters"]["FORCE_PLATFORM"]
        group["CHANNEL"]["value"] = group["CHANNEL"]["value"] + channel_shift
    content.write(str(path))
    return path


def _add_plates(
    content: ezc3d.c3d,
    plates: Sequence[PlateSpec],
    rate_hz: float,
    size: float,
    force_unit: str,
    moment_unit: str,
) -> None:
    moment_size = 1e-3 if "mm" in moment_unit else 1.0
    rows, units, channel = [], [], np.zeros((8, len(plates)), int)
    for i, plate in enumerate(plates):
        own = plate.channels()
        scale = np.ones(len(own))
        own_units = [force_unit] * len(own)
        if plate.kind == 1:
            scale[3:5], scale[5] = size, moment_size
            own_units[3:] = ["mm" if size == 1e-3 else "m"] * 2 + [moment_unit]
        elif plate.kind != 3:
            scale[3:], own_units[3:] = moment_size, [moment_unit] * 3
        channel[: len(own), i] = len(units) + 1 + np.arange(len(own))
        rows += list(own / scale[:, None])
        units += own_units
    analog = content["parameters"]["ANALOG"]
    analog["RATE"]["value"] = [rate_hz]
    analog["LABELS"]["value"] = tuple(f"ch{i + 1}" for i in range(len(rows)))
    content["data"]["analogs"] = np.array(rows)[None]
    analog["UNITS"]["value"] = tuple(units)
    _describe(content, plates, channel, size)


def _describe(
    content: ezc3d.c3d, plates: Sequence[PlateSpec], channel: np.ndarray, size: float
) -> None:
    stated = [p.origin_m if p.stated_origin_m is None else p.stated_origin_m for p in plates]
    values = {
        "USED": np.array([len(plates)]),
        "TYPE": np.array([p.kind for p in plates]),
        "ZERO": np.array([1, 0]),
        "CORNERS": np.stack([p.corners_m.T for p in plates], axis=-1) / size,
        "ORIGIN": np.stack(stated, axis=-1) / size,
        "CHANNEL": channel,
        "CAL_MATRIX": np.stack([np.eye(6)] * len(plates), axis=-1),
    }
    group = content["parameters"]["FORCE_PLATFORM"]
    for name, array in values.items():
        if name not in group:
            content.add_parameter("FORCE_PLATFORM", name, array.astype(float))
        group[name]["value"] = array
        group[name]["type"] = 2 if array.dtype.kind == "i" else 4


def write_trc(
    path: Path,
    time_s: np.ndarray | Sequence[str],
    markers_m: np.ndarray,
    labels: Sequence[str],
    unit: str = "mm",
    rate_hz: float = 100.0,
) -> Path:
    """Markers (n, k, 3), lab frame, as TRC; NaN as empty cells; times also as they are printed."""
    size = 1e-3 if unit == "mm" else 1.0
    n, k, _ = markers_m.shape
    names = "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits"
    lines = [f"PathFileType\t4\t(X/Y/Z)\t{path.name}", names]
    lines.append(f"{rate_hz:.12g}\t{rate_hz:.12g}\t{n}\t{k}\t{unit}")
    lines.append("Frame#\tTime\t" + "\t\t\t".join(labels))
    lines += ["\t\t" + "\t".join(f"{a}{i + 1}" for i in range(k) for a in "XYZ"), ""]
    for i, (t, frame) in enumerate(zip(time_s, markers_m / size, strict=True)):
        cells = ["" if np.isnan(x) else f"{x:.9g}" for x in frame.ravel()]
        lines.append("\t".join([str(i + 1), t if isinstance(t, str) else f"{t:.9g}", *cells]))
    path.write_text("\n".join(lines) + "\n")
    return path


def write_mot(
    path: Path, time_s: np.ndarray | Sequence[str], columns: dict[str, np.ndarray]
) -> Path:
    """Columns by name under 'time'; times also as they are printed."""
    lines = [path.stem, "version=1", f"nRows={len(time_s)}", "inDegrees=yes", "endheader"]
    lines.append("\t".join(["time", *columns]))
    for t, *row in zip(time_s, *columns.values(), strict=True):
        stamp = t if isinstance(t, str) else f"{t:.12g}"
        lines.append("\t".join([stamp, *(f"{x:.12g}" for x in row)]))
    path.write_text("\n".join(lines) + "\n")
    return path


def standing_markers(n: int, height_m: float = 1.7) -> tuple[np.ndarray, list[str]]:
    """Feet, pelvis, shoulders and head above the plate, Z up, slightly moving, (n, 8, 3)."""
    labels = ["LHEE", "LTOE", "RHEE", "RTOE", "LASI", "RASI", "C7", "HEAD"]
    base = np.array(
        [
            [0.1, 0.2, 0.05],
            [0.1, 0.4, 0.03],
            [0.3, 0.2, 0.05],
            [0.3, 0.4, 0.03],
            [0.1, 0.3, 0.55 * height_m],
            [0.3, 0.3, 0.55 * height_m],
            [0.2, 0.25, 0.85 * height_m],
            [0.2, 0.3, height_m],
        ]
    )
    sway = 1e-3 * np.sin(2 * np.pi * 0.5 * np.arange(n) / 100.0)
    markers = np.repeat(base[None], n, axis=0)
    markers[:, 4:, 0] += sway[:, None]
    return markers, labels


def standing_wrench(n: int, mass_kg: float = 70.0) -> tuple[np.ndarray, np.ndarray]:
    """A smooth push near the plate's centre: force, moment about the origin, (n, 3) each."""
    t = np.linspace(0, 1, n)
    weight_N = mass_kg * 9.80665
    force = np.column_stack(
        [12 * np.sin(6 * t), -9 * np.cos(5 * t), weight_N * (1 + 0.1 * np.sin(9 * t))]
    )
    point = np.column_stack([0.2 + 0.03 * np.sin(4 * t), 0.3 + 0.05 * np.cos(7 * t), 0 * t])
    free = np.column_stack([0 * t, 0 * t, 2 * np.sin(3 * t)])
    return force, np.cross(point, force) + free
