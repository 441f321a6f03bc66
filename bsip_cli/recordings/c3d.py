"""C3D files: markers and force plates."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bsip_cli.recordings import world
from bsip_cli.recordings.analog import check_samples, sample_findings
from bsip_cli.recordings.c3d_content import Content, read_content
from bsip_cli.recordings.c3d_parameters import texts
from bsip_cli.recordings.c3d_person import stated_person
from bsip_cli.recordings.c3d_plates import PlateChannels, plate_surfaces, read_plates
from bsip_cli.recordings.c3d_points import Points, read_points
from bsip_cli.recordings.model import Finding, Recording
from bsip_cli.recordings.opened import Opened
from bsip_cli.recordings.plate_source import C3dPlate
from bsip_cli.recordings.plates import local_wrench
from bsip_cli.recordings.zero import without_baseline


def open_c3d(path: Path) -> Opened:
    """Markers of a C3D file, SI, Z-up world frame, and its plates as it describes them."""
    content = read_content(path)
    points = read_points(content, path)
    plates, plate_findings = read_plates(content, points.unit_m)
    up = _up(content, points, plate_surfaces(content.group("FORCE_PLATFORM"), points.unit_m))
    rate_hz = content.rate_hz * content.samples_per_frame
    rotation = world.rotation_to_z_up(up)
    opened = [_source(plate, rotation, rate_hz) for plate in plates]
    turned = world.finding_about(up)
    stated, about_person = stated_person(content.parameters)
    recording = Recording(
        path=path,
        marker_rate_hz=content.rate_hz,
        labels=points.labels,
        markers_m=points.positions_m @ rotation.T,
        analog_rate_hz=rate_hz,
        plates=(),
        findings=(
            *content.findings,
            *points.findings,
            *plate_findings,
            *([turned] if turned else []),
            *about_person,
            *(finding for _, found in opened for finding in found),
        ),
        rotation_world_lab=rotation,
        forces_note="",
        time0_s=content.first_frame / content.rate_hz,
        stated=stated,
    )
    return Opened(recording, tuple(source for source, _ in opened))


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


def _source(
    plate: PlateChannels, rotation_world_lab: np.ndarray, analog_rate_hz: float
) -> tuple[C3dPlate, list[Finding]]:
    """The plate with its baseline subtracted and its faulty samples marked."""
    description = plate.plate
    wrench = local_wrench(description.kind, plate.channels, description)
    samples = check_samples(plate.channels, plate.counts, wrench.force_N[:, 2], analog_rate_hz)
    down = (rotation_world_lab @ description.rotation_lab_plate()[:, 2])[2]
    usable = samples.usable()
    wrench, found = without_baseline(
        wrench, description.name, float(np.sign(down)), usable, plate.baseline
    )
    source = C3dPlate(description, wrench, usable, rotation_world_lab)
    return source, [*sample_findings(description.name, samples), *found]
