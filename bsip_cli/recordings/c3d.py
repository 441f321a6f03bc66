"""C3D files: markers and force plates through ezc3d."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import ezc3d
import numpy as np

from bsip_cli.errors import BadDataError
from bsip_cli.recordings import world
from bsip_cli.recordings.analog import check_samples
from bsip_cli.recordings.assemble import Forces, PlateSource, settle_forces
from bsip_cli.recordings.c3d_header import check_header
from bsip_cli.recordings.c3d_parameters import check_parameters
from bsip_cli.recordings.c3d_plates import PlateChannels, plate_surfaces, read_plates, value
from bsip_cli.recordings.c3d_points import Points, read_points
from bsip_cli.recordings.model import Finding, Recording
from bsip_cli.recordings.plates import local_wrench
from bsip_cli.recordings.units import length_in_m


def read_c3d(path: Path) -> Recording:
    """Markers and plates of a C3D file, SI, Z-up world frame."""
    header = check_header(path)
    check_parameters(path, header.data_start_block)
    content = _open(path)
    parameters = content["parameters"]
    rate_hz = _positive(content["header"]["points"]["frame_rate"], "POINT:RATE", path)
    unit_m, unit_findings = _length_unit(parameters, content)
    points = read_points(parameters, content, unit_m)
    analog = content["data"]["analogs"][0]
    per_frame = max(1, analog.shape[1] // max(1, len(points.positions_m)))
    plates, plate_findings = read_plates(parameters, analog, per_frame, unit_m)
    up = _up(parameters, points, plate_surfaces(parameters, unit_m))
    forces = settle_forces(
        [_source(plate, rate_hz * per_frame) for plate in plates], world.rotation_to_z_up(up)
    )
    return _recording(path, content, points, per_frame, up, forces, unit_findings + plate_findings)


def _open(path: Path) -> ezc3d.c3d:
    try:
        return ezc3d.c3d(str(path))
    except (RuntimeError, OSError, ValueError, TypeError, IndexError, MemoryError) as error:
        raise BadDataError(
            f"ezc3d cannot read it: {str(error).strip().rstrip('.')}",
            expected="a standard C3D file",
            remedy="export the trial again",
            file=path,
        ) from error


def _positive(number: float, name: str, path: Path) -> float:
    if not np.isfinite(number) or number <= 0:
        raise BadDataError(f"{name} is {number:g} Hz", expected="a rate above 0 Hz", file=path)
    return float(number)


def _length_unit(parameters: Mapping, content: Mapping) -> tuple[float, list[Finding]]:
    """Size of the unit of points; guessed from the size of the scene if it is misspelt."""
    units = value(parameters.get("POINT", {}), "UNITS")
    stated = units[0] if len(units) else ""
    size = length_in_m(stated)
    exact = stated.strip().lower() in ("m", "mm", "cm")
    if size is None:
        extent = np.nanmax(np.abs(content["data"]["points"][:3]), initial=0.0)
        size = 1e-3 if extent > 20.0 else 1.0
    if exact:
        return size, []
    finding = Finding(
        check="unit",
        subject="points",
        found=f"POINT:UNITS '{stated}'",
        expected="m or mm",
        action=f"read lengths in {'m' if size == 1.0 else 'mm' if size == 1e-3 else 'cm'}",
        level="corrected",
    )
    return size, [finding]


def _up(parameters: Mapping, points: Points, surfaces: Sequence[np.ndarray]) -> world.Up:
    """From the plates and the markers above them, else the labels, else what the file says."""
    surface = None
    if surfaces:
        normals = np.array([np.cross(c[0] - c[1], c[0] - c[3]) for c in surfaces])
        centres = np.array([c.mean(axis=0) for c in surfaces])
        surface = world.up_from_surface(normals, centres, points.positions_m)
    screen = value(parameters.get("POINT", {}), "Y_SCREEN")
    return (
        surface
        or world.up_from_labels(points.labels, points.positions_m)
        or (world.up_from_name(screen[0]) if len(screen) else None)
        or world.Up(2, 1, "nothing says otherwise")
    )


def _source(plate: PlateChannels, analog_rate_hz: float) -> PlateSource:
    wrench = local_wrench(plate.plate.kind, plate.channels, plate.plate)
    samples = check_samples(plate.channels, plate.counts, wrench.force_N[:, 2], analog_rate_hz)
    return PlateSource(plate.plate, wrench, samples, plate.baseline)


def _recording(
    path: Path,
    content: Mapping,
    points: Points,
    per_frame: int,
    up: world.Up,
    forces: Forces,
    findings: list[Finding],
) -> Recording:
    rate_hz = float(content["header"]["points"]["frame_rate"])
    rotation = world.rotation_to_z_up(up)
    turned = world.finding_about(up)
    return Recording(
        path=path,
        marker_rate_hz=rate_hz,
        labels=points.labels,
        markers_m=points.positions_m @ rotation.T,
        analog_rate_hz=rate_hz * per_frame,
        plates=forces.plates,
        findings=(*points.findings, *findings, *([turned] if turned else []), *forces.findings),
        rotation_world_lab=rotation,
        forces_note=forces.note,
        time0_s=content["header"]["points"]["first_frame"] / rate_hz,
    )
