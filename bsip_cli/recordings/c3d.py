"""C3D files: markers and force plates."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bsip_cli.recordings import world
from bsip_cli.recordings.analog import check_samples
from bsip_cli.recordings.assemble import Forces, PlateSource, settle_forces
from bsip_cli.recordings.c3d_content import Content, read_content
from bsip_cli.recordings.c3d_parameters import texts
from bsip_cli.recordings.c3d_person import stated_person
from bsip_cli.recordings.c3d_plates import PlateChannels, plate_surfaces, read_plates
from bsip_cli.recordings.c3d_points import Points, read_points
from bsip_cli.recordings.cop_near_feet import Scene
from bsip_cli.recordings.model import Finding, Recording
from bsip_cli.recordings.plates import local_wrench
from bsip_cli.recordings.scene_size import settle_unit
from bsip_cli.recordings.units import length_in_m


def read_c3d(path: Path) -> Recording:
    """Markers and plates of a C3D file, SI, Z-up world frame."""
    content = read_content(path)
    unit_m, unit_findings = _length_unit(content)
    points = read_points(content, unit_m)
    plates, plate_findings = read_plates(content, unit_m)
    up = _up(content, points, plate_surfaces(content.group("FORCE_PLATFORM"), unit_m))
    analog_rate_hz = content.rate_hz * content.samples_per_frame
    rotation = world.rotation_to_z_up(up)
    scene = Scene(points.positions_m @ rotation.T, content.rate_hz, analog_rate_hz)
    forces = settle_forces([_source(p, analog_rate_hz) for p in plates], rotation, scene)
    findings = [*content.findings, *points.findings, *unit_findings, *plate_findings]
    return _recording(path, content, points, up, forces, findings)


def _length_unit(content: Content) -> tuple[float, list[Finding]]:
    """Size of the unit of points in metres."""
    stated = "".join(texts(content.group("POINT"), "UNITS")[:1])
    known = content.is_valid & (content.positions != 0).any(axis=-1)
    seen = np.where(known[..., None], content.positions, np.nan)
    return settle_unit(seen, stated, length_in_m(stated), "POINT:UNITS")


def _up(content: Content, points: Points, surfaces: Sequence[np.ndarray]) -> world.Up:
    """From the plates and the markers above them, else the labels, else what the file says."""
    surface = None
    if surfaces:
        normals = np.array([np.cross(c[0] - c[1], c[0] - c[3]) for c in surfaces])
        centres = np.array([c.mean(axis=0) for c in surfaces])
        surface = world.up_from_surface(normals, centres, points.positions_m)
    screen = texts(content.group("POINT"), "Y_SCREEN")
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
    content: Content,
    points: Points,
    up: world.Up,
    forces: Forces,
    findings: list[Finding],
) -> Recording:
    rotation = world.rotation_to_z_up(up)
    turned = world.finding_about(up)
    stated, about_person = stated_person(content.parameters)
    return Recording(
        path=path,
        marker_rate_hz=content.rate_hz,
        labels=points.labels,
        markers_m=points.positions_m @ rotation.T,
        analog_rate_hz=content.rate_hz * content.samples_per_frame,
        plates=forces.plates,
        findings=(*findings, *([turned] if turned else []), *forces.findings, *about_person),
        rotation_world_lab=rotation,
        forces_note=forces.note,
        time0_s=content.first_frame / content.rate_hz,
        stated=stated,
    )
